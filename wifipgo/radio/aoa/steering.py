"""Apertures: where a receiver listens from, and what a plane wave does to the phase there.

A robot that turns with two antennas and a robot that drives with one are the same
thing to an estimator: a row of baselines ``b_p``, metres, such that a plane wave that
arrives from the unit vector ``u`` has phase ``2 pi / lambda b_p . u`` at packet p, up to
a constant. For the turning pair ``b_p`` leads from one antenna to the other, for the
moving antenna it is the displacement times the passes over the link.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float

from wifipgo.errors import require, require_within

WAVELENGTH_LIMITS_M = (1e-4, 1e4)
_LONGEST_M = 1e6


def azimuth_grid(n_azimuths: int) -> Float[np.ndarray, " grid"]:
    """Directions of a profile's bins, rad, from -pi (included) to pi (excluded)."""
    return -np.pi + 2.0 * np.pi / n_azimuths * np.arange(n_azimuths)


def unit_vectors(
    azimuths_rad: Float[np.ndarray, " grid"], elevation_rad: float
) -> Float[np.ndarray, "3 grid"]:
    """Directions ``(cos e cos a, cos e sin a, sin e)``."""
    across, up = np.cos(elevation_rad), np.full(len(azimuths_rad), np.sin(elevation_rad))
    return np.stack([across * np.cos(azimuths_rad), across * np.sin(azimuths_rad), up])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Aperture:
    """Baselines of a synthetic array.

    Attributes:
        baseline_m: What a plane wave's direction is projected on at each packet, m.
        wavelength_m: Wavelength of the carrier, m.
    """

    baseline_m: Float[np.ndarray, "positions 3"]
    wavelength_m: float

    def __post_init__(self) -> None:
        """Refuse what has no phase."""
        require_within(self, {"wavelength_m": WAVELENGTH_LIMITS_M})
        require(len(self.baseline_m) > 0, "Aperture.baseline_m", "at least one position", self.baseline_m)
        rule = f"finite and at most {_LONGEST_M:g}"
        require(
            bool((np.abs(self.baseline_m) <= _LONGEST_M).all()), "Aperture.baseline_m", rule, self.baseline_m
        )

    @property
    def is_flat(self) -> bool:
        """Whether it lies in the plane: it then cannot tell an elevation from its negative."""
        return not self.baseline_m[:, 2].any()

    def steering(
        self, azimuths_rad: Float[np.ndarray, " grid"], *, elevation_rad: float = 0.0
    ) -> Complex[np.ndarray, "positions grid"]:
        """Phase factor at each position for a plane wave from each azimuth, complex64.

        Opposite directions have conjugate factors on a flat aperture. On a grid of a whole
        circle they are made exactly so, which `wifipgo.radio.aoa.bartlett` turns into speed.
        """
        half = len(azimuths_rad) // 2
        opposite = self.is_flat and _is_circle(azimuths_rad)
        directions = unit_vectors(azimuths_rad[:half] if opposite else azimuths_rad, elevation_rad)
        phase_rad = 2.0 * np.pi / self.wavelength_m * (self.baseline_m @ directions)
        factor = np.exp(1j * phase_rad).astype(np.complex64)
        return np.concatenate([factor, factor.conj()], axis=1) if opposite else factor


def _is_circle(azimuths_rad: Float[np.ndarray, " grid"]) -> bool:
    """Whether the second half of a grid is the first half, turned by pi."""
    half = len(azimuths_rad) // 2
    return 2 * half == len(azimuths_rad) > 0 and np.allclose(
        azimuths_rad[half:] - azimuths_rad[:half], np.pi, rtol=0.0, atol=1e-9
    )


def turning_pair(
    headings_rad: Float[np.ndarray, " positions"], *, antenna_gap_m: float, wavelength_m: float
) -> Aperture:
    """Two antennas on a robot that turns: ``2 pi gap / lambda cos(elevation) cos(azimuth - heading)``.

    The phase is that of the antenna ahead relative to the one behind (Phi of paper Eq. 5).
    """
    ahead = np.stack([np.cos(headings_rad), np.sin(headings_rad), np.zeros(len(headings_rad))], axis=1)
    return Aperture(baseline_m=antenna_gap_m * ahead, wavelength_m=wavelength_m)


def moving_antenna(
    displacement_m: Float[np.ndarray, "positions 3"], *, wavelength_m: float, passes: int = 2
) -> Aperture:
    """One antenna on a robot that drives.

    ``passes`` is 2 for the product of forward and reverse channel, in which the phase
    of the displacement doubles (WSR-Toolbox, arXiv 2109.12205), and 1 for one way.
    """
    return Aperture(baseline_m=float(passes) * displacement_m.astype(float), wavelength_m=wavelength_m)


def turn_steering(
    headings_rad: Float[np.ndarray, " positions"],
    azimuths_rad: Float[np.ndarray, " grid"],
    *,
    antenna_gap_m: float,
    wavelength_m: float,
    elevation_rad: float = 0.0,
) -> Complex[np.ndarray, "positions grid"]:
    """Steering of `turning_pair`; elevation 0 in the simulator, whose world is a plane."""
    pair = turning_pair(headings_rad, antenna_gap_m=antenna_gap_m, wavelength_m=wavelength_m)
    return pair.steering(azimuths_rad, elevation_rad=elevation_rad)


def displacement_steering(
    displacement_m: Float[np.ndarray, "packets 3"],
    azimuths_rad: Float[np.ndarray, " grid"],
    *,
    elevation_rad: float,
    wavelength_m: float,
    passes: int = 2,
) -> Complex[np.ndarray, "packets grid"]:
    """Steering of `moving_antenna`."""
    moving = moving_antenna(displacement_m, wavelength_m=wavelength_m, passes=passes)
    return moving.steering(azimuths_rad, elevation_rad=elevation_rad)
