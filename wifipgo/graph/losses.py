"""Losses that let go of what does not fit: Huber, truncation by GNC, and Geman-McClure on bearings.

The only place of their constants. A loss is a row of `LOSSES`; odometry is trusted, every other
relative pose doubted. gtsam's models of them are made in `wifipgo.graph.solvers`.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from jaxtyping import Float
from scipy.special import chdtri

# The customary knee, in sigmas. A pose has 3 degrees of freedom, so of the good ones four in ten lie within.
# With 2.2, where as few are out as of scalars here, the gain in benchmarks/outliers.py is 2 points less.
HUBER_KNEE = 1.345
GNC_CONFIDENCE = 0.99  # share of good measurements that truncation keeps
# Geman-McClure on bearings: c, in sigmas. At c a bearing counts a quarter; its pull falls beyond c / sqrt(3).
BEARING_C = 2.0

Rows = Float[np.ndarray, " rows"]


def huber_weight(distance: Float[np.ndarray, " rows"]) -> Float[np.ndarray, " rows"]:
    """Weight ``min(1, k / d)`` of a measurement at distance d sigmas."""
    return HUBER_KNEE / np.maximum(distance, HUBER_KNEE)


def huber_chi2(chi2: Float[np.ndarray, " rows"]) -> Float[np.ndarray, " rows"]:
    """Twice Huber's loss: a squared distance up to the knee, ``k (2 d - k)`` beyond."""
    return np.where(chi2 > HUBER_KNEE**2, HUBER_KNEE * (2.0 * np.sqrt(chi2) - HUBER_KNEE), chi2)


def truncation_chi2(freedom: int) -> float:
    """Squared distance at which truncated squares end: a good measurement's, with `GNC_CONFIDENCE`."""
    return float(chdtri(freedom, 1.0 - GNC_CONFIDENCE))


def truncated_weight(
    chi2: Float[np.ndarray, " rows"], *, limit: float, mu: float
) -> Float[np.ndarray, " rows"]:
    """Weights of truncated squares at control parameter ``mu``: 1 far below the limit, 0 far above.

    Yang, Antonante, Tzoumas, Carlone, RA-L 2020, Eq. 14.
    """
    low, high = mu / (mu + 1.0) * limit, (mu + 1.0) / mu * limit
    between = np.sqrt(limit * mu * (mu + 1.0) / np.maximum(chi2, low)) - mu
    return np.where(chi2 <= low, 1.0, np.where(chi2 >= high, 0.0, np.clip(between, 0.0, 1.0)))


def geman_mcclure_weight(off_sigmas: Float[np.ndarray, " rows"]) -> Float[np.ndarray, " rows"]:
    """Weight ``(c^2 / (c^2 + e^2))^2`` of a bearing that is e sigmas off."""
    return (BEARING_C**2 / (BEARING_C**2 + off_sigmas**2)) ** 2


@dataclass(frozen=True, slots=True, kw_only=True)
class Loss:
    """A loss of relative poses.

    Attributes:
        weight: Of measurements in iterated least squares, from their squared distances, the limit of
            truncation and the control parameter of graduated non-convexity.
        cost: Twice the loss, from squared distances and the limit of truncation.
        graduated: Whether weights are only final once each is 0 or 1.
        incremental: Whether a solution can grow with the measurements instead of being searched anew.
        meaning: In words.
    """

    weight: Callable[[Rows, float, float], Rows]
    cost: Callable[[Rows, float], Rows]
    graduated: bool = False
    incremental: bool = False
    meaning: str


LOSSES: Mapping[str, Loss] = MappingProxyType(
    {
        "none": Loss(
            weight=lambda chi2, limit, mu: np.ones(len(chi2)),
            cost=lambda chi2, limit: chi2,
            incremental=True,
            meaning="squares: what Eq. 3 says",
        ),
        "huber": Loss(
            weight=lambda chi2, limit, mu: huber_weight(np.sqrt(chi2)),
            cost=lambda chi2, limit: huber_chi2(chi2),
            incremental=True,
            meaning="squares up to the knee, linear beyond",
        ),
        "gnc": Loss(
            weight=lambda chi2, limit, mu: truncated_weight(chi2, limit=limit, mu=mu),
            cost=np.minimum,
            graduated=True,
            meaning="truncated squares, by graduated non-convexity (Yang et al., RA-L 2020)",
        ),
    }
)
