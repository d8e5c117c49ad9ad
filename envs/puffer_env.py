"""Many worlds as one environment of PufferLib: flat rows, results written into its buffers in place.

With ``pufferlib`` installed it is one of its native environments, for
``pufferlib.vector.make(RendezvousPufferEnv, backend=pufferlib.PufferEnv)``; without, it has the same names.
"""

from os import PathLike
from typing import Any

import numpy as np
from gymnasium import spaces

from envs._autoreset import step_and_reset
from envs._vector import flat_vector_env
from wifipgo.scenarios import Scenario

try:
    from pufferlib import PufferEnv
except ImportError:
    PufferEnv = object

Step = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, list[dict[str, float]]]


class RendezvousPufferEnv(PufferEnv):
    """Row ``k * n_robots + i`` is robot i of world k; worlds that end begin anew in the same step.

    Args:
        scenario: As in `envs.rendezvous_v0.parallel_env`.
        num_worlds: Worlds of this process; world k has the seed of `reset` plus k.
        buf: Arrays of PufferLib's that results are written into, by name.
        seed: Of the first reset, if that names none.
        arguments: Others of `envs.rendezvous_v0.vector_env`; observations are always flat.

    Raises:
        ValueError: As `vector_env`, and for ``observation`` other than "flat".
    """

    def __init__(
        self,
        scenario: str | PathLike[str] | Scenario = "paper-hw-2",
        *,
        num_worlds: int = 64,
        buf: Any = None,
        seed: int | None = None,
        **arguments: Any,
    ) -> None:
        """Make the worlds, then the buffers."""
        self.worlds = flat_vector_env(scenario, num_worlds, whom="rows", **arguments)
        self.single_observation_space = self.worlds.single_observation_space
        self.single_action_space = self.worlds.single_action_space
        self.num_agents = num_worlds * self.worlds.n_robots
        self._seed, self._returns = seed, np.zeros(num_worlds)
        if PufferEnv is not object:
            super().__init__(buf)
        else:
            _set_buffers(self, buf or {})

    def __repr__(self) -> str:
        """What it is and where it stands."""
        return f"{type(self).__name__} of {self.worlds!r}"

    def reset(self, seed: int | None = None) -> tuple[np.ndarray, list[dict[str, float]]]:
        """Begin an episode in every world."""
        seen, _ = self.worlds.reset(seed=self._seed if seed is None else seed)
        self._seed = None
        self.observations[:] = self._rows(seen)
        for flat in (self._returns, self.rewards, self.terminals, self.truncations):
            flat[:] = 0
        return self.observations, []

    def step(self, actions: np.ndarray) -> Step:
        """Advance every world by one iteration; where any ended, one info has the means of their episodes."""
        shape = self.single_action_space.shape or ()
        each = np.asarray(actions).reshape(self.worlds.n_worlds, self.worlds.n_robots, *shape)
        turn = step_and_reset(self.worlds, each)
        self.observations[:] = self._rows(turn.step.observations)
        self.rewards[:] = turn.step.rewards.ravel()
        self.terminals[:] = turn.step.terminations.ravel()
        self.truncations[:] = turn.step.truncations.ravel()
        self._returns += turn.step.rewards.mean(axis=1)
        told = [self._episodes(turn.ended, turn.step.infos)] if turn.first_infos else []
        self._returns[turn.ended] = 0.0
        return self.observations, self.rewards, self.terminals, self.truncations, told

    def close(self) -> None:
        """Close the worlds."""
        self.worlds.close()

    def _rows(self, seen: np.ndarray) -> np.ndarray:
        return seen.reshape(self.num_agents, -1)

    def _episodes(self, ended: np.ndarray, infos: dict[str, np.ndarray]) -> dict[str, float]:
        """Means over worlds that ended, and over their robots."""
        told = {"episode_return": float(self._returns[ended].mean())}
        names = [name for name, column in infos.items() if column.ndim == 2]
        return told | {name: float(infos[name][ended].mean()) for name in names}


def _set_buffers(env: Any, buf: Any) -> None:
    """Buffers as PufferLib's own class makes them, or takes them from its caller."""
    n, space, moves = env.num_agents, env.single_observation_space, env.single_action_space
    chosen = isinstance(moves, spaces.Discrete)
    made = {
        "observations": np.zeros((n, *space.shape), space.dtype),
        "rewards": np.zeros(n, np.float32),
        "terminals": np.zeros(n, dtype=bool),
        "truncations": np.zeros(n, dtype=bool),
        "masks": np.ones(n, dtype=bool),
        "actions": np.zeros((n, *moves.shape), np.int32 if chosen else np.float32),
    }
    for name, buffer in made.items():
        setattr(env, name, buf.get(name, buffer))
