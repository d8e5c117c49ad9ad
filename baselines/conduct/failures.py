"""Worlds in which a policy maps less than the rule, and what the records say of them."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from baselines.conduct.findings import Findings

_HALF = 0.5


class Shortfalls(NamedTuple):
    """Where a policy is below the rule in one scenario.

    Attributes:
        below: Worlds in which it is.
        points: By how much, per cent of the floor; positive there.
        lost: Worlds below in which at least half of it is floor that was seen, but is not where it is thought
            to be; in the others it saw less.
        never_met: Worlds below in which none of its robots ever met another.
    """

    below: Bool[np.ndarray, " worlds"]
    points: Float[np.ndarray, " worlds"]
    lost: Bool[np.ndarray, " worlds"]
    never_met: Bool[np.ndarray, " worlds"]


class World(NamedTuple):
    """A policy beside the rule in one world.

    Attributes:
        scenario: Short name.
        trial: Number of the world.
        seed: Of the world.
        rule, policy: Scores, per cent.
        told: What happened; why the policy is below, if it is.
    """

    scenario: str
    trial: int
    seed: int
    rule: float
    policy: float
    told: str


def shortfalls(findings: Findings, scenario: str) -> Shortfalls:
    """Worlds of a scenario in which the policy is below the rule, and why."""
    points = -_less(findings, scenario, "score")
    below = points > 0.0
    lost = below & (_less(findings, scenario, "misplaced") >= _HALF * points)
    met = findings.conduct[scenario][findings.policy].met.any(axis=(1, 2))
    return Shortfalls(below, points, lost, below & ~met)


def furthest_below(findings: Findings, scenario: str, n: int) -> list[World]:
    """Worlds of a scenario with the greatest shortfall, the worst first; only those that have one."""
    found = shortfalls(findings, scenario)
    order = np.argsort(-found.points, kind="stable")[:n].tolist()
    return [_world(findings, scenario, k) for k in order if found.below[k]]


def usual_world(findings: Findings, scenario: str) -> World:
    """The world in which the policy is beside the rule as in the median world: neither lucky nor picked."""
    points = _less(findings, scenario, "score")
    return _world(findings, scenario, int(np.abs(points - np.median(points)).argmin()))


def _world(findings: Findings, scenario: str, k: int) -> World:
    (seed,) = findings.suite.parts[scenario].seeds(range(k, k + 1))
    rule, policy = (
        float(findings.figures(scenario, who, "score")[k]) for who in (findings.rule, findings.policy)
    )
    return World(scenario, k, seed, rule, policy, _told(findings, scenario, k))


def _less(findings: Findings, scenario: str, measure: str) -> Float[np.ndarray, " worlds"]:
    """What the policy has more than the rule, world by world."""
    policy, rule = (findings.figures(scenario, who, measure) for who in (findings.policy, findings.rule))
    return policy - rule


def _told(findings: Findings, scenario: str, world: int) -> str:
    """What happened in a world, from its figures; those of the rule in brackets."""

    def both(measure: str, digits: int) -> str:
        policy, rule = (
            float(findings.figures(scenario, who, measure)[world]) for who in (findings.policy, findings.rule)
        )
        return f"{policy:.{digits}f} ({rule:.{digits}f})"

    found, met = shortfalls(findings, scenario), _meetings(findings, scenario, world)
    if found.lost[world]:
        off = f"off by {both('off_at_end', 1)} m at the end"
        return f"lost: {both('misplaced', 0)} % seen, but misplaced; {off}; {met}"
    if found.below[world]:
        drove = f"drove {both('driven', 0)} m, bumped {both('bumps', 0)} times"
        return f"saw less: {both('seen', 0)} %; {drove}; {met}"
    return met


def _meetings(findings: Findings, scenario: str, world: int) -> str:
    """When the team met."""
    policy, rule = (
        np.flatnonzero(findings.conduct[scenario][who].met[world].any(axis=1)) + 1
        for who in (findings.policy, findings.rule)
    )
    if len(policy) == 0:
        return f"never met ({len(rule)} times)"
    last = f", last at iteration {policy[-1]}"
    return f"met {len(policy)} ({len(rule)}) times{last}"
