"""Many teams at once, each as one agent: what ``gymnasium.make_vec`` makes."""

from collections.abc import Mapping, Sequence
from os import PathLike
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from jaxtyping import Bool

from envs._autoreset import step_and_reset
from envs._rendezvous import RendezvousEnv
from envs._team_env import joined_actions, joined_boxes
from envs._vector import RESET_MASK, flat_vector_env
from envs._vector_results import Infos, VectorStep
from wifipgo.errors import require
from wifipgo.scenarios import Scenario

Step = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]


class RendezvousTeamVectorEnv(VectorEnv[np.ndarray, np.ndarray, np.ndarray]):
    """World k is `RendezvousTeamEnv` with the seed of world k, and infos are those of ``SyncVectorEnv``.

    Args:
        scenario: As in `RendezvousTeamEnv`.
        num_envs: Worlds.
        autoreset_mode: When a world that ended begins anew: in the same step, with its last observation as
            ``final_obs`` and its last info as ``final_info``; in the next step, whose action is ignored; or
            not by itself, but when its place in ``options["reset_mask"]`` says so.
        render_mode: None or "rgb_array".
        arguments: Others of `RendezvousTeamEnv`.

    Raises:
        ValueError: As `RendezvousTeamEnv`, and for another mode.
    """

    def __init__(
        self,
        scenario: str | PathLike[str] | Scenario = "paper-hw-2",
        *,
        num_envs: int = 1,
        autoreset_mode: AutoresetMode | str = AutoresetMode.SAME_STEP,
        render_mode: str | None = None,
        **arguments: Any,
    ) -> None:
        """Make the worlds, and join the spaces of their robots."""
        self._mode = AutoresetMode(autoreset_mode)
        self.robots = flat_vector_env(scenario, num_envs, whom="a team", render_mode=render_mode, **arguments)
        self.metadata = RendezvousEnv.metadata | {"autoreset_mode": self._mode}
        self.num_envs, self.render_mode = num_envs, render_mode
        n = self.robots.n_robots
        self.single_observation_space = joined_boxes([self.robots.single_observation_space] * n)
        self.single_action_space = joined_actions([self.robots.single_action_space] * n)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._ended = np.zeros(num_envs, dtype=bool)

    def __repr__(self) -> str:
        """What it is and where it stands."""
        return f"{type(self).__name__} of {self.robots!r}"

    def reset(
        self, *, seed: int | Sequence[int] | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Begin an episode in every world, or in those of ``options["reset_mask"]``."""
        seen, infos = self.robots.reset(seed=seed, options=options)  # may refuse the seed
        super().reset(seed=int(seed) if isinstance(seed, int | np.integer) else None)
        begun = np.asarray((options or {}).get(RESET_MASK, np.ones(self.num_envs, dtype=bool)))
        self._ended = self._ended & ~begun
        return self._rows(seen), self._infos(infos, begun)

    def step(self, actions: np.ndarray) -> Step:
        """Advance every world by one iteration.

        Raises:
            ValueError: Actions of another shape, or not finite.
            RuntimeError: Before the first reset; or without autoreset when all worlds are over.
        """
        shape = self.action_space.shape
        require(np.shape(actions) == shape, "actions", f"of shape {shape}", np.shape(actions))
        single = self.robots.single_action_space.shape or ()
        each = np.asarray(actions).reshape(self.num_envs, self.robots.n_robots, *single)
        if self._mode is AutoresetMode.SAME_STEP:
            return self._same_step(each)
        if self._mode is AutoresetMode.NEXT_STEP and self._ended.any():
            return self._next_step(each)
        return self._told(self.robots.step(each))

    def action_masks(self) -> Bool[np.ndarray, "worlds choices"]:
        """Choices of every robot of a world, one after the other, that have an effect of their own."""
        return self.robots.action_masks().reshape(self.num_envs, -1)

    def render(self) -> tuple[Any, ...]:
        """A picture of each world."""
        robots: Any = self.robots
        return tuple(robots.render(world) for world in range(self.num_envs))

    def close_extras(self, **arguments: Any) -> None:
        """Close the worlds."""
        self.robots.close()

    def _same_step(self, each: np.ndarray) -> Step:
        turn = step_and_reset(self.robots, each)
        if not turn.first_infos:
            return self._told(turn.step)
        told = self._told(turn.step._replace(infos=turn.first_infos))
        final = np.full(self.num_envs, None, dtype=object)
        for k, last in zip(np.flatnonzero(turn.ended).tolist(), turn.final_observations, strict=True):
            final[k] = last.ravel()
        final_info = self._infos(turn.step.infos, turn.ended, zeroed=True)
        told[-1].update(final_obs=final, _final_obs=turn.ended, final_info=final_info, _final_info=turn.ended)
        return told

    def _next_step(self, each: np.ndarray) -> Step:
        """Worlds that ended begin, whatever the action; the others go on."""
        begin = self._ended
        step = None if begin.all() else self.robots.step(each)
        seen, infos = self.robots.reset(options={RESET_MASK: begin})
        if step is None:
            off = np.zeros((self.num_envs, self.robots.n_robots), dtype=bool)
            return self._told(VectorStep(seen, np.zeros(off.shape), off, off, infos))
        on = ~begin[:, None]
        return self._told(
            VectorStep(seen, step.rewards * on, step.terminations & on, step.truncations & on, infos)
        )

    def _told(self, step: VectorStep) -> Step:
        """A step as gymnasium has it, of teams."""
        terminated, truncated = (np.asarray(f.any(axis=1)) for f in (step.terminations, step.truncations))
        self._ended = terminated | truncated
        infos = self._infos(step.infos, np.ones(self.num_envs, dtype=bool))
        return self._rows(step.observations), step.rewards.mean(axis=1), terminated, truncated, infos

    def _rows(self, seen: np.ndarray) -> np.ndarray:
        return seen.reshape(self.num_envs, -1)

    def _infos(
        self, infos: Infos, mask: Bool[np.ndarray, " worlds"], *, zeroed: bool = False
    ) -> dict[str, Any]:
        """Infos by robot and name, each beside the worlds that have it."""
        out: dict[str, Any] = {}
        for i, agent in enumerate(self.robots.possible_agents):
            mine: dict[str, Any] = {}
            for name, column in infos.items():
                mine[name], mine[f"_{name}"] = column[:, i], mask
                if zeroed:  # as gymnasium does where an entry is not there
                    mine[name] = np.zeros_like(column[:, i])
                    mine[name][mask] = column[mask, i]
            out[agent], out[f"_{agent}"] = mine, mask
        return out
