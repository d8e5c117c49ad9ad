"""An episode of one or more worlds as a value: advancing it gives the next one and leaves it as it was.

Only the generators of chance change in place, so they are a cache of the episode, never its owner: when
they are not where the episode is, because an exception interrupted an iteration or because the same
episode is advanced twice, they are set to where they last were known to be and drawn from again.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool

from wifipgo.loop import advance, start
from wifipgo.rows import Rows
from wifipgo.scenarios import Scenario
from wifipgo.state import Commands, Tick, World
from wifipgo.streams import Streams
from wifipgo.world import map_accuracy
from wifipgo.world.map_accuracy import MapAccuracy, first_map_accuracy


class _Chance:
    """Generators, and how many iterations since the origin drew from them, to their end or not."""

    def __init__(self, streams: Streams) -> None:
        """Stand at the origin."""
        self.streams, self.n_begun = streams, 0


class Origin(NamedTuple):
    """A tick of the episode whose generators are known: the first, or that of a snapshot."""

    tick: Tick
    generators: tuple[Any, ...]


class Episode(NamedTuple):
    """Where an episode stands.

    Attributes:
        scenario: What is played.
        seeds: Of each world: root of all chance, and number of the episode under it.
        world: Rooms, obstacles, and the engines that serve all its ticks.
        tick: Truth and belief now.
        map_accuracy: The teams' maps beside the truth.
        origin: Where the generators were known.
        commands: All that the robots were told since.
        chance: The generators; shared by the episodes that follow each other, none in a snapshot.
    """

    scenario: Scenario
    seeds: tuple[tuple[int, int], ...]
    world: World
    tick: Tick
    map_accuracy: MapAccuracy
    origin: Origin
    commands: tuple[Commands, ...]
    chance: _Chance | None

    @classmethod
    def begun(cls, scenario: Scenario, seeds: Sequence[tuple[int, int]]) -> "Episode":
        """First tick of an episode, in as many worlds as there are seeds.

        Raises:
            ValueError: The room cannot be laid out.
        """
        streams = Streams.for_episodes(seeds)
        world, tick = start(scenario, streams)
        origin = Origin(tick, streams.states())
        mapped = _first_map(tick)
        return cls(scenario, tuple(seeds), world, tick, mapped, origin, (), _Chance(streams))

    @property
    def rows(self) -> Rows:
        """Robots of all worlds."""
        return self.world.rows

    @property
    def is_complete(self) -> Bool[np.ndarray, " worlds"]:
        """Worlds in which the measurements that the scenario asks for are taken."""
        full, edges = self.scenario.max_measurements, self.tick.belief.log.edges
        if not full:
            return np.zeros(self.rows.n_worlds, dtype=bool)
        return self.rows.counts(edges.tail[edges.between_robots, 0]) >= full

    @property
    def is_late(self) -> bool:
        """Whether the time is up."""
        return self.tick.belief.t >= self.scenario.n_steps

    def advanced(self, commands: Commands) -> "Episode":
        """The episode one iteration on."""
        chance = self._standing()
        chance.n_begun += 1
        tick = advance(self.tick, commands, world=self.world, scenario=self.scenario, streams=chance.streams)
        mapped = _updated_map(self.map_accuracy, self.tick, tick)
        told = (*self.commands, commands)
        return self._replace(tick=tick, map_accuracy=mapped, commands=told, chance=chance)

    def kept(self) -> "Episode":
        """The same with its origin now, and no generators: what a snapshot holds."""
        origin = Origin(self.tick, self._standing().streams.states())
        return self._replace(origin=origin, commands=(), chance=None)

    def _standing(self) -> _Chance:
        """The generators where the episode is: the same commands draw the same chance again."""
        if self.chance is not None and self.chance.n_begun == len(self.commands):
            return self.chance
        chance, tick = _Chance(Streams.from_states(self.origin.generators)), self.origin.tick
        for commands in self.commands:
            chance.n_begun += 1
            tick = advance(tick, commands, world=self.world, scenario=self.scenario, streams=chance.streams)
        return chance


def _first_map(tick: Tick) -> MapAccuracy:
    """Maps of the teams beside the truth."""
    return first_map_accuracy(tick.truth.cells, tick.truth.poses, tick.belief.paths.estimate)


def _updated_map(mapped: MapAccuracy, before: Tick, after: Tick) -> MapAccuracy:
    """The same after an iteration."""
    truth, estimate = after.truth, after.belief.paths.estimate
    return map_accuracy.updated_map_accuracy(
        mapped, truth.cells, truth.poses, before.belief.paths.estimate, estimate
    )
