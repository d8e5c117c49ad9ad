"""Confidence of a profile, how far off its bearing is likely to be, and which bearings to leave out.

None of it needs truth. Of the confidences tried on simulated rooms (``benchmarks/confidence_study.py``)
the expected error ranks errors best where it counts, at few rejections: the mean distance of the profile
from its top peak, weighted by a power of the profile. A side lobe counts by how high it
is *and* by how far off the answer would be if it were the true peak; the plain ratio of
second peak to first rejects twins 10 degrees apart and side lobes at 120 degrees alike.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from wifipgo.arithmetic import harmless_underflow
from wifipgo.errors import require
from wifipgo.radio.aoa.peaks import find_peaks
from wifipgo.radio.aoa.steering import azimuth_grid
from wifipgo.se2 import wrap_angle

# A peak of half the height weighs 1/64: middle of the plateau 4 to 8 in the simulation.
EXPONENT = 6
REJECTED_SHARE = 0.1


class Confidence(NamedTuple):
    """Figures of each profile; small is good for all of them.

    A profile without a peak has the width of the circle, ratio and variance 1, and the expected
    error of a guess.

    Attributes:
        width_rad: Full width of the highest peak at half its height, rad.
        sidelobe_ratio: Second highest peak over the highest, in [0, 1]; 0 where there is no second.
        variance: Spread of the profile round its highest peak, over that of a flat profile.
        expected_error_rad: Of its highest peak, as `expected_errors_rad` says.
    """

    width_rad: Float[np.ndarray, " links"]
    sidelobe_ratio: Float[np.ndarray, " links"]
    variance: Float[np.ndarray, " links"]
    expected_error_rad: Float[np.ndarray, " links"]


@harmless_underflow
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
        expected_error_rad=expected_errors_rad(profile, peaks.azimuth_rad[:, 0]),
    )


@harmless_underflow
def expected_errors_rad(
    profile: Float[np.ndarray, "links grid"], azimuth_rad: Float[np.ndarray, " links"]
) -> Float[np.ndarray, " links"]:
    """Mean distance from each answer, weighted by (profile / its maximum) ^ `EXPONENT`, rad.

    0 for a line, pi / 2 for a flat profile or an empty one.

    Args:
        profile: Share of power over `azimuth_grid`, >= 0.
        azimuth_rad: The answer of each link.
    """
    highest = profile.max(axis=1, keepdims=True)
    share = np.where(highest > 0.0, profile / np.where(highest > 0.0, highest, 1.0), 1.0)
    weight = share.astype(float) ** EXPONENT
    away_rad = np.abs(wrap_angle(azimuth_grid(profile.shape[1])[None] - azimuth_rad[:, None]))
    return np.sum(weight * away_rad, axis=1) / np.sum(weight, axis=1)


def confidences(expected_rad: Float[np.ndarray, " links"]) -> Float[np.ndarray, " links"]:
    """Expected errors on a scale from 0 (as good as a guess, pi / 2 or more) to 1 (certain)."""
    return np.clip(1.0 - 2.0 / np.pi * expected_rad, 0.0, 1.0)


def least_confident(
    expected_rad: Float[np.ndarray, " links"], *, share: float = REJECTED_SHARE
) -> Bool[np.ndarray, " links"]:
    """The links with the largest expected errors: at most this share of them, rounded down.

    Nothing else than the profiles decides: neither truth nor the name of a set.
    """
    require(0.0 <= share <= 1.0, "share", "in 0..1", share)
    worst_first = np.argsort(-expected_rad, kind="stable")
    rejected = np.zeros(len(expected_rad), dtype=bool)
    rejected[worst_first[: int(share * len(expected_rad) + 1e-9)]] = True
    return rejected


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
