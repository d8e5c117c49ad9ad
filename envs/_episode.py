"""An episode as a value: advancing it gives the next one and leaves it as it was, to the bit.

Only the generators of chance change in place, so they are a cache of the episode, never its owner: when
they are not where the episode is, because an exception interrupted an iteration or because the same
episode is advanced twice, they are set to where they last were known to be and drawn from again.
"""

from typing import Any, NamedTuple

from wifipgo.loop import advance, start
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
        seed: Root of all chance, and number of the episode under it.
        world: Room, obstacles, and the engines that serve all its ticks.
        tick: Truth and belief now.
        map_accuracy: The team's map beside the truth.
        origin: Where the generators were known.
        commands: All that the robots were told since.
        chance: The generators; shared by the episodes that follow each other, none in a snapshot.
    """

    scenario: Scenario
    seed: tuple[int, int]
    world: World
    tick: Tick
    map_accuracy: MapAccuracy
    origin: Origin
    commands: tuple[Commands, ...]
    chance: _Chance | None

    @classmethod
    def begun(cls, scenario: Scenario, seed: tuple[int, int]) -> "Episode":
        """First tick of an episode.

        Raises:
            ValueError: The room cannot be laid out.
        """
        streams = Streams.for_episode(*seed)
        world, tick = start(scenario, streams)
        origin = Origin(tick, streams.states())
        return cls(scenario, seed, world, tick, _first_map(tick), origin, (), _Chance(streams))

    @property
    def is_complete(self) -> bool:
        """Whether the measurements that the scenario asks for are taken."""
        full = self.scenario.max_measurements
        return bool(full) and int(self.tick.belief.log.edges.between_robots.sum()) >= full

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
    """Map of the team beside the truth."""
    return first_map_accuracy(tick.truth.cells, tick.truth.poses, tick.belief.paths.estimate)


def _updated_map(mapped: MapAccuracy, before: Tick, after: Tick) -> MapAccuracy:
    """The same after an iteration."""
    truth, estimate = after.truth, after.belief.paths.estimate
    return map_accuracy.updated_map_accuracy(
        mapped, truth.cells, truth.poses, before.belief.paths.estimate, estimate
    )
