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


def near_the_end(share_of_episode: float) -> Trigger:
    """No rendezvous yet within the last share of the episode: what was recorded since would be lost."""

    def triggered(view: View) -> Bool[np.ndarray, " robots"]:
        late = view.own("elapsed")[:, 0] - (1.0 - share_of_episode)
        return (late >= 0.0) & (view.own("since_met")[:, 0] >= late)

    return triggered


def either(*triggers: Trigger) -> Trigger:
    """Any of several."""
    return lambda view: np.any([trigger(view) for trigger in triggers], axis=0)
