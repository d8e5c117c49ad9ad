"""Many worlds at once: one call resets or steps all of them, with arrays in and arrays out.

No dicts, no agents that come and go, no autoreset: adapters to frameworks add what theirs expects.
"""

from collections.abc import Mapping, Sequence
from os import PathLike
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Float32, Int8, Shaped

from envs._arguments import NotResetError
from envs._rendezvous import RendezvousEnv
from wifipgo.errors import BadInputError, require
from wifipgo.heap import keep_freed_memory
from wifipgo.scenarios import Scenario
from wifipgo.state import Tick, World

RESET_MASK = "reset_mask"  # gymnasium's name, in the options of a reset
Infos = dict[str, np.ndarray]
Observations = np.ndarray | dict[str, np.ndarray]


class Buffers(NamedTuple):
    """Arrays of the caller's that results are written into, contiguous.

    Attributes:
        observations: Flat ones.
        rewards: Of each robot.
        terminations, truncations: Whether an episode ended, and how.
    """

    observations: Float32[np.ndarray, "worlds robots numbers"]
    rewards: Float[np.ndarray, "worlds robots"]
    terminations: Bool[np.ndarray, "worlds robots"]
    truncations: Bool[np.ndarray, "worlds robots"]


class VectorStep(NamedTuple):
    """What a step of all worlds gives; a world that is over stands still, with reward 0.

    Attributes:
        observations: float32, ``(worlds, robots, numbers)``; a dict of such arrays where asked for.
        rewards: Of each robot.
        terminations: The task of the world ended, by robot; stays until the world is reset.
        truncations: Its time is up, by robot; stays too.
        infos: Of fixed shapes and dtypes, ``(worlds, robots, ...)``.
    """

    observations: Any
    rewards: Float[np.ndarray, "worlds robots"]
    terminations: Bool[np.ndarray, "worlds robots"]
    truncations: Bool[np.ndarray, "worlds robots"]
    infos: Infos


