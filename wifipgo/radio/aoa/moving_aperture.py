"""Bearing from a moving receiver: a synthetic aperture over the two-way channel.

The product of the channel measured at the receiver and the one measured at the
transmitter for the same exchange is free of both oscillators, and its phase is that
of the way there *and* back (Jadhav et al., arXiv 2109.12205). As the receiver moves,
its packets are samples of one long antenna array. Five choices, all made by theory and
checked on simulated rooms (``benchmarks/confidence_study.py``), none on recordings:

- **Spherical wavefronts.** A 0.6 m aperture at a two-way phase of ``4 pi / lambda`` has
  its far field beyond ``4 D^2 / lambda``, 27 m at 5.5 GHz: in a room the front is curved
  by several radians over the aperture. The curvature (1 / range) is searched, in steps
  that leave less than 0.6 rad at the edge of a 0.3 m half aperture. Plane waves, the
  usual choice, are biased by the place wherever the path is not symmetric.
- **Low elevations only.** Squaring a channel of several paths makes a ghost for every
  pair, at the bisector of the two with the displacement shortened by the cosine of
  half the angle between them: exactly what a source at an elevation of half that angle
  would give. Summing over all elevations, as is usual, adds those ghosts; a search up
  to 15 degrees, where robots on one floor are, keeps only ghosts of near neighbours.
- **Both ways and one way.** The square root of the product is the channel itself, without
  ghosts, if its sign is right. The sign is followed along the path, as a channel cannot
  turn round within ``lambda / 32`` except in a deep fade. The root's lobes are twice as
  wide and a lost sign blurs them; the product's are sharp and have ghosts. The profile
  is the geometric mean of both, so that a peak must stand in both: of the power, what a
  direction explains in the one *and* in the other.
- **Timing removed.** Each packet has its own symbol timing (20 ns and more), a phase
  slope over the subcarriers that scrambles the outer ones from packet to packet; it is
  removed, and gain control steps, which say nothing about direction, are divided out.
- **Subcarriers add as powers**: their fades are different, their directions are the same.

Of each the highest share of power over the searched fronts counts: maximum likelihood
over nuisance parameters with flat priors. What was measured: ``docs/recordings.md``.
"""

import itertools
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float

from wifipgo.arithmetic import harmless_underflow
from wifipgo.errors import require, require_within
from wifipgo.radio.aoa import Peaks, azimuth_grid, bartlett_profiles, find_peaks
from wifipgo.radio.aoa.confidence import expected_errors_rad

_MOST_FRONTS = 64  # elevations, and curvatures


@dataclass(frozen=True, slots=True, kw_only=True)
class ApertureConfig:
    """Grid of searched wavefronts. All ours; the module says why."""

    n_azimuths: int = 360
    elevations_rad: tuple[float, ...] = (0.0, np.pi / 18.0, np.pi / 12.0)
    curvatures_per_m: tuple[float, ...] = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5)
    spacing_m: float = 0.0034  # packets closer than this along the path count as one: lambda / 16
    n_peaks: int = 5

    def __post_init__(self) -> None:
        """Reject values that cannot mean anything."""
        require_within(self, {"n_azimuths": (8.0, 7200.0), "n_peaks": (1.0, 10.0), "spacing_m": (1e-6, 1.0)})
        for name, most in (("elevations_rad", np.pi / 2.0), ("curvatures_per_m", 10.0)):
            values, rule = getattr(self, name), f"1 to {_MOST_FRONTS} values in 0..{most:g}"
            good = 0 < len(values) <= _MOST_FRONTS and all(0.0 <= value <= most for value in values)
            require(good, f"ApertureConfig.{name}", rule, values)


class Bearing(NamedTuple):
    """Where a transmitter seems to be."""

    profile: Float[np.ndarray, " grid"]  # share of the signal's power that each azimuth explains
    peaks: Peaks  # of this one profile, highest first

    @property
    def azimuth_rad(self) -> float:
        """The answer: the top peak, rad."""
        return float(self.peaks.azimuth_rad[0, 0])

    @property
    def height(self) -> float:
        """Share of the signal's power that the top peak explains, in [0, 1]."""
        return float(self.peaks.height[0, 0])

    @property
    def expected_error_rad(self) -> float:
        """Mean distance of what else the profile shows from the answer: `expected_errors_rad`."""
        return float(expected_errors_rad(self.profile[None], self.peaks.azimuth_rad[:, 0])[0])

    @property
    def side_ratio(self) -> float:
        """Second peak over the first, in [0, 1]: near 1 the answer is a toss-up."""
        second = self.peaks.height[0, 1] if self.peaks.height.shape[1] > 1 else 0.0
        return float(second / max(self.height, np.finfo(float).tiny))


