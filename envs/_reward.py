"""Rewards: pure functions of what an iteration changed, chosen by name.

A name that ends in ``_truth`` says that the reward reads what robots cannot know: good for
training and comparison, out of reach on a robot. All others read belief only.
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from wifipgo.rows import Rows
from wifipgo.scenarios import Scenario
from wifipgo.state import Belief
from wifipgo.world.coverage_belief import team_share

# One term of a reward is at most this many thresholds, so that one lost robot does not drown the rest.
_WORST = 10.0


class Outcome(NamedTuple):
    """What a reward may look at.

    Attributes:
        before: What the robots believed before the iteration.
        after: And after it.
        mapped_gain_truth: What each world's mapped share grew by (`wifipgo.world.map_accuracy`); it reads
            the truth.
        rows: Robots of all worlds.
    """

    before: Belief
    after: Belief
    mapped_gain_truth: Float[np.ndarray, " worlds"]
    rows: Rows


Reward = Callable[[Outcome, Scenario], np.ndarray]


def mapped_share_truth(outcome: Outcome, scenario: Scenario) -> Float[np.ndarray, " robots"]:
    """S_t - S_(t-1), shared by the team: rewards places seen *and* put where they are.

    The return of an episode is the mapped share at its end, less that of the start. Standing
    still earns nothing, and neither does getting lost: what is seen then is not mapped.
    """
    return outcome.mapped_gain_truth.repeat(outcome.rows.n_robots)


def mapped_share_belief(outcome: Outcome, scenario: Scenario) -> Float[np.ndarray, " robots"]:
    """As `mapped_share_truth`, by what robots can tell: squares seen, by the chance to be in place.

    The chance is that of the covariance of the pose from which a square was seen best.
    """
    after, before = (team_share(b.coverage, outcome.rows.n_worlds) for b in (outcome.after, outcome.before))
    return (after - before).repeat(outcome.rows.n_robots)


def error(outcome: Outcome, scenario: Scenario) -> Float[np.ndarray, " robots"]:
    """Minus one's own Err_i over the threshold: rewards staying well localised, so standing still too."""
    return -np.minimum(outcome.after.err / scenario.rendezvous.err_threshold, _WORST)


def team_error(outcome: Outcome, scenario: Scenario) -> Float[np.ndarray, " robots"]:
    """Mean of `error` over the team, the same for all: rewards helping others too."""
    return outcome.rows.by_world(error(outcome, scenario)).mean(axis=1).repeat(outcome.rows.n_robots)


REWARDS: Mapping[str, Reward] = MappingProxyType(
    {
        "mapped_share_truth": mapped_share_truth,
        "mapped_share_belief": mapped_share_belief,
        "error": error,
        "team_error": team_error,
    }
)
