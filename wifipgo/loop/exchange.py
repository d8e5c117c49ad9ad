"""What robots that meet send each other, and what they then know (paper Secs. 3 and 5).

A rendezvous is an exchange: trajectories, measurements and bearings. Under the estimator
"at_rendezvous" it is also the only time at which poses are optimised (Eq. 3).
"""

from contextlib import suppress
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from wifipgo.errors import NumericalError
from wifipgo.graph import (
    GUARDS,
    Bearings,
    Channel,
    DistributedConfig,
    Edges,
    end_covariances,
    retold,
    solve_by_robots,
    solve_guarded,
)
from wifipgo.graph.outliers.methods import gate_weights
from wifipgo.rendezvous import NOBODY, RendezvousConfig, due_groups
from wifipgo.scenarios import Scenario
from wifipgo.state import Belief

# Bytes of one pose, measurement and bearing as sent: 3 float64; two keys, z, sigma and weight; two keys,
# azimuth and sigma.
BYTES_PER_POSE, BYTES_PER_EDGE, BYTES_PER_BEARING = 24, 64, 32
# A packet of a turn that says where its sender is: 802.11 header and check, position, its covariance.
BYTES_PER_PING = 28 + 16 + 24
# Robots that solve for themselves stop when none moves further, in m; messages are sent up to so often.
_THRESHOLD_M, _ATTEMPTS = 0.01, 10


class Meeting(NamedTuple):
    """What a rendezvous leaves behind.

    Attributes:
        estimate: Poses of all robots.
        covariance: Of their last poses.
        edges: Measurements, with what those that met told each other.
        bytes_sent: Exchanged.
        served: Whether the robots know what they met for; if not they try again.
    """

    estimate: Float[np.ndarray, "robots times 3"]
    covariance: Float[np.ndarray, "robots 3 3"]
    edges: Edges
    bytes_sent: int
    served: bool = True


def hold_meetings(belief: Belief, scenario: Scenario, *, rng: np.random.Generator) -> Belief:
    """Hold every rendezvous that is due; a call that was up in a group is served.

    Args:
        belief: What the robots know, the measurements of this iteration among it.
        scenario: Says when a meeting is due, and who solves what.
        rng: Chance of messages that are lost.
    """
    cfg, q_mbit_s = scenario.rendezvous, scenario.link.q_mbit_s
    for group in due_groups(belief.observed, belief.rate_mbit_s, kappa=cfg.kappa, q_mbit_s=q_mbit_s):
        belief = _after(belief, group, _meet(belief, group, cfg=cfg, rng=rng))
    return belief


def _after(belief: Belief, group: list[int], meeting: Meeting) -> Belief:
    """What the robots believe when a meeting is over."""
    belief = belief._replace(
        estimate=meeting.estimate,
        covariance=meeting.covariance,
        edges=meeting.edges,
        bytes_sent=belief.bytes_sent + meeting.bytes_sent,
    )
    if not meeting.served:
        return belief
    observed, last_met, held = belief.observed.copy(), belief.last_met.copy(), belief.held.copy()
    callee, among = belief.calls.callee.copy(), np.ix_(group, group)
    observed[among], held[among] = 0, belief.t + 1
    last_met[group], callee[group] = belief.t, NOBODY
    return belief._replace(
        observed=observed,
        held=held,
        last_met=last_met,
        calls=belief.calls._replace(callee=callee),
        met=(*belief.met, tuple(group)),
    )


def _meet(belief: Belief, group: list[int], *, cfg: RendezvousConfig, rng: np.random.Generator) -> Meeting:
    """Exchange what the way of solving needs, solve (Eq. 3), and tell each other the new poses.

    Only what the members measured or were told enters. Gates on direction weighed the measurements
    when they came.
    """
    if cfg.estimator == "every_step":
        n_bytes = _bytes_of_news(belief, group)
        return Meeting(belief.estimate, belief.covariance, belief.edges, n_bytes)
    if cfg.backend == "distributed":
        return _solved_by_robots(belief, group, cfg=cfg, rng=rng)
    guard = GUARDS[cfg.outliers]
    at_once = replace(guard, gate="none") if guard.by_direction else guard
    n_bytes = _bytes_of_graphs(belief.estimate, belief.edges, belief.bearings, group)
    try:
        solved, report = solve_guarded(
            belief.estimate,
            belief.edges,
            belief.bearings,
            robots=group,
            outliers=at_once,
            third_party=cfg.third_party,
            covariances=True,
        )
    except NumericalError:  # what they measured cannot be solved for, so they go on as they were
        return Meeting(belief.estimate, belief.covariance, belief.edges, n_bytes, served=False)
    covariance = belief.covariance.copy()
    if report.end_covariances is not None:  # else the last ones stay
        covariance[group] = report.end_covariances
    return Meeting(solved, covariance, retold(belief.edges, solved, robots=group), n_bytes)


def _solved_by_robots(
    belief: Belief, group: list[int], *, cfg: RendezvousConfig, rng: np.random.Generator
) -> Meeting:
    """Let each robot solve for its own poses; what has not converged is not believed."""
    guard = GUARDS[cfg.outliers]
    gate = guard.gate if guard.gate == "pcm" else "none"
    weight = gate_weights(belief.edges, None, gate, group)
    edges = replace(belief.edges, weight=belief.edges.weight * weight)
    channel = Channel(loss=cfg.message_loss, attempts=_ATTEMPTS, rng=rng)
    config = DistributedConfig(threshold=_THRESHOLD_M)
    try:
        solved, report = solve_by_robots(
            belief.estimate,
            edges,
            robots=group,
            loss=guard.loss,
            third_party=cfg.third_party,
            config=config,
            channel=channel,
        )
    except NumericalError:
        report = None
    if report is None or not report.converged:
        return Meeting(belief.estimate, belief.covariance, belief.edges, channel.bytes_sent, served=False)
    covariance = belief.covariance.copy()
    with suppress(NumericalError):  # then the last ones stay
        covariance[group] = end_covariances(solved, edges, robots=group, third_party=cfg.third_party)
    return Meeting(solved, covariance, retold(belief.edges, solved, robots=group), channel.bytes_sent)


def _bytes_of_graphs(
    estimate: Float[np.ndarray, "robots times 3"], edges: Edges, bearings: Bearings, group: list[int]
) -> int:
    """Every member sends its trajectory, measurements and bearings to every other."""
    member = np.zeros(len(estimate), dtype=bool)
    member[group] = True
    n_edges = int(member[edges.tail[:, 0]].sum())
    n_bearings = int(member[bearings.observer[:, 0]].sum())
    content = BYTES_PER_POSE * len(group) * estimate.shape[1]
    content += BYTES_PER_EDGE * n_edges + BYTES_PER_BEARING * n_bearings
    return content * (len(group) - 1)


def _bytes_of_news(belief: Belief, group: list[int]) -> int:
    """Every member sends every other what that does not hold yet."""
    n_bytes = 0
    for receiver in group:
        known = belief.held[receiver]
        for sender in (robot for robot in group if robot != receiver):
            n_edges = int((belief.edges.tail[:, 0] == sender) @ (belief.edges.measured_at >= known[sender]))
            heard = belief.bearings.observer
            n_heard = int((heard[:, 0] == sender) @ (heard[:, 1] >= known[sender]))
            n_bytes += BYTES_PER_POSE * int(belief.t + 1 - known[sender])
            n_bytes += BYTES_PER_EDGE * n_edges + BYTES_PER_BEARING * n_heard
    return n_bytes
