"""A team task of which every number is known: a reward a step until the clock or the task ends it."""

from typing import Any

import numpy as np
from gymnasium import spaces
from pettingzoo import ParallelEnv


class ToyTeam(ParallelEnv[str, Any, Any]):
    """Two agents; observation [steps done, number of the agent, a draw of the episode].

    Args:
        n_steps: Length of an episode.
        by: "truncation" or "termination": how it ends.
        blind: Observations are all zero, so that every state has the same value.
        fails_at: Step at which it raises.
        agents: How many.
    """

    metadata: dict[str, Any] = {"name": "toy", "render_modes": ["rgb_array"]}  # noqa: RUF012

    def __init__(
        self,
        n_steps: int = 5,
        *,
        by: str = "truncation",
        blind: bool = False,
        fails_at: int = -1,
        agents: int = 2,
        render_mode: str | None = None,
    ) -> None:
        """Keep the arguments."""
        self.n_steps, self.by, self.blind, self.fails_at = n_steps, by, blind, fails_at
        self.render_mode = render_mode
        self.possible_agents = [f"a{i}" for i in range(agents)]
        self.agents: list[str] = []
        self.space = spaces.Box(-1e9, 1e9, (3,), np.float32)
        self.moves = spaces.Box(-1.0, 1.0, (1,), np.float32)
        self.calls: list[str] = []
        self.options: dict[str, Any] = {}
        self.rng = np.random.default_rng(0)

    def observation_space(self, agent: str) -> spaces.Box:
        """The same for all."""
        return self.space

    def action_space(self, agent: str) -> spaces.Box:
        """The same for all."""
        return self.moves

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, Any]:
        """A draw tells episodes apart."""
        if seed is not None:
            self.rng = np.random.default_rng(seed)
        self.options = options or {}
        self.t, self.draw = 0, float(np.float32(self.rng.random()))
        self.agents = list(self.possible_agents)
        return self.seen(), {a: {"draw": self.draw} for a in self.agents}

    def seen(self) -> dict[str, np.ndarray]:
        """Observations now."""
        rows = {
            a: np.array([self.t, i, self.draw], np.float32) * (not self.blind)
            for i, a in enumerate(self.possible_agents)
        }
        return {a: row.astype(np.float32) for a, row in rows.items()}

    def step(self, actions: dict[str, np.ndarray]) -> tuple[Any, Any, Any, Any, Any]:
        """One tick of the clock."""
        self.t += 1
        if self.t == self.fails_at:
            raise ZeroDivisionError("the toy broke")
        over, agents = self.t >= self.n_steps, self.agents
        self.agents = [] if over else agents
        return (
            self.seen(),
            {a: 1.0 + i for i, a in enumerate(agents)} if not self.blind else dict.fromkeys(agents, 1.0),
            dict.fromkeys(agents, over and self.by == "termination"),
            dict.fromkeys(agents, over and self.by == "truncation"),
            {a: {"t": self.t} for a in agents},
        )

    def note(self, what: str) -> int:
        """Keep a word."""
        self.calls.append(what)
        return len(self.calls)

    def forget(self) -> None:
        """Lose all words."""
        self.calls = []

    def render(self) -> np.ndarray:
        """A picture in the shade of the step."""
        return np.full((4, 4, 3), self.t, np.uint8)
