"""Peaks of profiles (paper Eqs. 6 and 10)."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from wifipgo.se2 import wrap_angle


class Peaks(NamedTuple):
    """The highest peaks of each profile, best first.

    Where a profile has fewer peaks than asked for, the best is repeated with height 0.
    """

    azimuth_rad: Float[np.ndarray, "links peaks"]
    height: Float[np.ndarray, "links peaks"]


class Directions(NamedTuple):
    """The highest peaks of profiles over azimuth and elevation, best first, as `Peaks`."""

    azimuth_rad: Float[np.ndarray, "links peaks"]
    elevation_rad: Float[np.ndarray, "links peaks"]
    height: Float[np.ndarray, "links peaks"]


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
        shift = vertex(left[rows, best], profile[rows, best], right[rows, best])
        azimuth_rad[:, k] = wrap_angle(-np.pi + step_rad * (best + shift))
        apart = np.abs(bins[None] - best[:, None])
        open_height[np.minimum(apart, n_bins - apart) * step_rad < separation_rad] = 0.0
    azimuth_rad = np.where(height > 0.0, azimuth_rad, azimuth_rad[:, :1])
    return Peaks(azimuth_rad, height)


def vertex(
    low: Float[np.ndarray, "*links"], mid: Float[np.ndarray, "*links"], high: Float[np.ndarray, "*links"]
) -> Float[np.ndarray, "*links"]:
    """Vertex of the parabola through three neighbouring bins, in bins from the middle one."""
    bend = low - 2.0 * mid + high
    shift = np.where(bend < 0.0, 0.5 * (low - high) / np.where(bend < 0.0, bend, -1.0), 0.0)
    return np.clip(shift, -0.5, 0.5)


def find_directions(
    profile: Float[np.ndarray, "links elevations azimuths"],
    elevations_rad: Float[np.ndarray, " elevations"],
    *,
    n_peaks: int,
    separation_rad: float = np.deg2rad(8.0),
) -> Directions:
    """The N highest peaks over azimuth and elevation, at different azimuths.

    The highest value over elevation at each azimuth is a profile whose peaks are peaks of
    the whole. Where two lie above each other, the higher is kept. Azimuth and elevation are
    refined together, by the paraboloid through the bin and its eight neighbours.

    Args:
        profile: From `wifipgo.radio.aoa.bartlett.profiles`, azimuths on `azimuth_grid`.
        elevations_rad: Its elevations, ascending and evenly spaced.
        n_peaks: How many.
        separation_rad: Least distance of two azimuths.
    """
    peaks = find_peaks(profile.max(axis=1), n_peaks=n_peaks, separation_rad=separation_rad)
    n_links, n_elevations, n_azimuths = profile.shape
    step_rad = 2.0 * np.pi / n_azimuths
    column = np.rint((peaks.azimuth_rad + np.pi) / step_rad).astype(np.int64)
    link = np.arange(n_links)[:, None]
    row = profile[link, :, column % n_azimuths].argmax(axis=2)
    if n_elevations < 3:
        return Directions(peaks.azimuth_rad, elevations_rad[row], peaks.height)
    inner = np.clip(row, 1, n_elevations - 2)
    around = [[profile[link, inner + e, (column + a) % n_azimuths] for a in (-1, 0, 1)] for e in (-1, 0, 1)]
    up, ahead, good = _summit(np.array(around, dtype=float))
    good &= row == inner
    azimuth_rad = np.where(good, wrap_angle(-np.pi + step_rad * (column + ahead)), peaks.azimuth_rad)
    lift_rad = np.where(good, up, 0.0) * (elevations_rad[1] - elevations_rad[0])
    return Directions(azimuth_rad, elevations_rad[row] + lift_rad, peaks.height)


def _summit(
    f: Float[np.ndarray, "3 3 *peaks"],
) -> tuple[Float[np.ndarray, "*peaks"], Float[np.ndarray, "*peaks"], Bool[np.ndarray, "*peaks"]]:
    """Top of the paraboloid through nine bins: both shifts in bins, and whether there is one nearby."""
    slope_e, slope_a = 0.5 * (f[2, 1] - f[0, 1]), 0.5 * (f[1, 2] - f[1, 0])
    bend_e, bend_a = f[2, 1] - 2.0 * f[1, 1] + f[0, 1], f[1, 2] - 2.0 * f[1, 1] + f[1, 0]
    twist = 0.25 * (f[2, 2] - f[2, 0] - f[0, 2] + f[0, 0])
    det = bend_e * bend_a - twist**2
    safe = np.where(det > 0.0, det, 1.0)
    up, ahead = (twist * slope_a - bend_a * slope_e) / safe, (twist * slope_e - bend_e * slope_a) / safe
    return up, ahead, (det > 0.0) & (bend_a < 0.0) & (np.maximum(np.abs(up), np.abs(ahead)) <= 1.5)


def closest_peak(peaks: Peaks, azimuth_rad: Float[np.ndarray, " links"]) -> Float[np.ndarray, " links"]:
    """The peak nearest to a reported direction (paper Eq. 10), rad."""
    away = np.abs(wrap_angle(peaks.azimuth_rad - azimuth_rad[:, None]))
    return peaks.azimuth_rad[np.arange(len(away)), away.argmin(axis=1)]