class RendezvousVectorEnv:
    """Many worlds of one scenario; world k of the batch is `RendezvousEnv` with the seed of world k.

    Args:
        scenario: As `RendezvousEnv`, as all that is not named here.
        n_worlds: How many.
        buffers: Arrays to write results into instead of new ones; flat observations only.
        arguments: Of `RendezvousEnv`.

    Raises:
        ValueError: ``n_worlds`` is less than 1, or `RendezvousEnv` refuses.
    """

    def __init__(
        self,
        scenario: str | PathLike[str] | Scenario = "paper-hw-2",
        *,
        n_worlds: int = 64,
        buffers: Buffers | None = None,
        **arguments: Any,
    ) -> None:
        """Check the arguments and build the spaces."""
        whole = isinstance(n_worlds, int | np.integer) and not isinstance(n_worlds, bool)
        require(whole and n_worlds >= 1, "n_worlds", "an integer >= 1", n_worlds)
        keep_freed_memory()
        self.n_worlds = int(n_worlds)
        self._envs = [RendezvousEnv(scenario, **arguments) for _ in range(self.n_worlds)]
        first = self._envs[0]
        self.possible_agents, self.n_robots = first.possible_agents, len(first.possible_agents)
        self.base_scenario, self.scenario, self.layout = first.base_scenario, first.scenario, first.layout
        self.single_observation_space = first.observation_space("robot_0")
        self.single_action_space = first.action_space("robot_0")
        self.state_space = first.state_space
        self._last: list[Any] = []
        self._buffers = buffers

    def reset(
        self, seed: int | Sequence[int] | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[Any, Infos]:
        """Begin an episode in every world.

        Args:
            seed: Of world 0, those after it have the numbers that follow; or one for each world. Without
                one, the next episode of each world's sequence.
            options: Scenario fields for these episodes, the same for all; and ``reset_mask``, an array of
                bools, one a world: only these begin, the others go on (seeds are then for all worlds too).
        """
        given = dict(options or {})
        mask = given.pop(RESET_MASK, np.ones(self.n_worlds, dtype=bool))
        seeds = (
            [None] * self.n_worlds
            if seed is None
            else (
                [seed + k for k in range(self.n_worlds)] if isinstance(seed, int | np.integer) else list(seed)
            )
        )
        self._last = self._last or [None] * self.n_worlds
        for k in np.flatnonzero(mask).tolist():
            observations, infos = self._envs[k].reset(seed=seeds[k], options=given)
            off = dict.fromkeys(self.possible_agents, False)
            self._last[k] = (observations, dict.fromkeys(self.possible_agents, 0.0), off, off, infos)
        out = self._stacked()
        return out.observations, out.infos

    def step(self, actions: Shaped[np.ndarray, "worlds robots ..."]) -> VectorStep:
        """Advance every world that is not over by one iteration.

        Raises:
            ValueError: Actions of another shape, or not finite; names world and robot.
            RuntimeError: Before the first reset, or when all worlds are over.
        """
        if not self._last:
            raise NotResetError("reset() must be called before step()")
        if self.over.all():
            raise RuntimeError("all worlds are over: call reset() before step()")
        shape = (self.n_worlds, self.n_robots, *(self.single_action_space.shape or ()))
        require(np.shape(actions) == shape, "actions", f"of shape {shape}", np.shape(actions))
        for k, env in enumerate(self._envs):
            if env.agents:
                self._last[k] = env.step(dict(zip(self.possible_agents, actions[k], strict=True)))
            else:
                seen, rewards, *rest = self._last[k]
                self._last[k] = (seen, dict.fromkeys(rewards, 0.0), *rest)
        return self._stacked()

    @property
    def over(self) -> Bool[np.ndarray, " worlds"]:
        """Worlds whose episode is over."""
        return np.array([not env.agents for env in self._envs])

    def state(self) -> Float32[np.ndarray, "worlds numbers"]:
        """What is true and believed of each team, scaled: for a centralised critic."""
        return np.stack([env.state() for env in self._envs])

    def action_masks(self) -> Int8[np.ndarray, "worlds robots choices"]:
        """Choices that have an effect of their own."""
        return np.stack([env.action_masks() for env in self._envs])

    def tick_of(self, world: int) -> Tick:
        """State of one world, truth included: for evaluation and pictures, never for policies."""
        return self._envs[world].tick

    def world_of(self, world: int) -> World:
        """Room and obstacles of one world."""
        return self._envs[world].world

    def close(self) -> None:
        """Close the window."""
        for env in self._envs:
            env.close()

    def _stacked(self) -> VectorStep:
        """Results of all worlds as arrays."""
        columns = list(zip(*self._last, strict=True))
        seen = self._rows(columns[0])
        rewards, ended, cut = (self._rows(column) for column in columns[1:4])
        infos = {
            name: np.array([[info[a][name] for a in self.possible_agents] for info in columns[4]])
            for name in columns[4][0][self.possible_agents[0]]
        }
        return VectorStep(seen, rewards, ended, cut, infos)

    def _rows(self, each: Sequence[Mapping[str, Any]]) -> Any:
        first = each[0][self.possible_agents[0]]
        if isinstance(first, Mapping):
            return {
                name: np.array([[one[a][name] for a in self.possible_agents] for one in each])
                for name in first
            }
        return np.array([[one[a] for a in self.possible_agents] for one in each])


def vector_env(
    scenario: str | PathLike[str] | Scenario = "paper-hw-2", n_worlds: int = 64, **arguments: Any
) -> RendezvousVectorEnv:
    """Many worlds at once; arguments of `parallel_env`."""
    if "render_mode" in arguments and arguments["render_mode"] == "human":
        raise BadInputError("render_mode must be None or 'rgb_array' for many worlds, got 'human'")
    return RendezvousVectorEnv(scenario, n_worlds=n_worlds, **arguments)
