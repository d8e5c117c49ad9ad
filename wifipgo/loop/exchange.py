"""What robots that meet send each other, and what they then know (paper Secs. 3 and 5).

A rendezvous is an exchange: trajectories, measurements and bearings. Under the estimator
"at_rendezvous" it is also the only time at which poses are optimised (Eq. 3).
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from wifipgo.graph.backends import BACKENDS
from wifipgo.graph.config import GraphConfig
from wifipgo.graph.distributed import Channel
from wifipgo.graph.edges import Edges, refresh_reported
from wifipgo.graph.outliers.methods import OUTLIER_METHODS
from wifipgo.graph.per_robot_smoothing import PerRobotSmoothers
from wifipgo.rendezvous import NOBODY, due_groups
from wifipgo.scenarios.scenario import Scenario
from wifipgo.state import MeasurementLog, Paths, Team

# Bytes of one pose, measurement and bearing as sent: 3 float64; two keys, z, sigma and weight; two keys,
# azimuth and sigma.
BYTES_PER_POSE, BYTES_PER_EDGE, BYTES_PER_BEARING = 24, 64, 32
# A packet of a turn that says where its sender is: 802.11 header and check, position, its covariance.
BYTES_PER_PING = 28 + 16 + 24
_ATTEMPTS = 10  # how often a message is sent at most


class Meeting(NamedTuple):
    """What a rendezvous leaves behind.

    Attributes:
        paths: Poses of all robots, and covariances of the last.
        edges: Measurements, with what those that met told each other.
        bytes_sent: Exchanged.
        served: Whether the robots know what they met for; if not they try again.
    """

    paths: Paths
    edges: Edges
    bytes_sent: int
    served: bool = True


def exchange(
    paths: Paths,
    log: MeasurementLog,
    team: Team,
    rate_mbit_s: Float[np.ndarray, "robots robots"],
    *,
    scenario: Scenario,
    rng: np.random.Generator,
) -> tuple[Paths, MeasurementLog, Team]:
    """Hold every rendezvous that is due; a call that was up in a group is served.

    Args:
        paths: What the robots believe.
        log: What they measured, in this iteration too.
        team: Who called and observed whom.
        rate_mbit_s: Of the links.
        scenario: Says when a meeting is due, and who solves what.
        rng: Chance of messages that are lost.
    """
    kappa, q_mbit_s = scenario.rendezvous.kappa, scenario.link.q_mbit_s
    for group in due_groups(team.observed, rate_mbit_s, kappa=kappa, q_mbit_s=q_mbit_s):
        meeting = _meet(paths, log, team, group, cfg=scenario.graph, rng=rng)
        paths, log = meeting.paths, log._replace(edges=meeting.edges)
        team = team._replace(bytes_sent=team.bytes_sent + meeting.bytes_sent)
        team = _met(team, group, paths.t) if meeting.served else team
    return paths, log, team


def _met(team: Team, group: list[int], t: int) -> Team:
    """Calls are served, and what the members had at iteration ``t`` each of them has."""
    observed, last_met, held = team.observed.copy(), team.last_met.copy(), team.held.copy()
    callee, among = team.calls.callee.copy(), np.ix_(group, group)
    observed[among], held[among] = 0, t + 1
    last_met[group], callee[group] = t, NOBODY
    return team._replace(
        observed=observed,
        held=held,
        last_met=last_met,
        calls=team.calls._replace(callee=callee),
        met=(*team.met, tuple(group)),
    )


def _meet(
    paths: Paths,
    log: MeasurementLog,
    team: Team,
    group: list[int],
    *,
    cfg: GraphConfig,
    rng: np.random.Generator,
) -> Meeting:
    """Exchange what the way of solving needs, solve (Eq. 3), and tell each other the new poses.

    Only what the members measured or were told enters. Gates on direction weighed the measurements
    when they came.
    """
    if cfg.incremental:
        return Meeting(paths, log.edges, _bytes_of_news(paths, log, team, group))
    backend = BACKENDS[cfg.backend]
    channel = Channel(loss=cfg.message_loss, attempts=_ATTEMPTS, rng=rng)
    found = backend.solve(
        paths.estimate,
        log.edges,
        log.bearings,
        robots=group,
        method=OUTLIER_METHODS[cfg.outliers].at_rendezvous(),
        third_party=cfg.third_party,
        channel=channel,
    )
    n_bytes = channel.bytes_sent if backend.sends else _bytes_of_graphs(paths, log, group)
    if found is None:  # what they measured cannot be solved for, so they go on as they were
        return Meeting(paths, log.edges, n_bytes, served=False)
    return Meeting(
        _optimised(paths, found.poses, group, found.covariances),
        refresh_reported(log.edges, found.poses, robots=group),
        n_bytes,
    )


def _optimised(
    paths: Paths,
    estimate: Float[np.ndarray, "robots times 3"],
    group: list[int],
    known: Float[np.ndarray, "group 3 3"] | None,
) -> Paths:
    """Paths with other poses, and other covariances of the last poses of those that met, if known."""
    covariance = paths.covariance.copy()
    if known is not None:
        covariance[group] = known
    return paths._replace(estimate=estimate, covariance=covariance)


def solve_at_every_step(
    paths: Paths, log: MeasurementLog, team: Team, smoothers: PerRobotSmoothers | None
) -> tuple[Paths, MeasurementLog]:
    """Let every robot solve by itself, if they do; those that met tell each other the new poses."""
    if smoothers is None or paths.smoothing is None:
        return paths, log
    (estimate, covariance), smoothing = smoothers.smoothed(
        paths.smoothing,
        paths.estimate,
        paths.covariance,
        edges=log.edges,
        bearings=log.bearings,
        sent=team.held,
        pings=log.pings,
    )
    edges = log.edges
    for group in team.met:
        edges = refresh_reported(edges, estimate, robots=group)
    solved = paths._replace(estimate=estimate, covariance=covariance, smoothing=smoothing)
    return solved, log._replace(edges=edges)


def _bytes_of_graphs(paths: Paths, log: MeasurementLog, group: list[int]) -> int:
    """Every member sends its trajectory, measurements and bearings to every other."""
    member = np.zeros(len(paths.estimate), dtype=bool)
    member[group] = True
    n_edges = int(member[log.edges.tail[:, 0]].sum())
    n_bearings = int(member[log.bearings.observer[:, 0]].sum())
    content = BYTES_PER_POSE * len(group) * paths.estimate.shape[1]
    content += BYTES_PER_EDGE * n_edges + BYTES_PER_BEARING * n_bearings
    return content * (len(group) - 1)


def _bytes_of_news(paths: Paths, log: MeasurementLog, team: Team, group: list[int]) -> int:
    """Every member sends every other what that does not hold yet."""
    n_bytes, edges, heard = 0, log.edges, log.bearings.observer
    for receiver in group:
        known = team.held[receiver]
        for sender in (robot for robot in group if robot != receiver):
            n_edges = int((edges.tail[:, 0] == sender) @ (edges.measured_at >= known[sender]))
            n_heard = int((heard[:, 0] == sender) @ (heard[:, 1] >= known[sender]))
            n_bytes += BYTES_PER_POSE * int(paths.t + 1 - known[sender])
            n_bytes += BYTES_PER_EDGE * n_edges + BYTES_PER_BEARING * n_heard
    return n_bytes
