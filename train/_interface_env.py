"""The parallel environment as a network meets it, for learners that take environments and not rows."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium import spaces
from pettingzoo import ParallelEnv

from baselines.policies.learned.interfaces import make_interface
from envs.rendezvous_v0 import parallel_env
from wifipgo.scenarios import Scenario


class TranslatedEnv(ParallelEnv[str, Any, Any]):
    """Observations as the network is shown them, and its answers as actions.

    Args:
        scenario: As in `envs.rendezvous_v0.parallel_env`.
        interface: Name in `baselines.policies.learned.interfaces.INTERFACES`.
        arguments: Others of `parallel_env`.
    """

    metadata = parallel_env.metadata

    def __init__(self, scenario: str | Scenario, *, interface: str = "rays", **arguments: Any) -> None:
        """Make the environment, and the spaces of the interface."""
        self.env = parallel_env(scenario, **arguments)
        self.possible_agents, self.render_mode = self.env.possible_agents, self.env.render_mode
        self._interface = make_interface(interface, self.env.scenario)
        self._memory: Any = None
        choices = self._interface.n_choices
        shown = spaces.Box(-np.inf, np.inf, (self._interface.n_shown,), np.float32)
        self.observation_spaces = dict.fromkeys(self.possible_agents, shown)
        answers = spaces.MultiDiscrete(list(choices)) if choices else self.env.action_space("robot_0")
        self.action_spaces = dict.fromkeys(self.possible_agents, answers)

    def __repr__(self) -> str:
        """What it is and where it stands."""
        return f"{type(self).__name__} of {self.env!r}"

    @property
    def agents(self) -> list[str]:
        """Live agents."""
        return self.env.agents

    def observation_space(self, agent: str) -> spaces.Space[Any]:
        """The same object for all agents."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.Space[Any]:
        """The same object for all agents."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
        """Start an episode."""
        observations, infos = self.env.reset(seed=seed, options=options)
        self._memory = None
        return self._shown(observations), infos

    def step(self, actions: Mapping[str, Any]) -> tuple[Any, Any, Any, Any, Any]:
        """Advance every robot by one iteration."""
        agents = list(self._rows)
        answers = np.stack([actions[agent] for agent in agents])
        commands = self._interface.commands(answers, np.stack(list(self._rows.values())))
        outcome = self.env.step(dict(zip(agents, commands, strict=True)))
        return self._shown(outcome[0]), *outcome[1:]

    def render(self) -> Any:
        """What the environment draws."""
        return self.env.render()

    def close(self) -> None:
        """Close the environment."""
        self.env.close()

    def _shown(self, observations: dict[str, Any]) -> dict[str, Any]:
        self._rows, rows = observations, np.stack(list(observations.values()))
        self._memory = self._interface.remembered(rows, self._memory)
        shown = self._interface.shown(rows, self._memory)
        return dict(zip(observations, shown, strict=True))
