"""The paper's policy with directions that are worse than the radio's: what its precision is worth."""

import numpy as np
from jaxtyping import Float

from baselines.policies.observation_view import View
from baselines.policies.rendezvous import ActiveRendezvous
from baselines.policies.signal_following import heard_bearing
from wifipgo.errors import require
from wifipgo.rows import Generators
from wifipgo.scenarios import Scenario
from wifipgo.se2 import wrap_angle


class NoisyBearing(ActiveRendezvous):
    """As the paper's, but every direction that a called robot takes has an error of its own.

    The error has a stream of its own, so walks stay those of other policies with the same seed.

    Args:
        scenario: Gives the layout of the observations.
        sigma_deg: Standard deviation of the normal error; 360: any direction, as likely as any other.
        memory: Correlation of the error with that of the iteration before.
        err_threshold: Threshold of Algorithm 2 in units of the scenario's.
    """

    def __init__(
        self, scenario: Scenario, *, sigma_deg: float = 30.0, memory: float = 0.0, err_threshold: float = 1.0
    ) -> None:
        """Compose."""
        require(0.0 <= sigma_deg <= 360.0, "noisy_bearing:sigma_deg", "in [0, 360]", sigma_deg)
        require(0.0 <= memory < 1.0, "noisy_bearing:memory", "in [0, 1)", memory)
        self._sigma_rad, self._errors = float(np.deg2rad(sigma_deg)), CorrelatedNormals(memory)
        super().__init__(scenario, err_threshold=err_threshold)

    def _come(self, view: View, slot: np.ndarray, comes: np.ndarray, free_steps: np.ndarray) -> np.ndarray:
        bearing = heard_bearing(view, slot) + self._sigma_rad * self._errors.step(view, self._rng)
        return self._approach.step(view, slot, comes, free_steps, bearing_rad=wrap_angle(bearing))


class CorrelatedNormals:
    """A standard normal number for each robot and iteration, correlated with that of the iteration before."""

    _last: np.ndarray | None = None

    def __init__(self, memory: float) -> None:
        """Set the correlation."""
        self._memory = memory
        self._each: list[np.random.Generator] = []

    def step(self, view: View, rng: Generators) -> Float[np.ndarray, " robots"]:
        """The next numbers, from streams that ``rng`` of each world spawns when an episode begins."""
        begins = np.zeros(len(view.rows), dtype=bool) if view.begins is None else view.begins
        worlds = begins[:: view.n_robots].tolist()
        before = self._each if len(self._each) == len(worlds) else list(rng.each)
        self._each = [
            one.spawn(1)[0] if new else old for one, old, new in zip(rng.each, before, worlds, strict=True)
        ]
        fresh = Generators(self._each).standard_normal((len(view.rows),))
        last = view.kept(self._last, 0.0)
        share = np.where(begins, 0.0, self._memory)
        self._last = share * last + np.sqrt(1.0 - share**2) * fresh
        return self._last
