"""Angle of arrival: profiles over direction and their peaks (paper Eqs. 5, 6, 10).

A robot turns in place while packets arrive. Between its two antennas the phase of
a plane wave from azimuth ``g`` is ``2 pi gap / lambda cos(g - heading)``; comparing
what was received with that steering vector for every ``g`` gives the profile. All
links of a step share one turn, so all profiles are one complex matrix product.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float

from wifipgo.errors import pick, require
from wifipgo.se2 import wrap_angle


@dataclass(frozen=True, slots=True, kw_only=True)
class AoaConfig:
    """Antenna pair, turn and grid. Gap and quarter turn: paper Secs. 4 and 7.2.1; the rest is ours."""

    antenna_gap_m: float = 0.22
    turn_rad: float = np.pi / 2.0
    n_positions: int = 64
    n_azimuths: int = 360
    aoa_estimator: str = "product"
    n_peaks: int = 2

    def __post_init__(self) -> None:
        """Reject values that cannot mean anything."""
        for name in ("antenna_gap_m", "turn_rad"):
            require(getattr(self, name) > 0.0, f"AoaConfig.{name}", "> 0", getattr(self, name))
        require(self.n_positions >= 8, "AoaConfig.n_positions", ">= 8", self.n_positions)
        require(
            self.n_azimuths >= 72 and self.n_azimuths % 72 == 0,
            "AoaConfig.n_azimuths",
            "a positive multiple of 72",
            self.n_azimuths,
        )
        require(1 <= self.n_peaks <= 10, "AoaConfig.n_peaks", "in 1..10", self.n_peaks)
        pick(ESTIMATORS, self.aoa_estimator, "AOA estimator")


class Peaks(NamedTuple):
    """The highest peaks of each profile, best first.

    Where a profile has fewer peaks than asked for, the best is repeated with height 0.
    """

    azimuth_rad: Float[np.ndarray, "links peaks"]
    height: Float[np.ndarray, "links peaks"]


def azimuth_grid(n_azimuths: int) -> Float[np.ndarray, " grid"]:
    """Directions of a profile's bins, rad, from -pi (included) to pi (excluded)."""
    return -np.pi + 2.0 * np.pi / n_azimuths * np.arange(n_azimuths)


def turn_headings(cfg: AoaConfig) -> Float[np.ndarray, " positions"]:
    """Heading at each packet of the turn relative to the body frame, which is its end, rad."""
    return np.linspace(-cfg.turn_rad, 0.0, cfg.n_positions)


def turn_steering(
    headings_rad: Float[np.ndarray, " positions"],
    azimuths_rad: Float[np.ndarray, " grid"],
    *,
    antenna_gap_m: float,
    wavelength_m: float,
) -> Complex[np.ndarray, "positions grid"]:
    """Phase factor between the two antennas for a plane wave from each direction (Phi of Eq. 5).

    Elevation is zero: the world of the simulator is a plane.
    """
    travel = 2.0 * np.pi * antenna_gap_m / wavelength_m * np.cos(azimuths_rad[None] - headings_rad[:, None])
    return np.exp(1j * travel).astype(np.complex64)


def displacement_steering(
    displacement_m: Float[np.ndarray, "packets 3"],
    azimuths_rad: Float[np.ndarray, " grid"],
    *,
    elevation_rad: float,
    wavelength_m: float,
    passes: int = 2,
) -> Complex[np.ndarray, "packets grid"]:
    """Phase factor that a receiver's displacement gives a plane wave from each direction.

    ``passes`` is 2 for the product of forward and reverse channel, in which the phase
    of the displacement doubles (WSR-Toolbox, arXiv 2109.12205), and 1 for one way.
    """
    flat = displacement_m[:, :1] * np.cos(azimuths_rad) + displacement_m[:, 1:2] * np.sin(azimuths_rad)
    along_m = np.cos(elevation_rad) * flat + np.sin(elevation_rad) * displacement_m[:, 2:]
    return np.exp(2j * np.pi * passes / wavelength_m * along_m).astype(np.complex64)


