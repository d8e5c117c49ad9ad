"""When a robot has had enough of exploring: pure functions of what it sees."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Bool

from baselines.policies.observation_view import View

Trigger = Callable[[View], Bool[np.ndarray, " robots"]]


def err_above(threshold: float) -> Trigger:
    """Algorithm 2's: Err_i above a threshold, in units of the scenario's."""
    return lambda view: view.own("err")[:, 0] > threshold


def spread_above(spread_m: float) -> Trigger:
    """Standard deviation of the own position, as the estimate stands, above a length."""
    return lambda view: view.own("spread")[:, 0] > spread_m


def not_met_for(share_of_episode: float) -> Trigger:
    """No rendezvous for a share of the episode."""
    return lambda view: view.own("since_met")[:, 0] > share_of_episode
