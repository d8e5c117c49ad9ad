"""How far off a bearing is likely to be, from its own profile, and which bearings to leave out.

Of the confidences tried on simulated rooms (``benchmarks/confidence_study.py``) this one
ranks errors best where it counts, at few rejections: the mean distance of the profile
from its top peak, weighted by a power of the profile. A side lobe counts by how high it
is *and* by how far off the answer would be if it were the true peak; the plain ratio of
second peak to first rejects twins 10 degrees apart and side lobes at 120 degrees alike.
"""

import numpy as np
from jaxtyping import Bool, Float

from wifipgo.errors import require
from wifipgo.radio.aoa import azimuth_grid
from wifipgo.se2 import wrap_angle

# A peak of half the height weighs 1/64: middle of the plateau 4 to 8 in the simulation.
EXPONENT = 6
REJECTED_SHARE = 0.1


@np.errstate(under="ignore")
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
