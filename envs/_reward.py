"""Rewards: pure functions of what the robots believe, chosen by name."""

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np
from jaxtyping import Float

from wifipgo.scenarios import Scenario
from wifipgo.state import Belief

# One term of a reward is at most this many thresholds, so that one lost robot does not drown the rest.
_WORST = 10.0

Reward = Callable[[Belief, Scenario], np.ndarray]


def error(belief: Belief, scenario: Scenario) -> Float[np.ndarray, " robots"]:
    """Minus one's own Err_i over the threshold: rewards staying well localised."""
    return -np.minimum(belief.err / scenario.rendezvous.err_threshold, _WORST)


def team_error(belief: Belief, scenario: Scenario) -> Float[np.ndarray, " robots"]:
    """Mean of `error` over the team, the same for all: rewards helping others too."""
    return np.full(len(belief.err), error(belief, scenario).mean())


REWARDS: Mapping[str, Reward] = MappingProxyType({"error": error, "team_error": team_error})
