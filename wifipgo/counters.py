"""Chance by key and counter: any number of a stream can be had without those before it.

What a step draws for a link then depends on the step and the link alone, not on which other links there are
or in what order. Numbers are SplitMix64 (Steele et al., OOPSLA 2014): a hash of a key and a counter.
"""

from typing import Any

import numpy as np
from jaxtyping import Float, Shaped, UInt64
from scipy.special import ndtri

STEP, _MIX_A, _MIX_B = (np.uint64(k) for k in (0x9E3779B97F4A7C15, 0xBF58476D1CE4E5B9, 0x94D049BB133111EB))
_FAR = np.uint64(1 << 63)  # counters of keys, where none of numbers are
_S30, _S27, _S31, _S11 = (np.uint64(k) for k in (30, 27, 31, 11))


def mixed(z: UInt64[np.ndarray, "*n"]) -> UInt64[np.ndarray, "*n"]:
    """Bits that look random, of numbers that may be in a row."""
    z = z ^ (z >> _S30)
    z *= _MIX_A
    z ^= z >> _S27
    z *= _MIX_B
    z ^= z >> _S31
    return z


def unit_interval(bits: UInt64[np.ndarray, "*n"]) -> Float[np.ndarray, "*n"]:
    """Uniform numbers in (0, 1), of random bits; neither end is among them."""
    out = (bits >> _S11).astype(np.float64)
    out += 0.5
    out *= 2.0**-53
    return out


class Counters:
    """Chance of items that have a key each; it has of `numpy.random.Generator` what a receiver draws with.

    The first axis of a draw is that of the items. Asked again it gives the same numbers: every use of chance
    has a `stream` of its own.
    """

    def __init__(self, key: UInt64[np.ndarray, " items"]) -> None:
        """Draw for items with these keys."""
        self.key = key

    def stream(self, number: int) -> "Counters":
        """Chance of the same items that has nothing to do with that of other numbers."""
        return self.split(np.array([number], dtype=np.uint64))

    def split(self, number: UInt64[np.ndarray, " #items"]) -> "Counters":
        """The same with another number for each item, less than 2^63."""
        return Counters(mixed(self.key + STEP * (number | _FAR)))

    def some(self, rows: Shaped[np.ndarray, " some"]) -> "Counters":
        """Chance of some of the items."""
        return Counters(self.key[rows])

    def random(self, size: Any = None, dtype: Any = np.float64) -> Any:
        """Uniform numbers in (0, 1)."""
        return unit_interval(self._bits(size)).astype(dtype, copy=False)

    def standard_normal(self, size: Any = None, dtype: Any = np.float64) -> Any:
        """Normal numbers of mean 0 and variance 1."""
        return ndtri(unit_interval(self._bits(size))).astype(dtype, copy=False)

    def integers(self, high: int, size: Any = None) -> Any:
        """Whole numbers in [0, high), equally probable to 2^-53."""
        return (unit_interval(self._bits(size)) * high).astype(np.int64)

    def _bits(self, size: Any) -> UInt64[np.ndarray, "..."]:
        """The first 64-bit numbers of each item."""
        shape = (len(self.key),) if size is None else tuple(np.atleast_1d(size).tolist())
        counter = np.arange(1, int(np.prod(shape[1:], dtype=np.int64)) + 1, dtype=np.uint64)
        bits = mixed(self.key[:, None] + STEP * counter)
        return bits.reshape(shape)
