"""Chance of pairs of robots that depends on the pair and the step alone, not on who sees whom.

Policies that run on one seed then meet the same noise whatever they do. In small teams numbers are drawn
for all pairs, and those of some are used. In large ones, where that is most of a step, one key is drawn for
each world and step, and the number of a pair is a hash of key and pair: a generator by counters (SplitMix64,
Steele et al., OOPSLA 2014), of which any number can be had without those before.
"""

import numpy as np
from jaxtyping import Float, Int
from scipy.special import ndtri

from wifipgo.counters import STEP, mixed, unit_interval
from wifipgo.rows import Chance

# Teams of at most so many draw for all pairs.
_MOST_DRAWN = 100


def pair_normals(
    rng: Chance,
    shape: tuple[int, int],
    row: Int[np.ndarray, " pairs"],
    peer: Int[np.ndarray, " pairs"],
    k: int,
) -> Float[np.ndarray, "pairs k"]:
    """``k`` normal numbers of mean 0 and variance 1 for each of some pairs.

    Args:
        rng: Moves on by what does not depend on the pairs.
        shape: Of a table of pairs: rows and peers.
        row: One robot of each pair.
        peer: The other's number in its world.
        k: Numbers of each pair.
    """
    if shape[1] <= _MOST_DRAWN:
        return rng.standard_normal((*shape, k))[row, peer]
    normal: np.ndarray = ndtri(_hashed(rng, shape, row, peer, k))
    return normal


def pair_uniforms(
    rng: Chance,
    shape: tuple[int, int],
    row: Int[np.ndarray, " pairs"],
    peer: Int[np.ndarray, " pairs"],
    k: int,
) -> Float[np.ndarray, "pairs k"]:
    """``k`` uniform numbers in [0, 1) for each of some pairs; arguments are those of `pair_normals`."""
    if shape[1] <= _MOST_DRAWN:
        return rng.random((*shape, k))[row, peer]
    return _hashed(rng, shape, row, peer, k)


def _hashed(
    rng: Chance, shape: tuple[int, int], row: np.ndarray, peer: np.ndarray, k: int
) -> Float[np.ndarray, "pairs k"]:
    """Numbers in (0, 1), by a new key for each world."""
    n = shape[1]
    key = rng.integers(2**63, size=shape[0] // n).astype(np.uint64)
    pair = (row % n * n + peer).astype(np.uint64)
    counter = pair[:, None] * np.uint64(k) + np.arange(1, k + 1, dtype=np.uint64)
    return unit_interval(mixed(key[row // n][:, None] + STEP * counter))
