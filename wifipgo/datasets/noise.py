"""How wrong odometry and sightings of a run are, fitted to its truth.

Odometry. Real wheels err alike for many steps: the deviation of one step says little of where a robot is a
minute later. So errors are summed over blocks of `BLOCK_S`, in which they have had time to add up, and the
variance of a block is fitted, by least squares without negative parts, as the sum of what each of its steps
brought: so much for each metre driven and for each radian turned. Errors of position are summed along the
true headings, so that those of heading do not count twice.

Sightings. The deviation is half the width of the middle 68 % of the errors, so that a few gross ones
do not widen it: these are for a robust loss.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.optimize import nnls

from wifipgo import se2
from wifipgo.datasets.wheel_path import Steps

BLOCK_S = 20.0
FEWEST_BLOCKS, FEWEST_SIGHTINGS = 10, 20  # less tells nothing
LEAST_SIGMA = (1e-3, 1e-3)  # m, rad: of a step in which nothing moved
MIDDLE = 0.6827


class OdometryNoise(NamedTuple):
    """Variance of a step of odometry: a random walk along the way and the turns.

    Attributes:
        t_m2_per_m: Of the position, each axis, for a metre driven.
        t_m2_per_rad: For a radian turned.
        r_rad2_per_m: Of the heading, for a metre driven.
        r_rad2_per_rad: For a radian turned.
        unheard_m_s: How fast a robot may have moved while there was no row of odometry.
        unheard_rad_s: How fast it may have turned then.
    """

    t_m2_per_m: float
    t_m2_per_rad: float
    r_rad2_per_m: float
    r_rad2_per_rad: float
    unheard_m_s: float
    unheard_rad_s: float

    def sigma(self, steps: Steps) -> Float[np.ndarray, "steps 2"]:
        """Deviations of steps, (m, rad)."""
        t = self.t_m2_per_m * steps.driven_m + self.t_m2_per_rad * steps.turned_rad
        r = self.r_rad2_per_m * steps.driven_m + self.r_rad2_per_rad * steps.turned_rad
        unheard = steps.unheard_s[:, None] * np.array([self.unheard_m_s, self.unheard_rad_s])
        variance: np.ndarray = np.stack([t, r], axis=-1) + unheard**2 + np.square(LEAST_SIGMA)
        return np.sqrt(variance)


class Noise(NamedTuple):
    """Noise of a run.

    Attributes:
        odometry: Of the steps.
        bearing_sigma_rad: Of the direction of a sighting, as sampled.
        range_sigma_m: Of its distance.
        fitted: Which of the fields before were fitted to this run; the others are those of run 6 of MRCLAM,
            for want of truth.
    """

    odometry: OdometryNoise
    bearing_sigma_rad: float
    range_sigma_m: float
    fitted: tuple[str, ...]


# Of MRCLAM's run 6, 1 s between poses.
USUAL = Noise(OdometryNoise(6e-4, 3e-3, 8e-3, 1e-2, 0.06, 0.14), 0.014, 0.10, ())


def fitted_odometry(
    steps: Sequence[Steps], truth: Float[np.ndarray, "robots times 3"]
) -> OdometryNoise | None:
    """Noise of the steps of all robots of a run together; none where the truth covers too few blocks."""
    features, squares = [], []
    for own, true in zip(steps, truth, strict=True):
        of_steps = np.column_stack([own.driven_m, own.turned_rad, _errors(own, true)])
        driven, turned, x, y, yaw = _blocks(of_steps, own.lasted_s).T
        whole = np.isfinite(yaw) & (driven + turned > 0.0)
        features.append(np.stack([driven, turned], axis=-1)[whole])
        squares.append(np.stack([0.5 * (x**2 + y**2), yaw**2], axis=-1)[whole])
    A, e2 = np.concatenate(features), np.concatenate(squares)
    if len(A) < FEWEST_BLOCKS:
        return None
    rates = [_variance_rates(A, column) for column in e2.T]
    speeds = [_rms_speed(steps, name) for name in ("driven_m", "turned_rad")]
    return OdometryNoise(*rates[0], *rates[1], *speeds)


def _blocks(
    of_steps: Float[np.ndarray, "steps columns"], lasted_s: Float[np.ndarray, " steps"]
) -> Float[np.ndarray, "blocks columns"]:
    """Sums over as many steps as make `BLOCK_S`; those that are left over are left out."""
    length = max(round(BLOCK_S / float(lasted_s.mean())), 1)
    whole = of_steps[: len(of_steps) // length * length]
    return whole.reshape(-1, length, of_steps.shape[1]).sum(axis=1)


def _errors(steps: Steps, truth: Float[np.ndarray, "times 3"]) -> Float[np.ndarray, "steps 3"]:
    """Errors of steps: of the position along the axes of the world, and of the heading."""
    true = se2.between(truth[:-1], truth[1:])
    off = steps.z - true
    return np.column_stack([se2.rotate(truth[:-1, 2], off[:, :2]), se2.wrap_angle(off[:, 2])])


def _variance_rates(
    A: Float[np.ndarray, "blocks 2"], square: Float[np.ndarray, " blocks"]
) -> tuple[float, float]:
    """Variance for a metre and for a radian: a chi-square's spread is its mean, so blocks weigh by that."""
    rates = nnls(A, square)[0]
    for _ in range(5):
        expected = np.maximum(A @ rates, 1e-2 * square.mean() + 1e-12)
        rates = nnls(A / expected[:, None], square / expected)[0]
    return float(rates[0]), float(rates[1])


def _rms_speed(steps: Sequence[Steps], name: str) -> float:
    """Root mean square of how fast robots went, per s."""
    rates = np.concatenate([getattr(of, name) / of.lasted_s for of in steps])
    return float(np.sqrt(np.mean(rates**2)))


def middle_sigma(error: Float[np.ndarray, " errors"]) -> float | None:
    """Half the width of the middle 68 % of errors; none where there are too few."""
    good = error[np.isfinite(error)]
    if len(good) < FEWEST_SIGHTINGS:
        return None
    low, high = np.quantile(good, [0.5 - MIDDLE / 2.0, 0.5 + MIDDLE / 2.0])
    return max(0.5 * float(high - low), 1e-6)
