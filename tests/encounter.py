"""Two robots whose paths cross: what the tests of outlier methods solve."""

from typing import NamedTuple

import numpy as np

from wifipgo import se2
from wifipgo.graph.bearings import Bearings
from wifipgo.graph.posegraph import Edges, extended

N_TIMES, FIRST_MET, N_MET = 13, 3, 8
SIGMA, ODOMETRY_SIGMA = (0.2, 0.09), (0.05, 0.02)
BEARING_SIGMA_RAD = float(np.deg2rad(3.0))


class Encounter(NamedTuple):
    """Truth, dead reckoning, and what was measured: odometry first, then one relative pose at a time."""

    truth: np.ndarray
    start: np.ndarray
    edges: Edges
    bearings: Bearings

    @property
    def met(self) -> np.ndarray:
        """Rows of the relative poses between robots."""
        return np.flatnonzero(self.edges.between_robots)


def encounter(
    seed: int, *, noise: float = 1.0, range_m: float = 2.0, outliers: tuple[int, ...] = ()
) -> Encounter:
    """Robots wander ``range_m`` apart; the listed relative poses are anything but true."""
    rng = np.random.default_rng(seed)
    truth = rng.uniform(-np.pi, np.pi, (2, N_TIMES, 3))
    truth[0, :, :2] = np.cumsum(rng.uniform(-1.0, 1.0, (N_TIMES, 2)), axis=0)
    away = rng.uniform(-np.pi, np.pi) + np.cumsum(rng.normal(0.0, 0.3, N_TIMES))
    truth[1, :, :2] = truth[0, :, :2] + range_m * np.stack([np.cos(away), np.sin(away)], axis=-1)

    def noisy(z: np.ndarray, sigma: tuple[float, float]) -> np.ndarray:
        return z + noise * rng.normal(size=z.shape) * np.array([sigma[0], sigma[0], sigma[1]])

    robot, t = np.indices((2, N_TIMES - 1)).reshape(2, -1)
    motion = noisy(se2.between(truth[:, :-1], truth[:, 1:]), ODOMETRY_SIGMA)
    odometry = Edges.measured(
        tail=np.stack([robot, t], axis=1),
        head=np.stack([robot, t + 1], axis=1),
        z=motion.reshape(-1, 3),
        sigma=ODOMETRY_SIGMA,
    )
    start = truth.copy()
    for k in range(N_TIMES - 1):
        start[:, k + 1] = se2.compose(start[:, k], motion[:, k])
    now, who = np.arange(FIRST_MET, FIRST_MET + N_MET), np.arange(N_MET) % 2
    z = noisy(se2.between(truth[who, now], truth[1 - who, now]), SIGMA)
    bad = list(outliers)
    z[bad] = rng.uniform(-1.0, 1.0, (len(bad), 3)) * [range_m, range_m, np.pi]
    z[bad, :2] += 2.0 * range_m
    tail, head = np.stack([who, now], axis=1), np.stack([1 - who, now], axis=1)
    seen = Edges.measured(tail=tail, head=head, z=z, sigma=SIGMA, told=np.zeros((N_MET, 3)))
    observer, target = np.concatenate([tail, head]), np.concatenate([head, tail])
    rel = se2.between(truth[observer[:, 0], observer[:, 1]], truth[target[:, 0], target[:, 1]])
    azimuth = np.arctan2(rel[:, 1], rel[:, 0]) + noise * BEARING_SIGMA_RAD * rng.normal(size=len(rel))
    bearings = Bearings.measured(
        observer=observer, target=target, azimuth_rad=azimuth[:, None], sigma_rad=BEARING_SIGMA_RAD
    )
    return Encounter(truth, start, extended(odometry, seen), bearings)