def aperture_bearing(
    product: Complex[np.ndarray, "packets subcarriers"],
    displacement_m: Float[np.ndarray, "packets 3"],
    *,
    wavelength_m: float,
    cfg: ApertureConfig | None = None,
) -> Bearing:
    """Bearing of a transmitter from the receiver's mean position; arguments of `aperture_profile`."""
    cfg = cfg or ApertureConfig()
    profile = aperture_profile(product, displacement_m, wavelength_m=wavelength_m, cfg=cfg)
    return Bearing(profile, find_peaks(profile[None], n_peaks=cfg.n_peaks))


@harmless_underflow
def timing_removed(
    product: Complex[np.ndarray, "packets subcarriers"],
) -> Complex[np.ndarray, "packets subcarriers"]:
    """A two-way channel without each packet's slope over the subcarriers and without its gain.

    The slope is the phase of the mean step from one subcarrier to the next, all of one
    weight; the phase at the middle of the band stays. The gain is the RMS modulus.
    """
    phasor = unit_modulus(product)
    step_rad = np.angle(np.sum(phasor[:, 1:] * phasor[:, :-1].conj(), axis=1))
    from_middle = np.arange(product.shape[1]) - 0.5 * (product.shape[1] - 1)
    gain = np.sqrt(np.mean(np.abs(product) ** 2, axis=1, keepdims=True))
    level = product / np.maximum(gain, np.finfo(np.float32).tiny)
    return (level * np.exp(-1j * step_rad[:, None] * from_middle)).astype(np.complex64)


def unit_modulus(signal: Complex[np.ndarray, "*shape"]) -> Complex[np.ndarray, "*shape"]:
    """The phase factors of a signal; 0 where it is 0."""
    return signal / np.maximum(np.abs(signal), np.finfo(np.float32).tiny)


def unsquared(
    signal: Complex[np.ndarray, "positions subcarriers"],
) -> Complex[np.ndarray, "positions subcarriers"]:
    """Square root of a two-way channel: the one-way channel but for one sign per subcarrier.

    Of the two roots at a position the one counts that is nearer to the root before it.
    Positions must be close enough for that, `ApertureConfig.spacing_m` / 2.
    """
    root = np.sqrt(np.abs(signal)) * np.exp(0.5j * np.angle(signal))
    turned = (root[1:] * root[:-1].conj()).real < 0.0
    root[1:] *= np.cumprod(np.where(turned, -1.0, 1.0), axis=0)
    return root.astype(np.complex64)


def spherical_steering(
    displacement_m: Float[np.ndarray, "positions 3"],
    azimuths_rad: Float[np.ndarray, " grid"],
    *,
    elevation_rad: float,
    curvature_per_m: float,
    wavelength_m: float,
) -> Complex[np.ndarray, "positions grid"]:
    """Two-way phase factor that a displacement gives the wave of a source at a finite range.

    With u the direction of a source at range r = 1 / curvature, the way is shorter by
    ``r - |r u - p| = (2 u.p - |p|^2 / r) / (1 + |u - p / r|)``; at curvature 0 that is u.p,
    the plane wave of `wifipgo.radio.aoa.displacement_steering`.

    Args:
        displacement_m: Positions relative to the point that the bearing is taken from, m.
        azimuths_rad: Candidate directions, rad.
        elevation_rad: Elevation of the candidates, rad.
        curvature_per_m: 1 / range of the candidates, 1/m.
        wavelength_m: Wavelength of the carrier, m.
    """
    p_m = displacement_m.astype(np.float32)
    flat = p_m[:, :1] * np.cos(azimuths_rad, dtype=np.float32) + p_m[:, 1:2] * np.sin(
        azimuths_rad, dtype=np.float32
    )
    along = np.float32(np.cos(elevation_rad)) * flat + np.float32(np.sin(elevation_rad)) * p_m[:, 2:]
    bend = np.float32(curvature_per_m) * np.sum(p_m**2, axis=1, keepdims=True)
    gap = np.float32(curvature_per_m) * (bend - 2.0 * along)  # |u - p / r|^2 - 1
    shorter_m = (2.0 * along - bend) / (1.0 + np.sqrt(np.maximum(1.0 + gap, 0.0)))
    phase_rad = np.float32(4.0 * np.pi / wavelength_m) * shorter_m
    return np.cos(phase_rad) + 1j * np.sin(phase_rad)


