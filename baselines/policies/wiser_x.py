"""Exploration by direction: who hears where the others are leaves to them what is nearer to them."""

import numpy as np
from jaxtyping import Bool, Float

from baselines.policies.exploration import MIDDLES
from baselines.policies.observation_view import View
from baselines.policies.rendezvous import Callers, Walkers
from baselines.policies.signal_following import heard_bearing
from baselines.policies.signal_strength import PingDistance, esnr_db, yaw
from baselines.policies.team_exploration import SharedRoom
from baselines.policies.triggers import err_above
from wifipgo.scenarios import Scenario


def wiser_x(scenario: Scenario, *, others_worth: float = 0.3, err_threshold: float = 1.0) -> Walkers:
    """Explores away from where it hears others, by direction and strength of pings, and calls as `active`.

    After WiSER-X (Jadhav, Behari, Wood and Gil 2024), where directions and ranges of pings keep robots apart
    without an exchange of maps. There a filter holds them and ranges are of a radio of their own (UWB); here
    each iteration's pings stand for themselves.

    Args:
        scenario: Gives the sizes, and what a signal loses over a distance.
        others_worth: Worth of a square that is nearer to another robot, of one that is not.
        err_threshold: Err at which it calls, in units of the scenario's; 1e9: never.
    """
    return Callers(scenario, HeardShare(scenario, others_worth=others_worth), err_above(err_threshold))


class HeardShare(SharedRoom):
    """The best view, where squares nearer to a robot that is heard are worth less."""

    def __init__(self, scenario: Scenario, *, others_worth: float) -> None:
        """Set the weight."""
        super().__init__(scenario, others_worth=others_worth, rest_worth=1.0)
        self._distance = PingDistance(scenario)

    def _share(self, view: View) -> Bool[np.ndarray, "robots squares"]:
        """Squares to which no robot that is heard is nearer."""
        own, share = view.own("position"), np.ones((len(view.rows), len(MIDDLES)), dtype=bool)
        away2 = np.square(MIDDLES - own[:, None]).sum(axis=-1)
        present = view.slot("present")[..., 0] > 0.0
        for k in range(present.shape[1]):
            nearer = np.square(MIDDLES - self._heard_at(view, k)[:, None]).sum(axis=-1) < away2
            share &= ~(nearer & present[:, k, None])
        return share

    def _heard_at(self, view: View, k: int) -> Float[np.ndarray, "robots 2"]:
        """Where the robot in a slot is heard, in room sizes and the hearer's own estimate."""
        slot = np.full(len(view.rows), k)
        azimuth, away = yaw(view) + heard_bearing(view, slot), self._distance.rooms(esnr_db(view, slot))
        return view.own("position") + away[:, None] * np.stack([np.cos(azimuth), np.sin(azimuth)], axis=-1)
