"""Algorithm 1: the called robot follows the strongest path of its caller's signal."""

import numpy as np
from jaxtyping import Bool, Float, Int

from baselines.policies.observation_view import View
from baselines.policies.steering import step_towards
from envs.rendezvous_v0 import N_BINS, bin_azimuths
from wifipgo.radio.aoa.peaks import vertex
from wifipgo.radio.channel.bands import band_of
from wifipgo.scenarios import Scenario

# sigma < 1 (paper Sec. 5). gamma makes the step gamma w^2 / sigma^2 reach one step length for the
# smallest discrepancy that Algorithm 1 leaves, w = 1 Mb/s / 66 Mb/s, so that the robot always
# drives as far as it can in an iteration.
SIGMA = 0.5
GAMMA_STEPS = SIGMA**2 * 66.0**2
_ROUNDING = 1e-6  # of an observation in single precision


def strongest_bearing(profile: Float[np.ndarray, "robots bins"]) -> Float[np.ndarray, " robots"]:
    """Direction of the highest bin (Eq. 6), refined by the parabola through its neighbours, rad."""
    rows, best = np.arange(len(profile)), profile.argmax(axis=1)
    low, mid, high = (profile[rows, (best + k) % N_BINS] for k in (-1, 0, 1))
    return bin_azimuths()[best] + vertex(low, mid, high) * 2.0 * np.pi / N_BINS


def heard_bearing(
    view: View, slot: Int[np.ndarray, " robots"], row: Int[np.ndarray, " some"] | slice = slice(None)
) -> Float[np.ndarray, " some"]:
    """Direction of the strongest path from the robot in a slot, of some robots or of all."""
    of = np.arange(len(slot))[row]
    return strongest_bearing(view.slot("profile")[of, slot[of]])


def step_length(
    discrepancy: Float[np.ndarray, " robots"], *, sigma: float = SIGMA, gamma_steps: float = GAMMA_STEPS
) -> Float[np.ndarray, " robots"]:
    """Length of Algorithm 1's step along the path, ``gamma w^2 / sigma^2``, at most one step length."""
    return np.minimum(gamma_steps * discrepancy**2 / sigma**2, 1.0)


class Approach:
    """Algorithm 1 as a motion: towards the robot in a slot, along the strongest path of its signal.

    Args:
        least_rate: Share of the top rate that the link carries where it stops.
    """

    _side: np.ndarray | None = None
    _observed: np.ndarray | None = None

    def __init__(self, *, least_rate: float = 0.0) -> None:
        """Stop as soon as the other is observed, or not before the link carries a rate."""
        self._least_rate = least_rate

    @classmethod
    def of(cls, scenario: Scenario) -> "Approach":
        """That which stops where q is met, if an exchange takes time: from further off it would wait."""
        top_mbit_s = band_of(scenario.radio.bandwidth_hz).top_rate_mbit_s
        return cls(least_rate=scenario.link.q_mbit_s / top_mbit_s if scenario.link.exchange_s > 0.0 else 0.0)

    def step(
        self,
        view: View,
        slot: Int[np.ndarray, " robots"],
        comes: Bool[np.ndarray, " robots"],
        free_steps: Float[np.ndarray, "robots rays"],
        *,
        bearing_rad: Float[np.ndarray, " robots"] | None = None,
    ) -> Float[np.ndarray, "robots 2"]:
        """Algorithm 1's step, or none while each step already brings a new observation of the other.

        Of those who do not come it forgets on which side they passed obstacles, and what they observed.

        Args:
            view: What robots see.
            slot: Whom each follows.
            comes: Who follows at all.
            free_steps: Lidar, in step lengths.
            bearing_rad: Directions to go in place of those of the strongest paths, body frame.
        """
        before, side = view.kept(self._observed, np.inf), view.kept(self._side, 0.0)
        self._observed, self._side = np.full(len(slot), np.inf), np.zeros(len(slot))
        waypoint, row = np.zeros((len(slot), 2)), np.flatnonzero(comes)
        if not len(row):
            return waypoint
        observed = view.slot("observed")[row, slot[row], 0]
        bearing = heard_bearing(view, slot, row) if bearing_rad is None else bearing_rad[row]
        length = step_length(view.slot("discrepancy")[row, slot[row], 0])
        towards, self._side[row] = step_towards(bearing, length, free_steps[row], side[row])
        self._observed[row] = observed
        rate = view.slot("rate")[row, slot[row], 0]
        stays = (observed > before[row]) & (rate >= self._least_rate - _ROUNDING)
        waypoint[row] = np.where(stays[:, None], 0.0, towards)
        return waypoint
