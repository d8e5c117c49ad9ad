"""A bound on the mean power over the subcarriers, for a tenth of what the channel itself costs."""

import functools

import numpy as np
from jaxtyping import Float, Float32, Inexact

from wifipgo.radio.channel.bands import BANDS, SUBCARRIER_SPACING_HZ, band_of

_CELLS = 4096  # of half a turn
_MOST_PATHS = 8  # of more the pairs cost more than they tell


def most_mean_power(
    gain: Inexact[np.ndarray, "paths links"],
    delay_s: Float[np.ndarray, "paths links"],
    *,
    bandwidth_hz: float,
) -> Float32[np.ndarray, " links"]:
    """At least the mean of the channel's power over the reported subcarriers.

    ``mean |sum_p g_p exp(-2 pi j f t_p)|^2 <= sum_pq |g_p| |g_q| c(t_p - t_q)``, where c is how far two paths
    stay in step: the modulus of the mean of ``exp(2 pi j f t)``, rounded up. Of many paths c is taken for 1.
    """
    amplitude = np.abs(gain).astype(np.float32, copy=False)
    if len(amplitude) > _MOST_PATHS:
        return np.add.reduce(amplitude) ** 2
    turns, in_step = (SUBCARRIER_SPACING_HZ * delay_s).astype(np.float32), _in_step(bandwidth_hz)
    total: np.ndarray = np.add.reduce(amplitude * amplitude)
    for p in range(1, len(amplitude)):
        apart = turns[:p] - turns[p]
        apart -= np.rint(apart)
        np.abs(apart, out=apart)
        apart *= np.float32(2 * _CELLS)
        shared = in_step.take(apart.astype(np.intp))
        shared *= amplitude[:p]
        total += 2.0 * amplitude[p] * np.add.reduce(shared)
    return total


@functools.lru_cache(maxsize=len(BANDS))
def _in_step(bandwidth_hz: float) -> Float32[np.ndarray, " cells"]:
    """Largest c in each cell of delay differences, in turns of a subcarrier spacing from 0 to a half.

    No further above its value in the middle than the steepest slope allows over half a cell, and a little
    more for the rounding of the difference.
    """
    subcarriers = band_of(bandwidth_hz).subcarriers
    middle = (np.arange(_CELLS + 1) + 0.5) / (2 * _CELLS)
    at_middle = np.abs(np.exp(2j * np.pi * middle[:, None] * subcarriers).mean(axis=1))
    slope = 2.0 * np.pi * np.abs(subcarriers).mean()
    highest = at_middle + slope * (0.25 / _CELLS + 1e-5)
    return np.minimum(highest, 1.0).astype(np.float32)
