"""An episode as a value: advancing it gives the next one and leaves it as it was, to the bit.

The physics engine, the warm solvers and the generators change in place, so they are a cache of the
episode, never its owner: when they are not where the episode is, because an exception interrupted an
iteration or because the same episode is advanced twice, they are made anew from the seed and the
commands so far.
"""

from typing import NamedTuple

from wifipgo.loop import advance, start
from wifipgo.scenarios import Scenario
from wifipgo.state import Commands, Tick, World
from wifipgo.streams import Streams


class _Engine:
    """What changes in place: the world's space and solvers, and chance."""

    def __init__(self, scenario: Scenario, seed: tuple[int, int]) -> None:
        """Lay out the world of (root of all chance, number of the episode) and let the robots sense once."""
        self.scenario, self.streams = scenario, Streams.for_episode(*seed)
        self.world, self.first = start(scenario, self.streams)
        self.n_begun = 0  # iterations, whether they came to their end or not

    def advance(self, tick: Tick, commands: Commands) -> Tick:
        """One iteration, on from where the engine is."""
        self.n_begun += 1
        return advance(tick, commands, world=self.world, scenario=self.scenario, streams=self.streams)


class Episode(NamedTuple):
    """Where an episode stands.

    Attributes:
        scenario: What is played.
        seed: Root of all chance, and number of the episode under it.
        tick: Truth and belief now.
        commands: All that the robots were told so far.
        engine: What changes in place; shared by the episodes that follow each other.
    """

    scenario: Scenario
    seed: tuple[int, int]
    tick: Tick
    commands: tuple[Commands, ...]
    engine: _Engine

    @classmethod
    def begun(cls, scenario: Scenario, seed: tuple[int, int]) -> "Episode":
        """First tick of an episode.

        Raises:
            ValueError: The room cannot be laid out.
        """
        engine = _Engine(scenario, seed)
        return cls(scenario, seed, engine.first, (), engine)

    @property
    def world(self) -> World:
        """Room and obstacles."""
        return self.engine.world

    def advanced(self, commands: Commands) -> "Episode":
        """The episode one iteration on."""
        engine = self.engine if self.engine.n_begun == len(self.commands) else self._replayed()
        tick = engine.advance(self.tick, commands)
        return self._replace(tick=tick, commands=(*self.commands, commands), engine=engine)

    def _replayed(self) -> _Engine:
        """An engine that did all iterations so far: seed and commands decide everything that it does."""
        engine = _Engine(self.scenario, self.seed)
        tick = engine.first
        for commands in self.commands:
            tick = engine.advance(tick, commands)
        return engine
