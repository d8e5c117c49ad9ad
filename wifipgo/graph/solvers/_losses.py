"""Losses of `wifipgo.graph.losses` as gtsam's noise models."""

import gtsam
import numpy as np
from jaxtyping import Float

from wifipgo.graph.losses import BEARING_C, HUBER_KNEE, huber_weight


def huber(noise: gtsam.noiseModel.Base) -> gtsam.noiseModel.Robust:
    """Huber's loss on the Mahalanobis distance of a noise model."""
    return gtsam.noiseModel.Robust.Create(gtsam.noiseModel.mEstimator.Huber.Create(HUBER_KNEE), noise)


def weight_at_huber_loss(loss: Float[np.ndarray, " rows"]) -> Float[np.ndarray, " rows"]:
    """Huber's weight of a measurement, given its loss as gtsam has it."""
    squares = np.sqrt(2.0 * np.minimum(loss, 0.5 * HUBER_KNEE**2))
    linear = loss / HUBER_KNEE + 0.5 * HUBER_KNEE
    return huber_weight(np.where(loss > 0.5 * HUBER_KNEE**2, linear, squares))


def geman_mcclure(sigma_rad: float) -> gtsam.noiseModel.Robust:
    """Geman-McClure's loss ``c^2 e^2 / (c^2 + e^2) / 2`` on a bearing."""
    return geman_mcclure_of(gtsam.noiseModel.Isotropic.Sigma(1, sigma_rad))


def geman_mcclure_of(noise: gtsam.noiseModel.Base) -> gtsam.noiseModel.Robust:
    """The same loss on the Mahalanobis distance of a noise model."""
    return gtsam.noiseModel.Robust.Create(gtsam.noiseModel.mEstimator.GemanMcClure.Create(BEARING_C), noise)
