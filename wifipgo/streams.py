"""One random stream per cause of chance and world, so that causes and worlds do not disturb each other.

Two policies that run on one seed meet the same world and the same noise, whatever they do: every
comparison is paired. A world of a batch draws what it would draw alone.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from wifipgo.rows import Generators


class Streams(NamedTuple):
    """Generators per cause of chance, one a world.

    A new field goes last: the streams before it then keep their numbers.
    """

    layout: Generators
    odometry: Generators
    sensing: Generators
    channel: Generators
    outliers: Generators
    standing: Generators  # of what a radio keeps for a whole episode
    messages: Generators  # that the distributed solution loses
    sight: Generators  # of cameras and lidars

    @classmethod
    def for_episode(cls, entropy: int, episode: int) -> "Streams":
        """Streams of one world: each keyed by (episode, place) under one root ``entropy``."""
        return cls.for_episodes([(entropy, episode)])

    @classmethod
    def for_episodes(cls, seeds: Sequence[tuple[int, int]]) -> "Streams":
        """Streams of several worlds, each keyed by its own root and episode."""
        return cls(
            *(Generators([_keyed(*seed, place) for seed in seeds]) for place in range(len(cls._fields)))
        )

    @property
    def n_worlds(self) -> int:
        """Worlds that draw."""
        return len(self.layout.each)

    def states(self) -> tuple[tuple[dict[str, Any], ...], ...]:
        """Where each generator stands, by cause and world."""
        return tuple(tuple(dict(one.bit_generator.state) for one in stream.each) for stream in self)

    @classmethod
    def from_states(cls, states: Iterable[Iterable[Mapping[str, Any]]]) -> "Streams":
        """Generators that stand where others stood."""
        return cls(*(Generators(list(map(_standing_at, each))) for each in states))


def _keyed(entropy: int, episode: int, place: int) -> np.random.Generator:
    return np.random.default_rng(np.random.SeedSequence(entropy, spawn_key=(episode, place)))


def _standing_at(state: Mapping[str, Any]) -> np.random.Generator:
    rng = np.random.default_rng(0)
    rng.bit_generator.state = dict(state)
    return rng