def evenly_spaced(
    signal: Complex[np.ndarray, "packets subcarriers"],
    displacement_m: Float[np.ndarray, "packets 3"],
    *,
    spacing_m: float,
) -> tuple[Complex[np.ndarray, "positions subcarriers"], Float[np.ndarray, "positions 3"]]:
    """Means of signal and position over equal pieces of the path.

    A robot that starts and stops sends most packets from the ends of its path; equal
    pieces illuminate the aperture evenly, and there are fewer of them.
    """
    steps_m = np.linalg.norm(np.diff(displacement_m, axis=0), axis=1)
    piece = np.floor(np.concatenate([[0.0], np.cumsum(steps_m)]) / spacing_m)
    first = np.flatnonzero(np.diff(piece, prepend=-1.0))
    count = np.diff(first, append=len(piece))[:, None]
    return (
        (np.add.reduceat(signal, first, axis=0) / count).astype(np.complex64),
        np.add.reduceat(displacement_m, first, axis=0) / count,
    )


def explained_share(
    signal: Complex[np.ndarray, "positions subcarriers"],
    at_m: Float[np.ndarray, "positions 3"],
    *,
    wavelength_m: float,
    cfg: ApertureConfig,
) -> Float[np.ndarray, " grid"]:
    """Share of a two-way signal's power that the best searched front explains, for each azimuth.

    A one-way signal is a two-way signal of twice the wavelength.
    """
    azimuths_rad, best = azimuth_grid(cfg.n_azimuths), np.zeros(cfg.n_azimuths)
    for elevation_rad, curvature_per_m in itertools.product(cfg.elevations_rad, cfg.curvatures_per_m):
        steering = spherical_steering(
            at_m,
            azimuths_rad,
            elevation_rad=elevation_rad,
            curvature_per_m=curvature_per_m,
            wavelength_m=wavelength_m,
        )
        best = np.maximum(best, bartlett_profiles(signal.T, steering).mean(axis=0))
    return best


@harmless_underflow
def aperture_profiles(
    product: Complex[np.ndarray, "packets subcarriers"],
    displacement_m: Float[np.ndarray, "packets 3"],
    *,
    wavelength_m: float,
    cfg: ApertureConfig | None = None,
) -> Float[np.ndarray, "2 grid"]:
    """Shares of power that a source at each azimuth explains, both ways and one way, in [0, 1].

    Half the phase needs half the steps: the one-way search takes every second front.

    Args:
        product: Forward times reverse channel of each packet.
        displacement_m: Receiver's position at each packet in a frame that does not turn,
            m; its origin does not matter, bearings are taken from the mean position.
        wavelength_m: Wavelength of the carrier, m.
        cfg: Grid of searched wavefronts.
    """
    cfg = cfg or ApertureConfig()
    from_mean_m = (displacement_m - displacement_m.mean(axis=0)).astype(float)
    level = timing_removed(product)
    squared, at_m = evenly_spaced(unit_modulus(level), from_mean_m, spacing_m=cfg.spacing_m)
    both_ways = explained_share(squared, at_m, wavelength_m=wavelength_m, cfg=cfg)
    half = replace(cfg, elevations_rad=cfg.elevations_rad[::2], curvatures_per_m=cfg.curvatures_per_m[::2])
    fine, at_m = evenly_spaced(level, from_mean_m, spacing_m=0.5 * cfg.spacing_m)
    one_way = explained_share(unsquared(fine), at_m, wavelength_m=2.0 * wavelength_m, cfg=half)
    return np.stack([both_ways, one_way])


def aperture_profile(
    product: Complex[np.ndarray, "packets subcarriers"],
    displacement_m: Float[np.ndarray, "packets 3"],
    *,
    wavelength_m: float,
    cfg: ApertureConfig | None = None,
) -> Float[np.ndarray, " grid"]:
    """Geometric mean of `aperture_profiles`, whose arguments these are."""
    profiles = aperture_profiles(product, displacement_m, wavelength_m=wavelength_m, cfg=cfg)
    return np.sqrt(profiles[0] * profiles[1])
