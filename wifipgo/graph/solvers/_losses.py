"""Losses that let go of what does not fit: Huber, Geman-McClure, and truncation by GNC."""

from collections.abc import Mapping
from types import MappingProxyType

import gtsam
import numpy as np
from jaxtyping import Float

# How poses are guarded by what other poses say. Odometry is trusted, every other relative pose doubted.
LOSSES: Mapping[str, str] = MappingProxyType(
    {
        "none": "squares: what Eq. 3 says",
        "huber": "squares up to the knee, linear beyond",
        "gnc": "truncated squares, by graduated non-convexity (Yang et al., RA-L 2020)",
    }
)
# The customary knee, in sigmas. A pose has 3 degrees of freedom, so of the good ones four in ten lie within.
# With 2.2, where as few are out as of scalars here, the gain in benchmarks/outliers.py is 2 points less.
HUBER_KNEE = 1.345
# Geman-McClure on bearings: c, in sigmas. At c a bearing counts a quarter; its pull falls beyond c / sqrt(3).
BEARING_C = 2.0


def huber(noise: gtsam.noiseModel.Base) -> gtsam.noiseModel.Robust:
    """Huber's loss on the Mahalanobis distance of a noise model."""
    return gtsam.noiseModel.Robust.Create(gtsam.noiseModel.mEstimator.Huber.Create(HUBER_KNEE), noise)


def huber_weight(loss: Float[np.ndarray, " rows"]) -> Float[np.ndarray, " rows"]:
    """Weight ``min(1, k / d)`` of a measurement at distance d sigmas, given its loss."""
    squares = np.sqrt(2.0 * np.minimum(loss, 0.5 * HUBER_KNEE**2))
    distance = np.maximum(squares, loss / HUBER_KNEE + 0.5 * HUBER_KNEE)
    return np.where(loss > 0.5 * HUBER_KNEE**2, HUBER_KNEE / distance, 1.0)


def geman_mcclure(sigma_rad: float) -> gtsam.noiseModel.Robust:
    """Geman-McClure's loss ``c^2 e^2 / (c^2 + e^2) / 2`` on a bearing."""
    shape = gtsam.noiseModel.mEstimator.GemanMcClure.Create(BEARING_C)
    return gtsam.noiseModel.Robust.Create(shape, gtsam.noiseModel.Isotropic.Sigma(1, sigma_rad))


def geman_mcclure_weight(off_sigmas: Float[np.ndarray, " rows"]) -> Float[np.ndarray, " rows"]:
    """Weight ``(c^2 / (c^2 + e^2))^2`` of a bearing that is e sigmas off."""
    return (BEARING_C**2 / (BEARING_C**2 + off_sigmas**2)) ** 2