def ratio_signal(
    csi: Complex[np.ndarray, "links 2 positions subcarriers"],
) -> Complex[np.ndarray, "links positions"]:
    """Channel ratio h1/h2 at the centre subcarrier: the paper's input of Eq. 5.

    The phase common to both antennas of a packet cancels. In a fade of the second
    antenna the ratio blows up: that is the paper's estimator, kept as it is.
    """
    centre = csi[..., csi.shape[-1] // 2]
    tiny = np.finfo(np.float32).tiny
    return (centre[:, 0] * centre[:, 1].conj() / np.maximum(np.abs(centre[:, 1]) ** 2, tiny)).astype(
        np.complex64
    )


def product_signal(
    csi: Complex[np.ndarray, "links 2 positions subcarriers"],
) -> Complex[np.ndarray, "links positions"]:
    """Product h1 conj(h2) summed over subcarriers, then scaled to unit modulus.

    Same phase as the ratio and no blow-up in fades. Cross terms between paths turn
    with the subcarrier and largely cancel in the sum; the paths' own terms add up.
    """
    product = np.einsum("lns,lns->ln", csi[:, 0], csi[:, 1].conj())
    return (product / np.maximum(np.abs(product), np.finfo(np.float32).tiny)).astype(np.complex64)


PairSignal = Callable[[np.ndarray], np.ndarray]
ESTIMATORS: Mapping[str, PairSignal] = MappingProxyType({"product": product_signal, "ratio": ratio_signal})


def bartlett_profiles(
    signal: Complex[np.ndarray, "links positions"], steering: Complex[np.ndarray, "positions grid"]
) -> Float[np.ndarray, "links grid"]:
    """Share of each signal's power that each direction explains, in [0, 1].

    One matrix product for all links. A signal without power has a profile of zeros.
    """
    power = np.einsum("ln,ln->l", signal.real, signal.real) + np.einsum("ln,ln->l", signal.imag, signal.imag)
    scale = 1.0 / np.maximum(power * len(steering), np.finfo(np.float32).tiny)
    response = signal.conj() @ steering
    return (response.real**2 + response.imag**2) * scale[:, None].astype(np.float32)


def eq5_profiles(
    profile: Float[np.ndarray, "links grid"], n_positions: int
) -> Float[np.ndarray, "links grid"]:
    """F of paper Eq. 5 from the Bartlett share.

    With one snapshot vector the covariance of Eq. 5 has rank one, so its noise
    projector is I - h h^H / |h|^2 and F = 1 / (n - |a^H h|^2 / |h|^2): a monotone map.
    """
    return 1.0 / np.maximum(n_positions * (1.0 - profile), np.finfo(np.float32).eps)


def find_peaks(
    profile: Float[np.ndarray, "links grid"], *, n_peaks: int, separation_rad: float = np.deg2rad(8.0)
) -> Peaks:
    """The N highest peaks of profiles on a full circle (the set Theta_N of Eq. 10; Eq. 6 is its first).

    A peak is a local maximum; bins closer than ``separation_rad`` to a higher peak are
    blocked. The position is refined by the parabola through the bin and its neighbours.
    """
    n_links, n_bins = profile.shape
    left, right = np.roll(profile, 1, axis=1), np.roll(profile, -1, axis=1)
    open_height = np.where((profile >= left) & (profile > right), profile, 0.0)
    rows, bins = np.arange(n_links), np.arange(n_bins)
    step_rad = 2.0 * np.pi / n_bins
    azimuth_rad, height = np.zeros((n_links, n_peaks)), np.zeros((n_links, n_peaks))
    for k in range(n_peaks):
        best = open_height.argmax(axis=1)
        height[:, k] = open_height[rows, best]
        low, mid, high = left[rows, best], profile[rows, best], right[rows, best]
        bend = low - 2.0 * mid + high
        shift = np.where(bend < 0.0, 0.5 * (low - high) / np.where(bend < 0.0, bend, -1.0), 0.0)
        azimuth_rad[:, k] = wrap_angle(-np.pi + step_rad * (best + np.clip(shift, -0.5, 0.5)))
        apart = np.abs(bins[None] - best[:, None])
        open_height[np.minimum(apart, n_bins - apart) * step_rad < separation_rad] = 0.0
    azimuth_rad = np.where(height > 0.0, azimuth_rad, azimuth_rad[:, :1])
    return Peaks(azimuth_rad, height)


def closest_peak(peaks: Peaks, azimuth_rad: Float[np.ndarray, " links"]) -> Float[np.ndarray, " links"]:
    """The peak nearest to a reported direction (paper Eq. 10), rad."""
    away = np.abs(wrap_angle(peaks.azimuth_rad - azimuth_rad[:, None]))
    return peaks.azimuth_rad[np.arange(len(away)), away.argmin(axis=1)]
