"""Many worlds behind the multi-agent vector interface of Isaac Lab (``DirectMARLEnv``), which skrl wraps.

Nothing of Isaac Lab is needed, since its users ask for names and not for a class:
``skrl.envs.wrappers.torch.wrap_env(RendezvousMarlEnv(...), wrapper="isaaclab-multi-agent")``.
"""

from collections.abc import Mapping
from os import PathLike
from typing import Any

import numpy as np
import torch

from envs.rendezvous_v0 import flat_vector_env, step_and_reset
from train._tensors import tensor_of
from wifipgo.errors import require
from wifipgo.scenarios import Scenario

ByAgent = dict[str, torch.Tensor]
Extras = dict[str, ByAgent]


class RendezvousMarlEnv:
    """Dicts by agent of tensors with one row a world; worlds that end begin anew in the same step.

    Args:
        scenario: As in `envs.rendezvous_v0.parallel_env`.
        num_envs: Worlds; world k is that environment with the seed of world k.
        device: Where tensors are wanted; worlds are stepped by the processor.
        arguments: Others of `envs.rendezvous_v0.vector_env`; observations are always flat.

    Raises:
        ValueError: As `vector_env`, and for ``observation`` other than "flat".
    """

    def __init__(
        self,
        scenario: str | PathLike[str] | Scenario = "paper-hw-2",
        *,
        num_envs: int = 64,
        device: Any = "cpu",
        **arguments: Any,
    ) -> None:
        """Make the worlds."""
        self.worlds = flat_vector_env(scenario, num_envs, whom="tensors", **arguments)
        self.num_envs, self.device = num_envs, torch.device(device)
        self.possible_agents = self.agents = list(self.worlds.possible_agents)
        self.observation_spaces = dict.fromkeys(self.agents, self.worlds.single_observation_space)
        self.action_spaces = dict.fromkeys(self.agents, self.worlds.single_action_space)
        self.state_space = self.worlds.state_space

    @property
    def unwrapped(self) -> "RendezvousMarlEnv":
        """The environment itself."""
        return self

    @property
    def num_agents(self) -> int:
        """Robots of a world."""
        return len(self.agents)

    max_num_agents = num_agents

    def reset(
        self, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[ByAgent, Extras]:
        """Begin an episode in every world: world k has the seed ``seed + k``."""
        seen, infos = self.worlds.reset(seed=seed, options=options)
        return self._by_agent(seen), self._extras(infos)

    def step(self, actions: Mapping[str, torch.Tensor]) -> tuple[ByAgent, ByAgent, ByAgent, ByAgent, Extras]:
        """Advance every world by one iteration.

        Returns:
            Observations, of new episodes where one began; rewards, terminations and truncations; infos of the
            step by agent, with ``final_observation`` where any world ended. All with one row a world.

        Raises:
            ValueError: An agent without an action, or actions of another shape or not finite.
        """
        require(set(self.agents) <= actions.keys(), "actions", f"of all of {self.agents}", list(actions))
        rows = [actions[agent].detach().cpu().numpy() for agent in self.agents]
        shape = self.worlds.single_action_space.shape or ()
        turn = step_and_reset(self.worlds, np.stack([row.reshape(-1, *shape) for row in rows], axis=1))
        seen, rewards, terminations, truncations, infos = turn.step
        if turn.first_infos:
            last = seen.copy()
            last[turn.ended] = turn.final_observations
            infos = infos | {"final_observation": last}
        ended, cut = self._by_agent(terminations), self._by_agent(truncations)
        return self._by_agent(seen), self._by_agent(rewards), ended, cut, self._extras(infos)

    def state(self) -> torch.Tensor:
        """What is true and believed of each team, for a centralised critic."""
        return tensor_of(self.worlds.state(), self.device)

    def render(self, world: int = 0) -> Any:
        """A picture of one world."""
        worlds: Any = self.worlds
        return worlds.render(world)

    def close(self) -> None:
        """Close the worlds."""
        self.worlds.close()

    def _by_agent(self, x: np.ndarray) -> ByAgent:
        return {agent: tensor_of(x[:, i], self.device) for i, agent in enumerate(self.agents)}

    def _extras(self, infos: Mapping[str, np.ndarray]) -> Extras:
        columns = {name: self._by_agent(column) for name, column in infos.items()}
        return {agent: {name: column[agent] for name, column in columns.items()} for agent in self.agents}
