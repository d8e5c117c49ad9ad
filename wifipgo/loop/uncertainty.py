"""What robots conclude from an iteration about their own knowledge: how sure they are, and what they saw."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float, Int

from wifipgo.graph.covariance import (
    covariance_after_closure,
    loop_closures_at,
    point_mse_m2,
    propagate_backwards,
    smaller_covariance,
)
from wifipgo.graph.edges import Edges
from wifipgo.scenarios.scenario import Scenario
from wifipgo.state import Belief, Paths
from wifipgo.world.coverage import TOLERANCE_M
from wifipgo.world.coverage_belief import BYTES_PER_COVERAGE, CoverageBelief, covered, no_coverage


def first_coverage(starts: Float[np.ndarray, "robots 3"], scenario: Scenario) -> CoverageBelief:
    """What robots see from their starts, which they know."""
    survey = no_coverage(len(starts))
    known = np.ones(len(starts))
    size_m = scenario.arena.size_m
    own = covered(
        survey.own, np.arange(len(starts)), starts[:, :2], known, size_m=size_m, range_m=_reach_m(scenario)
    )
    return survey._replace(own=own)


def propagate_uncertainty(before: Belief, after: Belief, scenario: Scenario) -> Belief:
    """Bring covariance histories and coverage beliefs up to date after an iteration.

    Args:
        before: What was believed before it.
        after: What is believed now; histories have grown by dead reckoning, coverage is that of ``before``.
        scenario: Noise and ranges as the robots know them.
    """
    met = after.team.met
    solved = _solved(met, len(after.err), scenario)
    paths = _with_loop_closures(after.paths, after.log.edges, scenario)
    paths = _known_at_both_ends(paths, solved, scenario) if len(solved) else paths
    old = before.paths.estimate
    moved = (old != paths.estimate[:, : old.shape[1]]).reshape(len(old), -1).any(axis=1)
    moved[solved] = True
    coverage = _covered(after.coverage, paths, moved, scenario)
    if not met:
        return after._replace(paths=paths, coverage=coverage)
    bytes_sent = after.team.bytes_sent.copy()
    for group in met:
        coverage = _shared(coverage, group)
        bytes_sent[group[0] // scenario.n_robots] += BYTES_PER_COVERAGE * len(group) * (len(group) - 1)
    return after._replace(paths=paths, coverage=coverage, team=after.team._replace(bytes_sent=bytes_sent))


def _solved(met: Sequence[Sequence[int]], n_rows: int, scenario: Scenario) -> Int[np.ndarray, " solved"]:
    """Robots whose poses were optimised in this iteration."""
    if scenario.graph.incremental:
        return np.arange(n_rows)
    return np.array([robot for group in met for robot in group], dtype=np.int64)


def stated_sigmas(scenario: Scenario, n_rows: int) -> Float[np.ndarray, "robots 2"]:
    """What the robots of all worlds take the standard deviations of their sensors to be."""
    return scenario.sensing.stated_sigmas(scenario.n_robots, n_rows // scenario.n_robots)


def _reach_m(scenario: Scenario) -> float:
    return scenario.sensing.sensor_range_m


def _with_loop_closures(paths: Paths, edges: Edges, scenario: Scenario) -> Paths:
    """Places measured again: what an optimisation would make of them."""
    t, (robot, then) = paths.t, loop_closures_at(edges, paths.t)
    if not len(robot):
        return paths
    sigma = stated_sigmas(scenario, len(paths.estimate))
    predicted = paths.predicted_covariance.copy()
    back_m = paths.estimate[robot, t, :2] - paths.estimate[robot, then, :2]
    again = covariance_after_closure(predicted[robot, then], back_m, sigma[robot])
    predicted[robot, t] = smaller_covariance(predicted[robot, t], again, reach_m=_reach_m(scenario))
    return paths._replace(predicted_covariance=predicted)


def _known_at_both_ends(paths: Paths, solved: Int[np.ndarray, " solved"], scenario: Scenario) -> Paths:
    """Poses that were optimised are known from start and end: take the tighter, pose by pose."""
    sigma = stated_sigmas(scenario, len(paths.estimate))[solved]
    back = propagate_backwards(paths.covariance[solved], paths.estimate[solved, :, :2], sigma)
    tight = smaller_covariance(paths.predicted_covariance[solved], back, reach_m=_reach_m(scenario))
    tight[:, -1] = paths.covariance[solved]
    history, predicted = paths.covariance_history.copy(), paths.predicted_covariance.copy()
    history[solved] = predicted[solved] = tight
    return paths._replace(covariance_history=history, predicted_covariance=predicted)


def _covered(
    coverage: CoverageBelief, paths: Paths, moved: Bool[np.ndarray, " robots"], scenario: Scenario
) -> CoverageBelief:
    """Own maps: with what is seen from the newest poses, or anew where the trajectory moved."""
    own, n_times = coverage.own, paths.t + 1
    if moved.any():
        poses = np.zeros(paths.estimate.shape[:2], dtype=bool)
        poses[:, -1] = poses[moved] = True
        robot, time = poses.nonzero()
        own = np.where(moved[:, None, None], np.float32(0.0), own)
    else:
        robot, time = np.arange(len(own)), np.full(len(own), n_times - 1)
    own = covered(
        own,
        robot,
        paths.estimate[robot, time, :2],
        probability_in_place(paths.covariance_history[robot, time], reach_m=_reach_m(scenario)),
        size_m=scenario.arena.size_m,
        range_m=_reach_m(scenario),
    )
    return coverage._replace(own=own)


def probability_in_place(
    covariance: Float[np.ndarray, "... 3 3"], *, reach_m: float
) -> Float[np.ndarray, "..."]:
    """Probability that what is seen from a pose is put within `TOLERANCE_M` of where it is.

    Rayleigh's law, by the mean square error of places at two thirds of the range, the mean distance
    of what is in it; the two directions of an error are taken to be alike.
    """
    spread_m2 = point_mse_m2(covariance, reach_m=2.0 / 3.0 * reach_m)
    return 1.0 - np.exp(-(TOLERANCE_M**2) / np.maximum(spread_m2, 1e-12))


def _shared(coverage: CoverageBelief, group: Sequence[int]) -> CoverageBelief:
    """Robots that meet send each other all that they know of the room."""
    members = list(group)
    received = coverage.received.copy()
    received[members] = coverage.known[members].max(axis=0)
    return coverage._replace(received=received)
