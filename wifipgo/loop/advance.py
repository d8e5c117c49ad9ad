r"""One iteration of the paper's loop as a straight line.

::

    commands -> Arena.drive -> poses -> odometry, relative poses (Eq. 2), lidar
                                 \--> paths -> links (Eq. 1) -> CSI -> profiles and peaks (Eqs. 5, 6, 10)
    relative poses x peaks -> weights (7-9, 11) -> edges -> optimised at a rendezvous (3) -> error (4)

What is true and what the robots believe are two objects: no policy, observation or
default reward is ever handed a `Truth`.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float

from wifipgo import se2
from wifipgo.arithmetic import plain_arithmetic
from wifipgo.graph import (
    NO_PINGS,
    Bearings,
    Edges,
    dead_reckoned,
    extended,
    extended_bearings,
    extended_pings,
    residual_error,
    retold,
)
from wifipgo.graph.per_robot_smoothing import Memory
from wifipgo.loop.aoa_measurements import Listening, bearings_of, listened, pings_of, weights_of
from wifipgo.loop.exchange import BYTES_PER_PING, BYTES_PER_POSE, hold_meetings
from wifipgo.loop.uncertainty import first_survey, taken_stock
from wifipgo.radio.channel.impairments import draw_standing
from wifipgo.radio.propagation.materials import Slab
from wifipgo.radio.propagation.paths import surfaces_of
from wifipgo.radio.turn_profiles import probe_links
from wifipgo.rendezvous import (
    NOBODY,
    discrepancies,
    no_calls,
    place_calls,
    raise_demands,
)
from wifipgo.scenarios import Scenario
from wifipgo.state import Belief, Commands, Tick, Truth, World
from wifipgo.streams import Streams
from wifipgo.threads import one_thread
from wifipgo.world.arena import Arena, Drive
from wifipgo.world.coverage import empty_map, reveal
from wifipgo.world.lidar import N_LIDAR_RAYS, scan
from wifipgo.world.placing import random_layout
from wifipgo.world.sensing import (
    indices,
    observe_own_places,
    observe_robots,
    odometry,
    robots_in_view,
    sight_robots,
)

_NEXT = np.array([0, 1])  # from (robot, index) to the next pose


@one_thread
@plain_arithmetic
def start(scenario: Scenario, streams: Streams) -> tuple[World, Tick]:
    """Lay out a world and let every robot sense once from its start, which it knows."""
    cfg, n = scenario.arena, scenario.n_robots
    layout = random_layout(n, cfg, rng=streams.layout)
    surfaces = surfaces_of(
        layout.walls_m,
        layout.obstacles_m,
        carrier_hz=scenario.radio.carrier_hz,
        wall=Slab(cfg.wall_material, cfg.wall_thickness_m),
        obstacle=Slab(cfg.obstacle_material, cfg.obstacle_thickness_m),
    )
    faces_m = layout.faces_m
    edges_m = np.concatenate([layout.walls_m, faces_m])
    standing = draw_standing(
        scenario.impairments,
        n_robots=n,
        n_antennas=len(scenario.radio.antennas_m) or 2,
        size_m=cfg.size_m,
        rng=streams.standing,
    )
    arena = Arena(layout, cfg, turn_rad=scenario.turn.turn_rad)
    memory = Memory(scenario.rendezvous) if scenario.rendezvous.estimator == "every_step" else None
    world = World(layout, faces_m, edges_m, surfaces, arena, standing, memory)
    seen_m = scenario.sensing.sensor_range_m
    cells = reveal(empty_map(layout, cfg.size_m), layout.starts[:, :2], faces_m, range_m=seen_m)
    truth = Truth(
        poses=layout.starts[:, None], bumps=np.zeros(n, dtype=int), distance_m=np.zeros(n), cells=cells
    )
    belief = _first_belief(layout.starts, scenario)
    return world, _sensed(truth, belief, Edges.empty(), world=world, scenario=scenario, streams=streams)


@one_thread
@plain_arithmetic
def advance(tick: Tick, commands: Commands, *, world: World, scenario: Scenario, streams: Streams) -> Tick:
    """One iteration: call, drive, turn and listen, measure, meet, take stock."""
    before, belief = tick.truth.poses[:, -1], tick.belief
    calls = place_calls(belief.calls, commands.request, belief.rate_mbit_s, belief.esnr_db, cfg=scenario.link)
    drive = world.arena.drive(before, commands.waypoints)
    motion = odometry(before, drive.poses, cfg=scenario.sensing, rng=streams.odometry)
    reckoned, steps = _dead_reckoned(belief._replace(calls=calls), motion, scenario)
    after = _sensed(
        _moved(tick.truth, drive, world, scenario),
        reckoned,
        steps,
        world=world,
        scenario=scenario,
        streams=streams,
    )
    return after._replace(belief=taken_stock(belief, after.belief, scenario))


def _first_belief(starts: Float[np.ndarray, "robots 3"], scenario: Scenario) -> Belief:
    """Every robot knows its start and nothing else."""
    n, slots = scenario.n_robots, scenario.n_slots
    return Belief(
        estimate=starts[:, None],
        covariance=np.zeros((n, 3, 3)),
        edges=Edges.empty(),
        bearings=Bearings.empty(scenario.turn.n_peaks),
        pings=NO_PINGS,
        err=np.zeros(n),
        lidar_m=np.zeros((n, N_LIDAR_RAYS)),
        esnr_db=np.zeros((n, n)),
        rate_mbit_s=np.zeros((n, n)),
        discrepancy=np.zeros((n, n)),
        slots=np.full((n, slots), NOBODY),
        profile=np.zeros((n, slots, scenario.turn.n_azimuths), dtype=np.float32),
        calls=no_calls(n, scenario.link),
        observed=np.zeros((n, n), dtype=int),
        held=np.zeros((n, n), dtype=int),
        last_met=np.zeros(n, dtype=int),
        met=(),
        bytes_sent=0,
        trail=np.zeros((n, 1, 3, 3)),
        recorded=np.zeros((n, 1, 3, 3)),
        survey=first_survey(starts, scenario),
        sighted=np.zeros((n, 2)),
    )


def _moved(truth: Truth, drive: Drive, world: World, scenario: Scenario) -> Truth:
    """Truth after a drive."""
    p_m = drive.poses[:, :2]
    return Truth(
        poses=np.concatenate([truth.poses, drive.poses[:, None]], axis=1),
        bumps=truth.bumps + drive.bumped,
        distance_m=truth.distance_m + se2.length(p_m - truth.poses[:, -1, :2]),
        cells=reveal(truth.cells, p_m, world.faces_m, range_m=scenario.sensing.sensor_range_m),
    )


def _dead_reckoned(
    belief: Belief, motion: Float[np.ndarray, "robots 3"], scenario: Scenario
) -> tuple[Belief, Edges]:
    """Append the pose that odometry suggests.

    Returns:
        What is believed then, and the odometry, which is not among its measurements yet.
    """
    n, tail = len(motion), indices(np.arange(len(motion)), belief.t)
    sigma = scenario.sensing.stated_sigmas(n)
    before = belief.estimate[:, -1]
    now = se2.compose(before, motion)
    covariances = np.concatenate([belief.covariance[None], belief.recorded[None, :, -1]])
    covariance, recorded = dead_reckoned(covariances, before, now, sigma)
    reckoned = belief._replace(
        estimate=np.concatenate([belief.estimate, now[:, None]], axis=1),
        covariance=covariance,
        trail=np.concatenate([belief.trail, covariance[:, None]], axis=1),
        recorded=np.concatenate([belief.recorded, recorded[:, None]], axis=1),
    )
    return reckoned, Edges.measured(tail=tail, head=tail + _NEXT, z=motion, sigma=sigma)


def _sensed(
    truth: Truth, belief: Belief, steps: Edges, *, world: World, scenario: Scenario, streams: Streams
) -> Tick:
    """Look, listen, measure, meet if due, and take stock of the error; ``steps`` is the odometry."""
    poses, link = truth.poses[:, -1], scenario.link
    links = probe_links(poses[:, :2], world.surfaces, scenario.radio, world.standing)
    seen = robots_in_view(poses, world.faces_m, range_m=scenario.sensing.sensor_range_m)
    heard = listened(
        links, belief.calls, seen, poses[:, 2], world.standing, scenario=scenario, rng=streams.channel
    )
    found, directions = _measured(truth, belief, seen, heard, world=world, scenario=scenario, streams=streams)
    pings = pings_of(heard, belief, scenario)
    n_packets = len(pings.observer) * scenario.turn.n_positions
    linked = links.rate_mbit_s >= link.q_mbit_s
    edges, n_bytes = _told_where_linked(extended(belief.edges, steps, *found), belief.estimate, linked)
    belief = belief._replace(
        edges=edges,
        bearings=extended_bearings(belief.bearings, directions) if len(directions) else belief.bearings,
        pings=extended_pings(belief.pings, pings),
        bytes_sent=belief.bytes_sent + n_bytes + BYTES_PER_PING * n_packets,
        lidar_m=scan(
            poses,
            world.edges_m,
            robot_radius_m=scenario.arena.robot_radius_m,
            range_m=scenario.arena.lidar_range_m,
        ),
        esnr_db=links.esnr_db,
        rate_mbit_s=links.rate_mbit_s,
        slots=heard.slots,
        profile=heard.by_slot,
        observed=belief.observed + seen,
        sighted=sight_robots(poses, world.faces_m, range_m=scenario.visual_range_m, rng=streams.sight),
        met=(),
    )
    belief = hold_meetings(belief, scenario, rng=streams.messages)
    if world.memory is not None:
        belief = _solved_at_every_step(belief, world.memory)
    return Tick(truth=truth, belief=_concluded(belief, scenario))


def _concluded(belief: Belief, scenario: Scenario) -> Belief:
    """Error, demands and discrepancies after all that was measured and optimised."""
    calls = raise_demands(belief.calls, belief.rate_mbit_s, step_mbit_s=1.0)
    return belief._replace(
        err=residual_error(belief.estimate, belief.edges, weights=scenario.rendezvous.err_weights),
        calls=calls,
        discrepancy=discrepancies(calls, belief.rate_mbit_s, cfg=scenario.link),
    )


def _measured(
    truth: Truth,
    belief: Belief,
    seen: Bool[np.ndarray, "robots robots"],
    heard: Listening,
    *,
    world: World,
    scenario: Scenario,
    streams: Streams,
) -> tuple[list[Edges], Bearings]:
    """Relative poses of robots and of places (Eq. 2), the former weighted if the scenario asks for it.

    Returns:
        Them, and the directions in which the robots heard each other.
    """
    cfg = scenario.sensing
    others = observe_robots(
        truth.poses[:, -1], belief.t, seen, cfg=cfg, rng=streams.sensing, outlier_rng=streams.outliers
    )
    places = observe_own_places(truth.poses, world.faces_m, cfg=cfg, rng=streams.sensing)
    found = []
    if len(others.z):
        weight = weights_of(others, heard, scenario)
        told = belief.estimate[others.head[:, 0], others.head[:, 1]]
        found.append(
            Edges.measured(
                tail=others.tail, head=others.head, z=others.z, sigma=others.sigma, weight=weight, told=told
            )
        )
    if len(places.z):
        found.append(Edges.measured(tail=places.tail, head=places.head, z=places.z, sigma=places.sigma))
    return found, bearings_of(others, heard, scenario)


def _told_where_linked(
    edges: Edges, estimate: Float[np.ndarray, "robots times 3"], linked: Bool[np.ndarray, "robots robots"]
) -> tuple[Edges, int]:
    """Robots whose link carries the desired rate tell each other where they now think they were.

    Returns:
        The measurements, and the bytes that this took: only what changed is sent.
    """
    rows = linked.take(edges.tail[:, 0] * len(linked) + edges.head[:, 0]).nonzero()[0]
    if not len(rows):
        return edges, 0
    now = estimate[edges.head[rows, 0], edges.head[rows, 1]]
    new = (now != edges.told[rows]).any(axis=1)
    if not new.any():
        return edges, 0
    told = edges.told.copy()
    told[rows[new]] = now[new]
    return replace(edges, told=told), BYTES_PER_POSE * int(new.sum())


def _solved_at_every_step(belief: Belief, memory: Memory) -> Belief:
    """Let every robot solve by itself; those that met tell each other the new poses."""
    estimate, covariance = memory.smoothed(
        belief.estimate,
        belief.covariance,
        edges=belief.edges,
        bearings=belief.bearings,
        sent=belief.held,
        pings=belief.pings,
    )
    edges = belief.edges
    for group in belief.met:
        edges = retold(edges, estimate, robots=group)
    return belief._replace(estimate=estimate, covariance=covariance, edges=edges)
