"""What accuracy is possible: Cramer-Rao bound of the azimuth of one path.

**Phase of one packet.** On each of S subcarriers the two antennas receive
``x_1 = c e^(j d/2) + n_1`` and ``x_2 = c e^(-j d/2) + n_2``, c unknown and different from packet to packet,
|c|^2 / E|n|^2 = snr. The phase of each is known with information 2 snr, their difference d
is orthogonal to their mean, so d has information snr for each subcarrier: **variance
>= 1 / (S snr)**. If c is itself Gaussian (Rayleigh fading over subcarriers), the
coherence of the pair is snr / (1 + snr) and the bound (1 - coherence^2) / (2 coherence^2) =
**1 / snr + 1 / (2 snr^2)** for each subcarrier. The second term is that of noise times noise,
and the summed product ``sum x_1 conj(x_2)`` has just this variance whatever c is. The
product of forward and reverse channel of a moving antenna has the same: each way gives
1 / (2 snr), and the same product of noises.

**Azimuth.** Position p has phase ``2 pi / lambda b_p . u(azimuth) + offset``, whose derivative is g_p. The
offset - between the receive chains, or that of the way at the start - is unknown, which takes the
mean of g away: ``variance >= v / sum_p (g_p - mean g)^2`` with v the variance of a packet's phase.
If the elevation is unknown too, what its derivative explains of g is taken away likewise.
"""

import numpy as np
from jaxtyping import Float

from wifipgo.errors import require
from wifipgo.radio.aoa.steering import Aperture

_LEAST_SNR = 1e-9


def phase_variance_rad2(snr: float, *, n_subcarriers: int, random_amplitude: bool = True) -> float:
    """Least variance of the phase of one packet's product, rad^2.

    Args:
        snr: Power ratio of signal and noise at one antenna and subcarrier, not in dB.
        n_subcarriers: Subcarriers with independent noise.
        random_amplitude: With the term of noise times noise, which the product reaches;
            without, the bound for an unknown but fixed amplitude, which it meets from 10 dB.
    """
    require(_LEAST_SNR <= snr < np.inf, "snr", f">= {_LEAST_SNR:g} and finite", snr)
    require(n_subcarriers > 0, "n_subcarriers", "> 0", n_subcarriers)
    return (1.0 / snr + (0.5 / snr**2 if random_amplitude else 0.0)) / n_subcarriers


def azimuth_bound_rad2(
    aperture: Aperture,
    azimuths_rad: Float[np.ndarray, " directions"],
    *,
    phase_variance_rad2: float,
    elevation_rad: float = 0.0,
    elevation_known: bool = True,
) -> Float[np.ndarray, " directions"]:
    """Cramer-Rao bound of the azimuth of one path, rad^2, for each direction that it may have.

    Infinite where the aperture says nothing, as along the line of a straight drive.

    Args:
        aperture: Where the packets were heard.
        azimuths_rad: True azimuths.
        phase_variance_rad2: Of one packet, from the function of that name.
        elevation_rad: True elevation.
        elevation_known: Otherwise it is a parameter too.
    """
    slope = _centred(aperture, _azimuth_derivative(azimuths_rad, elevation_rad))
    if not elevation_known:
        other = _centred(aperture, _elevation_derivative(azimuths_rad, elevation_rad))
        power = (other**2).sum(axis=0)
        seen = power > 1e-12 * (slope**2).sum(axis=0)
        slope = slope - other * np.where(seen, (slope * other).sum(axis=0) / np.where(seen, power, 1.0), 0.0)
    information = (slope**2).sum(axis=0) / phase_variance_rad2
    nothing = (
        information * phase_variance_rad2 < 1e-18 * (aperture.baseline_m**2).sum() / aperture.wavelength_m**2
    )
    return np.where(nothing, np.inf, 1.0 / np.where(nothing, 1.0, information))


def _centred(
    aperture: Aperture, derivative: Float[np.ndarray, "3 directions"]
) -> Float[np.ndarray, "positions directions"]:
    """Derivative of each position's phase, less the unknown offset."""
    slope = 2.0 * np.pi / aperture.wavelength_m * (aperture.baseline_m @ derivative)
    return slope - slope.mean(axis=0)


def _azimuth_derivative(
    azimuths_rad: Float[np.ndarray, " directions"], elevation_rad: float
) -> Float[np.ndarray, "3 directions"]:
    """How a unit vector changes with its azimuth."""
    flat = np.stack([-np.sin(azimuths_rad), np.cos(azimuths_rad), np.zeros(len(azimuths_rad))])
    return np.cos(elevation_rad) * flat


def _elevation_derivative(
    azimuths_rad: Float[np.ndarray, " directions"], elevation_rad: float
) -> Float[np.ndarray, "3 directions"]:
    """How a unit vector changes with its elevation."""
    sideways, up = -np.sin(elevation_rad), np.full(len(azimuths_rad), np.cos(elevation_rad))
    return np.stack([sideways * np.cos(azimuths_rad), sideways * np.sin(azimuths_rad), up])
