r"""One iteration of the paper's loop as a straight line.

::

    commands -> Arena.drive -> poses -> odometry, relative poses (Eq. 2), lidar
                                 \--> paths -> links (Eq. 1) -> CSI -> profiles and peaks (Eqs. 5, 6, 10)
    relative poses x peaks -> weights (7-9, 11) -> edges -> optimised at a rendezvous (3) -> error (4)

What is true and what the robots believe are two objects: no policy, observation or
default reward is ever handed a `Truth`.
"""

import numpy as np
from jaxtyping import Float

from wifipgo.arithmetic import plain_arithmetic
from wifipgo.graph.edges import Edges
from wifipgo.graph.metrics import Judged, residual_error
from wifipgo.loop.aoa_measurements import Heard, listen_to_team
from wifipgo.loop.dead_reckoning import dead_reckon, drive
from wifipgo.loop.exchange import exchange, solve_at_every_step
from wifipgo.loop.measurements import (
    log_measurements,
    measure_relative_poses,
    refresh_reported_where_linked,
    sense,
)
from wifipgo.loop.scene import scene_of
from wifipgo.loop.uncertainty import propagate_uncertainty
from wifipgo.radio.links import Links, probe_links, read_levels
from wifipgo.rendezvous import (
    KAPPA_SINCE,
    Calls,
    counted_from_calls,
    discrepancies,
    place_calls,
    raise_demands,
)
from wifipgo.scenarios.scenario import Scenario
from wifipgo.state import Belief, Commands, MeasurementLog, Paths, RadioBelief, Tick, Truth, World
from wifipgo.streams import Streams
from wifipgo.threads import one_thread
from wifipgo.world.sensing import robots_in_view


@one_thread
@plain_arithmetic
def advance(tick: Tick, commands: Commands, *, world: World, scenario: Scenario, streams: Streams) -> Tick:
    """One iteration: call, drive, turn and listen, measure, meet, propagate uncertainty.

    Args:
        tick: State before. It stays as it is: advanced again with streams in the same state it gives an
            equal result, whatever was advanced in between.
        commands: Waypoints and requests.
        world: What stands still; its engines start from the tick.
        scenario: Rules and noise.
        streams: Chance; each generator moves on by what was drawn.
    """
    before, radio = tick.belief, tick.belief.radio
    calls = place_calls(
        before.team.calls, commands.request, radio.rate_mbit_s, radio.esnr_db, cfg=scenario.link
    )
    team = before.team._replace(calls=calls)
    if KAPPA_SINCE[scenario.rendezvous.kappa_since]:
        team = team._replace(observed=counted_from_calls(team.observed, before.team.calls, calls))
    truth, motion = drive(
        tick.truth, commands.waypoints, world=world, scenario=scenario, rng=streams.odometry
    )
    paths, odometry = dead_reckon(before.paths, motion, scenario)
    belief = before._replace(team=team, paths=paths)
    after = observe(truth, belief, odometry, world=world, scenario=scenario, streams=streams)
    return after._replace(belief=propagate_uncertainty(before, after.belief, scenario))


def observe(
    truth: Truth, belief: Belief, odometry: Edges, *, world: World, scenario: Scenario, streams: Streams
) -> Tick:
    """Look, listen, measure, meet if due, and conclude.

    Args:
        truth: After the drive.
        belief: Dead-reckoned, with the calls that are up.
        odometry: Of the drive, which is not in the log yet.
        world: What stands still.
        scenario: Rules and noise.
        streams: Chance.
    """
    scene, poses, team = scene_of(world, truth), truth.poses[:, -1], belief.team
    t, rows = truth.poses.shape[1] - 1, world.rows
    links = probe_links(poses[:, :2], scene.surfaces, scenario.radio, world.standing, rows=rows, t=t)
    links = read_levels(links, sigma_db=scenario.impairments.esnr_sigma_db, rng=streams.channel)
    seen = robots_in_view(poses, scene.faces_m, range_m=scenario.sensing.sensor_range_m)
    heard = listen_to_team(
        links, team.calls, seen, poses[:, 2], world.standing, scenario=scenario, rng=streams.channel
    )
    measured = measure_relative_poses(truth, seen, scene, scenario, streams)
    log, n_bytes = log_measurements(belief, odometry, measured, heard, scenario)
    linked = links.rate_mbit_s >= scenario.link.q_mbit_s
    log, told = refresh_reported_where_linked(log, belief.paths.estimate, linked)
    team = team._replace(observed=team.observed + seen, met=(), bytes_sent=team.bytes_sent + n_bytes + told)
    paths, log, team = exchange(
        belief.paths, log, team, links.rate_mbit_s, scenario=scenario, rng=streams.messages
    )
    paths, log = solve_at_every_step(paths, log, team, world.smoothers)
    calls = raise_demands(team.calls, links.rate_mbit_s, step_mbit_s=1.0)
    concluded = Belief(
        paths=paths,
        log=log,
        radio=_shown(links, heard, calls, scenario),
        sensed=sense(truth, scene, scenario, rng=streams.sight),
        team=team._replace(calls=calls),
        coverage=belief.coverage,
        err=_err(belief, paths, log, scenario),
    )
    return Tick(truth, concluded)


def _err(
    before: Belief, paths: Paths, log: MeasurementLog, scenario: Scenario
) -> Float[np.ndarray, " robots"]:
    """Err_i of Eq. 4, brought up to date."""
    judged = Judged(before.err, before.paths.estimate, before.log.edges)
    return residual_error(paths.estimate, log.edges, weights=scenario.graph.err_weights, before=judged)


def _shown(links: Links, heard: Heard, calls: Calls, scenario: Scenario) -> RadioBelief:
    """What robots know of their links after an iteration."""
    return RadioBelief(
        esnr_db=links.esnr_db,
        rate_mbit_s=links.rate_mbit_s,
        discrepancy=discrepancies(calls, links.rate_mbit_s, cfg=scenario.link),
        slots=heard.slots,
        profile=heard.by_slot,
    )
