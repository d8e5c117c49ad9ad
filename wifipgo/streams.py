"""One random stream per cause of chance, so that causes do not disturb each other.

Two policies that run on one seed meet the same world and the same noise, whatever
they do: every comparison is paired.
"""

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np


class Streams(NamedTuple):
    """One generator per cause of chance.

    A new field goes last: the streams before it then keep their numbers.
    """

    layout: np.random.Generator
    odometry: np.random.Generator
    sensing: np.random.Generator
    channel: np.random.Generator
    outliers: np.random.Generator
    standing: np.random.Generator  # of what a radio keeps for a whole episode
    messages: np.random.Generator  # that the distributed solution loses
    sight: np.random.Generator  # of cameras

    @classmethod
    def for_episode(cls, entropy: int, episode: int) -> "Streams":
        """Key each stream by (episode, place) under one root ``entropy``."""
        keys = [(episode, place) for place in range(len(cls._fields))]
        seeds = [np.random.SeedSequence(entropy, spawn_key=key) for key in keys]
        return cls(*map(np.random.default_rng, seeds))

    def states(self) -> tuple[dict[str, Any], ...]:
        """Where each generator stands."""
        return tuple(dict(stream.bit_generator.state) for stream in self)

    @classmethod
    def from_states(cls, states: Iterable[Mapping[str, Any]]) -> "Streams":
        """Generators that stand where others stood."""
        return cls(*map(_standing_at, states))


def _standing_at(state: Mapping[str, Any]) -> np.random.Generator:
    rng = np.random.default_rng(0)
    rng.bit_generator.state = dict(state)
    return rng
