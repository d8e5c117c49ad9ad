"""Antennas that are not alone: each hears less from behind the other, and some of what the other hears."""

import numpy as np
from jaxtyping import Complex64, Float, Float32

from wifipgo.arithmetic import harmless_underflow


@harmless_underflow
def pattern_gain(
    azimuth_rad: Float[np.ndarray, "links paths"],
    heading_rad: Float[np.ndarray, "links positions"],
    antennas_m: Float[np.ndarray, "antennas 2"],
    *,
    front_to_back_db: float,
) -> Float32[np.ndarray, "links paths antennas positions"]:
    """Amplitude with which each antenna hears each path at each packet, relative to an isotropic one.

    Loss in dB grows as ``(1 - cos a) / 2`` with the angle ``a`` from the way outwards, from the middle of the
    antennas through this one: nothing there, all of ``front_to_back_db`` behind the body.

    Args:
        azimuth_rad: Where paths arrive from, world frame.
        heading_rad: Of the body, world frame.
        antennas_m: Antennas in the body frame; one in the middle hears all directions alike.
        front_to_back_db: What an antenna loses of a path from behind.
    """
    outward_m = antennas_m - antennas_m.mean(axis=0)
    reach_m = np.hypot(*outward_m.T)
    outward_rad = np.arctan2(outward_m[:, 1], outward_m[:, 0])[:, None] + heading_rad[:, None]
    cosine = np.cos(azimuth_rad[:, :, None, None] - outward_rad[:, None])
    sided = (reach_m > 0.5 * reach_m.max())[:, None]
    loss_db = front_to_back_db * np.where(sided, 0.5 * (1.0 - cosine), 0.0)
    gain: np.ndarray = np.exp(-np.log(10.0) / 20.0 * loss_db)
    return gain.astype(np.float32)


@harmless_underflow
def coupled(
    channel: Complex64[np.ndarray, "links antennas positions subcarriers"],
    antennas_m: Float[np.ndarray, "antennas 2"],
    *,
    coupling: float,
    wavelength_m: float,
) -> Complex64[np.ndarray, "links antennas positions subcarriers"]:
    """Add to each antenna a share of what every other hears, late by the way between them.

    Args:
        channel: Gains of antennas that are alone.
        antennas_m: Antennas in the body frame.
        coupling: Amplitude of the share.
        wavelength_m: Carrier wavelength.
    """
    apart_m = np.hypot(*(antennas_m[:, None] - antennas_m).transpose(2, 0, 1))
    mixing = coupling * np.exp(-2j * np.pi * apart_m / wavelength_m)
    np.fill_diagonal(mixing, 1.0)
    return np.einsum("ab,lbps->laps", mixing.astype(np.complex64), channel)
