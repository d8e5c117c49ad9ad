"""What robots that meet send each other, and what they then know (paper Secs. 3 and 5).

A rendezvous is an exchange: trajectories, measurements and bearings. Under the estimator
"at_rendezvous" it is also the only time at which poses are optimised (Eq. 3).
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int, UInt64

from wifipgo.graph.backends import BACKENDS, Solution
from wifipgo.graph.config import GraphConfig
from wifipgo.graph.distributed import Channel
from wifipgo.graph.edges import Edges, group_of, refresh_reported_within
from wifipgo.graph.outliers.methods import OUTLIER_METHODS
from wifipgo.graph.per_robot_smoothing import PerRobotSmoothers
from wifipgo.loop.routes import routed_mbit_s
from wifipgo.loop.transfer import BYTES_PER_POSE, transferred
from wifipgo.rendezvous import NOBODY, due_groups
from wifipgo.rows import Chance, Rows, draw_keys
from wifipgo.scenarios.scenario import Scenario
from wifipgo.state import MeasurementLog, Paths, Team

# Bytes of one measurement and bearing as sent: two keys, z, sigma and weight; two keys, azimuth and sigma.
BYTES_PER_EDGE, BYTES_PER_BEARING = 64, 32
# A packet of a turn that says where its sender is: 802.11 header and check, position, its covariance.
BYTES_PER_PING = 28 + 16 + 24
_ATTEMPTS = 10  # how often a message is sent at most
Group = Sequence[int]


class Meetings(NamedTuple):
    """What rendezvous leave behind.

    Attributes:
        paths: Poses of all robots, and covariances of the last.
        edges: Measurements, with what those that met told each other.
        bytes_sent: Exchanged by each group.
        airtime_s: Of the messages by which each group's robots solved, at the rates of its links.
        served: Whether each group's robots know what they met for; if not they try again.
    """

    paths: Paths
    edges: Edges
    bytes_sent: Int[np.ndarray, " groups"]
    airtime_s: Float[np.ndarray, " groups"]
    served: tuple[bool, ...]


def exchange(
    paths: Paths,
    log: MeasurementLog,
    team: Team,
    rate_mbit_s: Float[np.ndarray, "rows peers"],
    *,
    scenario: Scenario,
    rng: Chance,
) -> tuple[Paths, MeasurementLog, Team]:
    """Hold every rendezvous that is due, all at once; a call that was up in a group is served.

    Nobody is in two groups, and what outsiders told a member stands in the log already, so no meeting
    depends on another.

    Args:
        paths: What the robots believe.
        log: What they measured, in this iteration too.
        team: Who called and observed whom.
        rate_mbit_s: Of the links.
        scenario: Says when a meeting is due, and who solves what.
        rng: Chance of messages that are lost.
    """
    kappa, q_mbit_s = scenario.rendezvous.kappa, scenario.link.q_mbit_s
    # Whoever meets: what a meeting loses depends on the iteration and its members.
    rows = Rows.of(*team.observed.shape)
    keys = draw_keys(rng, rows.n_worlds) if scenario.graph.message_loss > 0.0 else None
    observed = team.observed
    if scenario.link.exchange_s > 0.0:
        team, complete = transferred(team, rate_mbit_s, paths.t, scenario)
        observed = np.where(complete, observed, 0)
    groups = due_groups(observed, rate_mbit_s, kappa=kappa, q_mbit_s=q_mbit_s)
    if not groups:
        return paths, log, team
    channels = _channels(scenario.graph, rate_mbit_s, groups, _chances(keys, groups, rows))
    meetings = _meet(paths, log, team, groups, cfg=scenario.graph, channels=channels)
    world = rows.world(np.array([group[0] for group in groups]))
    sent = np.bincount(world, meetings.bytes_sent, minlength=rows.n_worlds).astype(np.int64)
    airtime_s = np.bincount(world, meetings.airtime_s, minlength=rows.n_worlds)
    team = team._replace(bytes_sent=team.bytes_sent + sent, airtime_s=team.airtime_s + airtime_s)
    served = [group for group, known in zip(groups, meetings.served, strict=True) if known]
    return meetings.paths, log._replace(edges=meetings.edges), _met(team, served, paths.t)


def _chances(
    keys: UInt64[np.ndarray, " worlds"] | None, groups: Sequence[Group], rows: Rows
) -> Sequence[np.random.Generator | None]:
    """Each group's own chance, by its world's key and its members' numbers there; none without keys."""
    if keys is None:
        return [None] * len(groups)
    return [
        np.random.default_rng([int(keys[group[0] // rows.n_robots]), *(row % rows.n_robots for row in group)])
        for group in groups
    ]


def _channels(
    cfg: GraphConfig,
    rate_mbit_s: Float[np.ndarray, "rows peers"],
    groups: Sequence[Group],
    chances: Sequence[np.random.Generator | None],
) -> list[Channel]:
    """A channel a group; what it carries takes its time on the links as they are now.

    Ways through a group are only looked for where messages will take them.
    """
    sends = BACKENDS[cfg.backend].sends and not cfg.incremental
    rates = [routed_mbit_s(rate_mbit_s, group) if sends else None for group in groups]
    return [
        Channel(loss=cfg.message_loss, attempts=_ATTEMPTS, rng=rng, rate_mbit_s=rate)
        for rate, rng in zip(rates, chances, strict=True)
    ]


def _met(team: Team, groups: Sequence[Group], t: int) -> Team:
    """Calls are served, and what the members had at iteration ``t`` each of them has."""
    observed, last_met, held = team.observed.copy(), team.last_met.copy(), team.held.copy()
    callee, (member, peer) = team.calls.callee.copy(), _pairs(groups, team.observed.shape)
    under_way = team.under_way_bytes.copy()
    observed[member, peer], held[member, peer], under_way[member, peer] = 0, t + 1, 0.0
    last_met[member], callee[member] = t, NOBODY
    return team._replace(
        observed=observed,
        held=held,
        last_met=last_met,
        calls=team.calls._replace(callee=callee),
        met=(*team.met, *map(tuple, groups)),
        under_way_bytes=under_way,
    )


def _pairs(
    groups: Sequence[Group], shape: tuple[int, ...]
) -> tuple[Int[np.ndarray, " pairs"], Int[np.ndarray, " pairs"]]:
    """Rows and peers of all pairs of members of one group, everyone with oneself among them."""
    rows, of = Rows.of(*shape), group_of(groups, shape[0])
    member = np.flatnonzero(of >= 0)
    among = rows.by_world(of)[rows.world(member)] == of[member, None]
    k, peer = among.nonzero()
    return member[k], peer


def _meet(
    paths: Paths,
    log: MeasurementLog,
    team: Team,
    groups: Sequence[Group],
    *,
    cfg: GraphConfig,
    channels: Sequence[Channel],
) -> Meetings:
    """Exchange what the way of solving needs, solve (Eq. 3), and tell each other the new poses.

    Only what the members measured or were told enters. Gates on direction weighed the measurements
    when they came.
    """
    if cfg.incremental:
        news, still = _bytes_of_news(paths, log, team, groups), np.zeros(len(groups))
        return Meetings(paths, log.edges, news, still, (True,) * len(groups))
    backend = BACKENDS[cfg.backend]
    found = cfg.solve(
        paths.estimate,
        log.edges,
        log.bearings,
        groups=groups,
        method=OUTLIER_METHODS[cfg.outliers].at_rendezvous(),
        third_party=cfg.third_party,
        channels=channels,
    )
    n_bytes = _bytes_of_graphs(paths, log, groups)
    if backend.sends:
        n_bytes = np.array([channel.bytes_sent for channel in channels], dtype=np.int64)
    # What some measured cannot be solved for, so they go on as they were.
    solved = [(group, one) for group, one in zip(groups, found, strict=True) if one is not None]
    paths = _optimised(paths, solved)
    edges = refresh_reported_within(log.edges, paths.estimate, groups=[group for group, _ in solved])
    airtime_s = np.array([channel.airtime_s for channel in channels])
    return Meetings(paths, edges, n_bytes, airtime_s, tuple(one is not None for one in found))


def _optimised(paths: Paths, solved: Sequence[tuple[Group, Solution]]) -> Paths:
    """Paths with other poses of those that met, and other covariances of the last poses, if known."""
    if not solved:
        return paths
    estimate, covariance = paths.estimate.copy(), paths.covariance.copy()
    for group, (poses, known) in solved:
        estimate[list(group)] = poses
        if known is not None:
            covariance[list(group)] = known
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
    edges = refresh_reported_within(log.edges, estimate, groups=team.met)
    solved = paths._replace(estimate=estimate, covariance=covariance, smoothing=smoothing)
    return solved, log._replace(edges=edges)


def _bytes_of_graphs(
    paths: Paths, log: MeasurementLog, groups: Sequence[Group]
) -> Int[np.ndarray, " groups"]:
    """Every member sends its trajectory, measurements and bearings to every other."""
    n_robots, times = paths.estimate.shape[:2]
    content = np.full(n_robots, BYTES_PER_POSE * times)
    content += BYTES_PER_EDGE * np.bincount(log.edges.tail[:, 0], minlength=n_robots)
    content += BYTES_PER_BEARING * np.bincount(log.bearings.observer[:, 0], minlength=n_robots)
    return np.array([content[list(group)].sum() * (len(group) - 1) for group in groups])


def _bytes_of_news(
    paths: Paths, log: MeasurementLog, team: Team, groups: Sequence[Group]
) -> Int[np.ndarray, " groups"]:
    """Every member sends every other what that does not hold yet."""
    receiver, peer = _pairs(groups, team.held.shape)
    known, of = team.held[receiver, peer].astype(np.int64), group_of(groups, len(team.held))
    sender = receiver - receiver % team.held.shape[1] + peer
    n_bytes = BYTES_PER_POSE * (paths.t + 1 - known)
    n_bytes += BYTES_PER_EDGE * _later(log.edges.tail[:, 0], log.edges.measured_at, sender, known)
    heard = log.bearings.observer
    n_bytes += BYTES_PER_BEARING * _later(heard[:, 0], heard[:, 1], sender, known)
    return np.bincount(of[receiver], n_bytes * (sender != receiver), minlength=len(groups)).astype(np.int64)


def _later(
    robot: Int[np.ndarray, " rows"],
    time: Int[np.ndarray, " rows"],
    sender: Int[np.ndarray, " pairs"],
    since: Int[np.ndarray, " pairs"],
) -> Int[np.ndarray, " pairs"]:
    """How many rows are of each sender, and not from before ``since``."""
    stride = 1 + int(max(time.max(initial=0), since.max(initial=0)))
    ours = np.isin(robot, sender)
    when = np.sort(robot[ours] * stride + time[ours])
    return when.searchsorted((sender + 1) * stride) - when.searchsorted(sender * stride + since)
