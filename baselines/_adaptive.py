"""Algorithm 1: the called robot follows the strongest path of its caller's signal."""

import numpy as np
from jaxtyping import Float

from envs.rendezvous_v0 import N_BINS, bin_azimuths

# sigma < 1 (paper Sec. 5). gamma makes the step gamma w^2 / sigma^2 reach one step length for the
# smallest discrepancy that Algorithm 1 leaves, w = 1 Mb/s / 66 Mb/s, so that the robot always
# drives as far as it can in an iteration.
SIGMA = 0.5
GAMMA_STEPS = SIGMA**2 * 66.0**2


def strongest_bearing(profile: Float[np.ndarray, "robots bins"]) -> Float[np.ndarray, " robots"]:
    """Direction of the highest bin (Eq. 6), refined by the parabola through its neighbours, rad."""
    rows, best = np.arange(len(profile)), profile.argmax(axis=1)
    low, mid, high = (profile[rows, (best + k) % N_BINS] for k in (-1, 0, 1))
    bend = low - 2.0 * mid + high
    shift = np.where(bend < 0.0, 0.5 * (low - high) / np.where(bend < 0.0, bend, -1.0), 0.0)
    return bin_azimuths()[best] + np.clip(shift, -0.5, 0.5) * 2.0 * np.pi / N_BINS


def step_length(
    discrepancy: Float[np.ndarray, " robots"], *, sigma: float = SIGMA, gamma_steps: float = GAMMA_STEPS
) -> Float[np.ndarray, " robots"]:
    """Length of Algorithm 1's step along the path, ``gamma w^2 / sigma^2``, at most one step length."""
    return np.minimum(gamma_steps * discrepancy**2 / sigma**2, 1.0)
