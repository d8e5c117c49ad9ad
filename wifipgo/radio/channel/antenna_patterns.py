"""Antennas that are not alone: each hears less from behind the other, and some of what the other hears."""

import numpy as np
from jaxtyping import Complex64, Float, Float32

from wifipgo.arithmetic import harmless_underflow

_NEPER_PER_DB = np.log(10.0) / 20.0


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
    # The cosine of a difference by products of those of its sides: far fewer of them.
    (cos_in, sin_in), (cos_out, sin_out) = _directions(azimuth_rad), _directions(outward_rad)
    gain = cos_in[:, :, None, None] * cos_out[:, None]
    gain += sin_in[:, :, None, None] * sin_out[:, None]
    gain -= np.float32(1.0)
    sided = reach_m > 0.5 * reach_m.max()
    gain *= (_NEPER_PER_DB * 0.5 * front_to_back_db * sided).astype(np.float32)[:, None]
    return np.exp(gain, out=gain)


def _directions(angle_rad: Float[np.ndarray, "*shape"]) -> tuple[np.ndarray, np.ndarray]:
    """Cosine and sine, in single precision."""
    return np.cos(angle_rad).astype(np.float32), np.sin(angle_rad).astype(np.float32)


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
    mixed: np.ndarray = np.matmul(mixing.astype(np.complex64), channel.reshape(*channel.shape[:2], -1))
    return mixed.reshape(channel.shape)
