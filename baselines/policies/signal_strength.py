"""Called robots that hear how strong their caller is, and not from where: what directions add."""

import numpy as np
from jaxtyping import Bool, Float, Int

from baselines.policies.exploration import MIDDLES
from baselines.policies.observation_view import View
from baselines.policies.rendezvous import ActiveRendezvous
from wifipgo.errors import require
from wifipgo.scenarios import Scenario
from wifipgo.se2 import wrap_angle

_UNIT_DB = 30.0  # of a slot's effective SNR
# Standard deviation of the logarithm of a distance that is read off an effective SNR: fades of some dB.
_LOG_SIGMA = 0.3


def yaw(view: View) -> Float[np.ndarray, " robots"]:
    """Heading of each robot in its own estimate, rad."""
    heading = view.own("heading").astype(np.float64)
    return np.arctan2(heading[:, 1], heading[:, 0])


def esnr_db(view: View, slot: Int[np.ndarray, " robots"]) -> Float[np.ndarray, " robots"]:
    """Effective SNR of the link to the robot in a slot."""
    return _UNIT_DB * view.slot("esnr")[np.arange(len(slot)), slot, 0].astype(np.float64)


class Climb(ActiveRendezvous):
    """As the paper's, but a called robot climbs the strength of its caller's signal, without directions.

    It keeps its course while effective SNR rises, and turns by the same angle to the same side each time that
    it falls.

    Args:
        scenario: Gives the layout of the observations.
        turn_deg: Angle of a turn.
        err_threshold: Threshold of Algorithm 2 in units of the scenario's.
    """

    def __init__(self, scenario: Scenario, *, turn_deg: float = 120.0, err_threshold: float = 1.0) -> None:
        """Compose."""
        require(0.0 < turn_deg <= 180.0, "climb:turn_deg", "in (0, 180]", turn_deg)
        self._turn_rad = float(np.deg2rad(turn_deg))
        self._course: np.ndarray | None = None
        self._before: np.ndarray | None = None
        super().__init__(scenario, err_threshold=err_threshold)

    def _come(
        self,
        view: View,
        slot: Int[np.ndarray, " robots"],
        comes: Bool[np.ndarray, " robots"],
        free_steps: np.ndarray,
    ) -> np.ndarray:
        now, own = esnr_db(view, slot), yaw(view)
        before, course = view.kept(self._before, np.inf), view.kept(self._course, np.nan)
        course = np.where(np.isnan(course), own, course)  # the first step goes ahead
        course = course + np.where(now < before, self._turn_rad, 0.0) * np.isfinite(before)
        self._before, self._course = np.where(comes, now, np.inf), np.where(comes, course, np.nan)
        return self._approach.step(view, slot, comes, free_steps, bearing_rad=wrap_angle(course - own))


class PingRanging(ActiveRendezvous):
    """As the paper's, but a called robot only knows how far its caller is, from the strength of its pings.

    Free space gives the distance; distances from where it has been since it was called say in which square of
    the room the caller is most likely, and there it goes.

    Args:
        scenario: Gives the layout of the observations, and what a signal loses over a distance.
        err_threshold: Threshold of Algorithm 2 in units of the scenario's.
    """

    def __init__(self, scenario: Scenario, *, err_threshold: float = 1.0) -> None:
        """Compose."""
        self._distance = PingDistance(scenario)
        self._unlikely: np.ndarray | None = None
        super().__init__(scenario, err_threshold=err_threshold)

    def _come(
        self,
        view: View,
        slot: Int[np.ndarray, " robots"],
        comes: Bool[np.ndarray, " robots"],
        free_steps: np.ndarray,
    ) -> np.ndarray:
        gap = MIDDLES - view.own("position")[:, None].astype(np.float64)
        off = np.log(np.hypot(gap[..., 0], gap[..., 1]) / self._distance.rooms(esnr_db(view, slot))[:, None])
        unlikely = view.kept(self._unlikely, 0.0, (len(MIDDLES),)) + np.square(off / _LOG_SIGMA)
        best = gap[np.arange(len(gap)), unlikely.argmin(axis=1)]
        self._unlikely = np.where(comes[:, None], unlikely, 0.0)
        bearing = np.arctan2(best[:, 1], best[:, 0]) - yaw(view)
        return self._approach.step(view, slot, comes, free_steps, bearing_rad=wrap_angle(bearing))


class PingDistance:
    """Distance of a sender in free space, from effective SNR."""

    def __init__(self, scenario: Scenario) -> None:
        """Learn the power, and the size of the room."""
        radio = scenario.radio
        self._at_1_m_db = 10.0 * np.log10(radio.snr_scale * (radio.wavelength_m / (4.0 * np.pi)) ** 2)
        self._size_m = scenario.arena.size_m

    def rooms(self, esnr_db: Float[np.ndarray, "*robots"]) -> Float[np.ndarray, "*robots"]:
        """Distances in room sizes."""
        return np.asarray(10.0 ** ((self._at_1_m_db - esnr_db) / 20.0) / self._size_m)
