"""Bartlett profiles: the share of a signal's power that each direction explains."""

import functools
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Complex64, Float, Float32

from wifipgo.arithmetic import harmless_underflow
from wifipgo.radio.aoa.steering import Aperture

# Signals of one product: always so few, so that a signal has the same profile, to the bit, in any company
# that it has in a step; of more signals than a step looks at in one go many, which is faster.
_FEW, _MANY, _IN_ONE_GO = 2, 64, 448
# Signals of one block: what is worked on stays in the processor's cache.
_BLOCK = 64


@harmless_underflow
def bartlett_profiles(
    signal: Complex[np.ndarray, "links positions"], steering: Complex[np.ndarray, "positions grid"]
) -> Float[np.ndarray, "links grid"]:
    """Share of each signal's power that each direction explains, in [0, 1].

    ``|a^H s|^2 / (n |s|^2)``, matrix products for all links. A signal without power has a
    profile of zeros. Where the second half of the grid is the first half turned round,
    opposite directions share the same four real products, which halves the work.
    """
    if signal.dtype == steering.dtype == np.complex64:
        quadratures = _quadratures(steering)
        if quadratures is not None:
            return _mirrored(signal, quadratures)
    response = signal.conj() @ steering
    parts = response.view(response.real.dtype)
    np.square(parts, out=parts)
    share = parts[:, ::2] + parts[:, 1::2]
    share *= _scale(np.vecdot(signal, signal).real, len(steering)).astype(share.dtype)
    return share


def _scale(power: Float[np.ndarray, " links"], n_positions: int) -> Float[np.ndarray, "links 1"]:
    """What makes a share of a response's power; finite without power."""
    return 1.0 / np.maximum(power * n_positions, np.finfo(np.float32).tiny)[:, None]


class _Constant(NamedTuple):
    """An array that nobody can change, which is itself and equal to no other."""

    array: np.ndarray

    def __eq__(self, other: object) -> bool:
        """Whether it is the same array."""
        return isinstance(other, _Constant) and self.array is other.array

    def __hash__(self) -> int:
        """By identity, as equality is."""
        return id(self.array)


def _quadratures(steering: Complex64[np.ndarray, "positions grid"]) -> Float32[np.ndarray, "..."] | None:
    """Real and imaginary parts of the first half of a mirrored grid; None if it is none.

    Looked for once in steering vectors that are constant.
    """
    constant = not steering.flags.writeable and steering.base is None
    return _quadratures_once(_Constant(steering)) if constant else _found_quadratures(steering)


@functools.lru_cache(maxsize=32)
def _quadratures_once(steering: _Constant) -> Float32[np.ndarray, "..."] | None:
    return _found_quadratures(steering.array)


def _found_quadratures(
    steering: Complex64[np.ndarray, "positions grid"],
) -> Float32[np.ndarray, "..."] | None:
    half = steering.shape[1] // 2
    if not _is_mirrored(steering):
        return None
    return np.concatenate([steering.real[:, :half], steering.imag[:, :half]], axis=1)


def _is_mirrored(steering: Complex64[np.ndarray, "positions grid"]) -> bool:
    """Whether the directions of the second half are exactly opposite to those of the first."""
    half = steering.shape[1] // 2
    first, second = steering[:, :half], steering[:, half:]
    if first.shape != second.shape or not half or first[-1, -1] != second[-1, -1].conj():
        return False
    return np.array_equal(first.real, second.real) and np.array_equal(first.imag, -second.imag)


def _mirrored(
    signal: Complex64[np.ndarray, "links positions"], quadratures: Float32[np.ndarray, "positions grid"]
) -> Float32[np.ndarray, "links grid"]:
    """Profiles on a mirrored grid from real products.

    With s = x + j y and a = c + j d, ``|a^H s|^2 = (xc + yd)^2 + (yc - xd)^2`` and, the other
    way round, ``|conj(a)^H s|^2 = (xc - yd)^2 + (yc + xd)^2``: the sum of four squares
    plus or minus ``2 (xc yd - yc xd)``.
    """
    n_links, n_positions = signal.shape
    size, half = quadratures.shape[1], quadratures.shape[1] // 2
    product = _FEW if n_links <= _IN_ONE_GO else _MANY
    out = np.empty((n_links, size), np.float32)
    for start in range(0, n_links, _BLOCK):
        block, share = signal[start : start + _BLOCK], out[start : start + _BLOCK]
        xy = np.ascontiguousarray(block).view(np.float32).reshape(len(block), n_positions, 2).swapaxes(1, 2)
        if len(block) % product:
            xy = np.concatenate([xy, np.zeros((-len(block) % product, 2, n_positions), np.float32)])
        whole = np.ascontiguousarray(xy).reshape(len(xy) // product, 2 * product, n_positions)
        found = np.matmul(whole, quadratures).reshape(len(xy), 2, size)[: len(block)]
        twice = found[:, 0, :half] * found[:, 1, half:]
        twice -= found[:, 1, :half] * found[:, 0, half:]
        twice += twice
        np.square(found, out=found)
        np.add(found[:, 0], found[:, 1], out=share)
        ahead, behind = share[:, :half], share[:, half:]
        ahead += behind
        np.subtract(ahead, twice, out=behind)
        ahead += twice
        share *= _scale(np.vecdot(block, block).real, n_positions)
    return np.maximum(out, 0.0, out=out)


def eq5_profiles(
    profile: Float[np.ndarray, "*links grid"], n_positions: int
) -> Float[np.ndarray, "*links grid"]:
    """F of paper Eq. 5 from the Bartlett share, or the MUSIC spectrum from the subspace's share.

    With one snapshot vector the covariance of Eq. 5 has rank one, so its noise
    projector is I - h h^H / |h|^2 and F = 1 / (n - |a^H h|^2 / |h|^2): a monotone map.
    """
    return 1.0 / np.maximum(n_positions * (1.0 - profile), np.finfo(np.float32).eps)


@harmless_underflow
def profiles(
    signal: Complex[np.ndarray, "links *snapshots positions"],
    aperture: Aperture,
    *,
    azimuths_rad: Float[np.ndarray, " azimuths"],
    elevations_rad: Float[np.ndarray, " elevations"] | tuple[float, ...] = (0.0,),
) -> Float[np.ndarray, "links elevations azimuths"]:
    """Bartlett profiles over azimuth and elevation, of any aperture (paper Fig. 2).

    Args:
        signal: What was heard at each position, one row per link; of several snapshots
            (subcarriers) the shares are averaged, that is, their powers add.
        aperture: Where it was heard.
        azimuths_rad: Candidate azimuths; a whole circle of an even number is fastest.
        elevations_rad: Candidate elevations; a flat aperture needs none below 0.
    """
    rows = signal.reshape(-1, signal.shape[-1])
    n_snapshots = max(1, len(rows) // max(1, len(signal)))
    found = np.empty((len(signal), len(elevations_rad), len(azimuths_rad)), np.float32)
    for k, elevation_rad in enumerate(elevations_rad):
        share = bartlett_profiles(rows, aperture.steering(azimuths_rad, elevation_rad=float(elevation_rad)))
        found[:, k] = share.reshape(len(signal), n_snapshots, len(azimuths_rad)).mean(axis=1)
    return found
