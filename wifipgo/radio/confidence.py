"""How far to trust a profile: figures that need no truth."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from wifipgo.radio.aoa.peaks import find_peaks


class Confidence(NamedTuple):
    """Figures of each profile; small is good for all three.

    A profile without a peak has the width of the circle, and ratio and variance 1.

    Attributes:
        width_rad: Full width of the highest peak at half its height, rad.
        sidelobe_ratio: Second highest peak over the highest, in [0, 1]; 0 where there is no second.
        variance: Spread of the profile round its highest peak, over that of a flat profile.
    """

    width_rad: Float[np.ndarray, " links"]
    sidelobe_ratio: Float[np.ndarray, " links"]
    variance: Float[np.ndarray, " links"]


@np.errstate(under="ignore")
def confidence(profile: Float[np.ndarray, "links grid"]) -> Confidence:
    """Confidence of profiles on a full circle.

    The variance is that of the WSR toolbox (arXiv 2109.12205) on the azimuth circle:
    ``sum_g F(g) d(g)^2 / sum_g F(g)`` with d the distance from the highest peak, divided by the same
    sum for a flat profile, pi^2 / 3. 0 is a single line, 1 a flat profile, more than 1 a
    profile whose power lies away from its peak. The toolbox's code also divides by the
    power of the profile; here the scale of a profile makes no difference.

    Args:
        profile: At least 0, on `wifipgo.radio.aoa.steering.azimuth_grid`.
    """
    peaks = find_peaks(profile, n_peaks=2)
    there = peaks.height[:, 0] > 0.0
    top = np.where(there, profile.argmax(axis=1), 0)
    tall = np.where(there, peaks.height[:, 0], 1.0)
    return Confidence(
        width_rad=np.where(there, _width_rad(profile, top), 2.0 * np.pi),
        sidelobe_ratio=np.where(there, np.minimum(peaks.height[:, 1] / tall, 1.0), 1.0),
        variance=np.where(there, _relative_variance(profile, top), 1.0),
    )


def _around(
    profile: Float[np.ndarray, "links grid"], top: Int[np.ndarray, " links"]
) -> Float[np.ndarray, "links grid"]:
    """Profiles turned so that the highest bin comes first."""
    bins = np.arange(profile.shape[1])
    return np.take_along_axis(profile, (top[:, None] + bins) % profile.shape[1], axis=1)


def _width_rad(
    profile: Float[np.ndarray, "links grid"], top: Int[np.ndarray, " links"]
) -> Float[np.ndarray, " links"]:
    """Bins from half height to half height, by straight lines between bins."""
    ahead = _around(profile, top)
    behind = ahead[:, -np.arange(ahead.shape[1])]
    return 2.0 * np.pi / profile.shape[1] * (_bins_to_half(ahead) + _bins_to_half(behind))


def _bins_to_half(falling: Float[np.ndarray, "links grid"]) -> Float[np.ndarray, " links"]:
    """Where a profile first falls below half of its first bin; half the circle if it never does."""
    half, rows = 0.5 * falling[:, 0], np.arange(len(falling))
    below = falling < half[:, None]
    first = below.argmax(axis=1)
    before, after = falling[rows, first - 1], falling[rows, first]
    drop = np.where(before > after, before - after, 1.0)
    found = first - 1 + (before - half) / drop
    return np.minimum(np.where(first > 0, found, np.inf), 0.5 * falling.shape[1])


def _relative_variance(
    profile: Float[np.ndarray, "links grid"], top: Int[np.ndarray, " links"]
) -> Float[np.ndarray, " links"]:
    """Second moment round the highest bin, over that of a flat profile."""
    bins = np.arange(profile.shape[1])
    away = np.minimum(bins, profile.shape[1] - bins).astype(float) ** 2
    around = _around(profile, top)
    total = np.maximum(around.sum(axis=1), np.finfo(np.float32).tiny)
    return around @ away / (total * away.mean())
