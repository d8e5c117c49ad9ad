"""The channel along the subcarriers of a band: what the delay of each path does there."""

import functools
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Complex64, Float, Float32, Inexact, Int

from wifipgo.arithmetic import harmless_underflow
from wifipgo.errors import require
from wifipgo.radio.channel.bands import BANDS, SUBCARRIER_SPACING_HZ, band_of
from wifipgo.radio.propagation.paths import Paths


def phasors(angle_rad: Float32[np.ndarray, "*shape"]) -> Complex64[np.ndarray, "*shape"]:
    """exp(j angle) in single precision, ten times faster than the complex exponential."""
    out = np.empty(angle_rad.shape, dtype=np.complex64)
    np.cos(angle_rad, out=out.real)
    np.sin(angle_rad, out=out.imag)
    return out


@harmless_underflow
def subcarrier_phasors(
    delay_s: Float[np.ndarray, "links paths"], *, bandwidth_hz: float = 20e6
) -> Complex[np.ndarray, "links paths subcarriers"]:
    """Phase that each path's delay adds at each reported subcarrier, relative to the carrier."""
    turns = within_a_turn(-SUBCARRIER_SPACING_HZ * delay_s)
    each_rad = np.multiply(2.0 * np.pi, turns, dtype=np.float32, casting="same_kind")
    return phasors(each_rad[..., None] * _subcarriers_f32(bandwidth_hz))


def within_a_turn(turns: Float[np.ndarray, "*shape"]) -> Float[np.ndarray, "*shape"]:
    """Turns without whole ones, which would cost single precision its digits; in place."""
    turns -= np.rint(turns)
    return turns


@functools.lru_cache(maxsize=len(BANDS))
def _subcarriers_f32(bandwidth_hz: float) -> Float32[np.ndarray, " subcarriers"]:
    """Indices of the reported subcarriers, in single precision."""
    return band_of(bandwidth_hz).subcarriers.astype(np.float32)


@harmless_underflow
def centre_channel(paths: Paths, *, bandwidth_hz: float = 20e6) -> Complex[np.ndarray, "links subcarriers"]:
    """Noise-free channel at the receiver's centre, gain per subcarrier."""
    place = _comb(bandwidth_hz).place
    found = combed_channel(paths.gain.T, paths.delay_s.T, bandwidth_hz=bandwidth_hz)
    return found.take(place, axis=0).T


def combed_channel(
    gain: Inexact[np.ndarray, "paths links"],
    delay_s: Float[np.ndarray, "paths links"],
    *,
    bandwidth_hz: float,
) -> Complex64[np.ndarray, "subcarriers links"]:
    """The same with links last and the subcarriers in another order, which no mean over them minds.

    Between subcarriers as far apart a path turns by the same factor, so all are products of others: twice as
    many with each multiplication, which costs a fraction of as many sines and errs by a few roundings. Paths
    are added one by one, so that a link has the same channel, to the bit, in any company.
    """
    comb, (n_paths, n_links) = _comb(bandwidth_hz), gain.shape
    if n_links == 1:  # numpy multiplies complex numbers by one with another rounding than by several
        twice = combed_channel(gain.repeat(2, axis=1), delay_s.repeat(2, axis=1), bandwidth_hz=bandwidth_hz)
        return twice[:, :1]
    turns = within_a_turn((-SUBCARRIER_SPACING_HZ * comb.unit) * delay_s)
    powers = _Powers(phasors((2.0 * np.pi * turns).astype(np.float32)))
    narrow = gain.astype(np.complex64, copy=False)
    each = np.empty((n_paths, len(comb.firsts), comb.length, n_links), dtype=np.complex64)
    rows, runs = each.reshape(n_paths, -1, n_links), each[:, :, 0]
    for run, first in enumerate(comb.firsts):
        np.multiply(powers.of(first), narrow, out=runs[:, run])
    done = 1
    while done < comb.length:
        more, apart = min(done, comb.length - done), powers.of(comb.apart * done)[:, None, None]
        np.multiply(each[:, :, :more], apart, out=each[:, :, done : done + more])
        done += more
    for row, alone in comb.rest:
        np.multiply(powers.of(alone), narrow, out=rows[:, row])
    total: np.ndarray = rows[0]
    for more_of_it in rows[1:]:
        total += more_of_it
    return total


class _Powers:
    """Whole powers of phasors, which are kept."""

    def __init__(self, base: Complex64[np.ndarray, "paths links"]) -> None:
        """Start from the first power."""
        self._known = {1: base}

    def of(self, exponent: int) -> Complex64[np.ndarray, "paths links"]:
        """A power that is not 0, by its binary digits."""
        if exponent in self._known:
            return self._known[exponent]
        if exponent < 0:
            found = self.of(-exponent).conj()
        elif exponent & (exponent - 1) == 0:  # a power of two
            half = self.of(exponent >> 1)
            found = half * half
        else:
            rest = exponent & (exponent - 1)
            found = self.of(exponent ^ rest) * self.of(rest)
        self._known[exponent] = found
        return found


class _Comb(NamedTuple):
    """Reported subcarriers as runs of one length that are equally far apart, all multiples of a unit.

    Attributes:
        unit: Largest number of which all subcarriers are multiples; what follows counts in it.
        firsts: First subcarrier of each run.
        apart: Distance within runs.
        length: Of each run.
        rest: Rows of the runs that are no reported subcarrier, and those that are in no run, which go there.
        place: Row of each reported subcarrier.
    """

    unit: int
    firsts: tuple[int, ...]
    apart: int
    length: int
    rest: tuple[tuple[int, int], ...]
    place: Int[np.ndarray, " subcarriers"]


@functools.lru_cache(maxsize=len(BANDS))
def _comb(bandwidth_hz: float) -> _Comb:
    """Runs of a band."""
    subcarriers = band_of(bandwidth_hz).subcarriers
    unit = int(np.gcd.reduce(subcarriers))
    gaps = np.diff(subcarriers)
    apart = int(np.bincount(gaps).argmax())
    starts = np.append(0, np.flatnonzero(gaps != apart) + 1)
    lengths = np.diff(starts, append=len(subcarriers))
    firsts, alone = subcarriers[starts[lengths > 1]], subcarriers[starts[lengths == 1]]
    rows = (firsts[:, None] + apart * np.arange(lengths.max())).ravel()
    free = np.flatnonzero(~np.isin(rows, subcarriers))
    require(len(free) == len(alone), "subcarriers", "runs of one length but for single ones", subcarriers)
    rows[free] = alone
    place = np.argsort(rows)[np.searchsorted(np.sort(rows), subcarriers)]
    rest = tuple(zip(free.tolist(), (alone // unit).tolist(), strict=True))
    return _Comb(unit, tuple((firsts // unit).tolist()), apart // unit, int(lengths.max()), rest, place)
