"""What robots conclude from an iteration about their own knowledge: how sure they are, and what they saw."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float, Int

from wifipgo.graph.covariance import before_known_end, from_known_place, own_places, tighter
from wifipgo.scenarios import Scenario
from wifipgo.state import Belief
from wifipgo.world.coverage_belief import BYTES_PER_SURVEY, Survey, no_survey, probability_in_place, surveyed


def first_survey(starts: Float[np.ndarray, "robots 3"], scenario: Scenario) -> Survey:
    """What robots see from their starts, which they know."""
    survey = no_survey(len(starts))
    known = np.ones(len(starts))
    size_m = scenario.arena.size_m
    own = surveyed(
        survey.own, np.arange(len(starts)), starts[:, :2], known, size_m=size_m, range_m=_reach_m(scenario)
    )
    return survey._replace(own=own)


def taken_stock(before: Belief, after: Belief, scenario: Scenario) -> Belief:
    """Bring trails of covariances and surveys up to date after an iteration.

    Args:
        before: What was believed before it.
        after: What is believed now; trails have grown by dead reckoning, surveys are those of ``before``.
        scenario: Noise and ranges as the robots know them.
    """
    belief = _recognised(after, scenario)
    solved = _solved(belief, scenario)
    belief = _known_at_both_ends(belief, solved, scenario) if len(solved) else belief
    changed = before.estimate != belief.estimate[:, : before.estimate.shape[1]]
    moved = changed.reshape(len(changed), -1).any(axis=1)
    moved[solved] = True
    belief = _surveyed(belief, moved, scenario)
    for group in belief.met:
        belief = _shared(belief, group)
    return belief


def _solved(belief: Belief, scenario: Scenario) -> Int[np.ndarray, " solved"]:
    """Robots whose poses were optimised in this iteration."""
    if scenario.rendezvous.estimator != "at_rendezvous":
        return np.arange(scenario.n_robots)
    return np.array([robot for group in belief.met for robot in group], dtype=np.int64)


def _reach_m(scenario: Scenario) -> float:
    return scenario.sensing.sensor_range_m


def _recognised(belief: Belief, scenario: Scenario) -> Belief:
    """Places measured again: what an optimisation would make of them."""
    t, sigma = belief.t, scenario.sensing.stated_sigmas(scenario.n_robots)
    robot, then = own_places(belief.edges, t)
    if not len(robot):
        return belief
    recorded = belief.recorded.copy()
    back_m = belief.estimate[robot, t, :2] - belief.estimate[robot, then, :2]
    again = from_known_place(recorded[robot, then], back_m, sigma[robot])
    recorded[robot, t] = tighter(recorded[robot, t], again, reach_m=_reach_m(scenario))
    return belief._replace(recorded=recorded)


def _known_at_both_ends(belief: Belief, solved: Int[np.ndarray, " solved"], scenario: Scenario) -> Belief:
    """Poses that were optimised are known from start and end: take what is tighter, pose by pose."""
    sigma = scenario.sensing.stated_sigmas(scenario.n_robots)[solved]
    back = before_known_end(belief.covariance[solved], belief.estimate[solved, :, :2], sigma)
    tight = tighter(belief.recorded[solved], back, reach_m=_reach_m(scenario))
    tight[:, -1] = belief.covariance[solved]
    trail, recorded = belief.trail.copy(), belief.recorded.copy()
    trail[solved] = recorded[solved] = tight
    return belief._replace(trail=trail, recorded=recorded)


def _surveyed(belief: Belief, moved: Bool[np.ndarray, " robots"], scenario: Scenario) -> Belief:
    """Own maps: with what is seen from the newest poses, or anew where the trajectory moved."""
    own, n_times = belief.survey.own, belief.estimate.shape[1]
    if moved.any():
        poses = np.zeros(belief.estimate.shape[:2], dtype=bool)
        poses[:, -1] = poses[moved] = True
        robot, time = poses.nonzero()
        own = np.where(moved[:, None, None], np.float32(0.0), own)
    else:
        robot, time = np.arange(len(own)), np.full(len(own), n_times - 1)
    own = surveyed(
        own,
        robot,
        belief.estimate[robot, time, :2],
        probability_in_place(belief.trail[robot, time], reach_m=_reach_m(scenario)),
        size_m=scenario.arena.size_m,
        range_m=_reach_m(scenario),
    )
    return belief._replace(survey=belief.survey._replace(own=own))


def _shared(belief: Belief, group: Sequence[int]) -> Belief:
    """Robots that meet send each other all that they know of the room."""
    members = list(group)
    told = belief.survey.told.copy()
    told[members] = belief.survey.known[members].max(axis=0)
    n_bytes = BYTES_PER_SURVEY * len(members) * (len(members) - 1)
    return belief._replace(survey=belief.survey._replace(told=told), bytes_sent=belief.bytes_sent + n_bytes)
