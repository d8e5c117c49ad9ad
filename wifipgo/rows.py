"""Robots of several worlds on one axis, and chance that is each world's own.

World w has the rows ``w * n_robots`` to ``(w + 1) * n_robots - 1``. What is ragged (links, edges, meetings)
is a flat list that names rows, so a batch of worlds is one large team between whose parts nothing is seen or
heard, and one world is a batch of one.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Int, Shaped, UInt64


class Rows(NamedTuple):
    """Which rows belong to which world."""

    n_worlds: int
    n_robots: int

    @classmethod
    def of(cls, n_rows: int, n_robots: int) -> "Rows":
        """As many worlds as these rows make."""
        return cls(n_rows // n_robots, n_robots)

    def __len__(self) -> int:
        """Rows of all worlds."""
        return self.n_worlds * self.n_robots

    def world(self, row: Int[np.ndarray, "*rows"]) -> Int[np.ndarray, "*rows"]:
        """World of each row."""
        return row // self.n_robots

    def peer(self, row: Int[np.ndarray, "*rows"]) -> Int[np.ndarray, "*rows"]:
        """Number of each row in its own world: its column in a table of pairs."""
        return row % self.n_robots

    def counts(self, row: Int[np.ndarray, " rows"]) -> Int[np.ndarray, " worlds"]:
        """How many of these rows are in each world."""
        return np.bincount(self.world(row), minlength=self.n_worlds)

    def by_world(self, x: Shaped[np.ndarray, "rows ..."]) -> Shaped[np.ndarray, "worlds robots ..."]:
        """The same with an axis of worlds."""
        return x.reshape(self.n_worlds, self.n_robots, *x.shape[1:])


class Generators:
    """Generators of several worlds that draw as one: the first axis of a draw has as much of each.

    What a world gets is what it would draw alone. It has of `numpy.random.Generator` what a loop draws with.
    """

    def __init__(self, each: Sequence[np.random.Generator]) -> None:
        """Draw from one generator a world."""
        self.each = tuple(each)

    def standard_normal(self, size: Any = None, dtype: Any = np.float64) -> Any:
        """Normal numbers of mean 0 and variance 1."""
        if len(self.each) == 1:
            return self.each[0].standard_normal(size, dtype=dtype)
        return self._drawn(size, dtype, lambda rng, share: rng.standard_normal(dtype=dtype, out=share))

    def random(self, size: Any = None, dtype: Any = np.float64) -> Any:
        """Uniform numbers in [0, 1)."""
        if len(self.each) == 1:
            return self.each[0].random(size, dtype=dtype)
        return self._drawn(size, dtype, lambda rng, share: rng.random(dtype=dtype, out=share))

    def uniform(self, low: float = 0.0, high: float = 1.0, size: Any = None) -> Any:
        """Uniform numbers in [low, high)."""
        if len(self.each) == 1:
            return self.each[0].uniform(low, high, size)
        return self._drawn(size, np.float64, lambda rng, share: rng.uniform(low, high, share.shape))

    def gumbel(self, *, size: Any) -> np.ndarray:
        """Gumbel numbers of location 0 and scale 1."""
        if len(self.each) == 1:
            return self.each[0].gumbel(size=size)
        return self._drawn(size, np.float64, lambda rng, share: rng.gumbel(size=share.shape))

    def integers(self, high: int, size: Any = None) -> Any:
        """Whole numbers in [0, high)."""
        if len(self.each) == 1:
            return self.each[0].integers(high, size=size)
        return self._drawn(size, np.int64, lambda rng, share: rng.integers(high, size=share.shape))

    def _drawn(
        self, size: Any, dtype: Any, draw: Callable[[np.random.Generator, np.ndarray], Any]
    ) -> np.ndarray:
        """Numbers of all worlds; a draw gives a world's share, or has written it in place."""
        out = np.empty(size, dtype=dtype)
        for rng, share in self._shares(out):
            drawn = draw(rng, share)
            if drawn is not share:
                share[...] = drawn
        return out

    def _shares(self, out: np.ndarray) -> list[tuple[np.random.Generator, np.ndarray]]:
        """Each world's generator, and its part of a draw."""
        n = len(out) // len(self.each)
        return [(rng, out[k * n : (k + 1) * n]) for k, rng in enumerate(self.each)]


Chance = np.random.Generator | Generators


def draw_keys(rng: Chance, n_worlds: int) -> UInt64[np.ndarray, " worlds"]:
    """One key of 64 random bits a world, from which `wifipgo.counters` makes numbers.

    The streams move on by as much, whatever is made of the keys.
    """
    if isinstance(rng, Generators):
        return np.array([one.bit_generator.random_raw() for one in rng.each], dtype=np.uint64)
    return np.atleast_1d(rng.bit_generator.random_raw(n_worlds)).astype(np.uint64)
