"""What one writes first: robots, boxes and lidar through pymunk's Python objects, ray by ray. A yardstick."""

from typing import Any

import numpy as np
import pymunk
from gymnasium import spaces
from pettingzoo import ParallelEnv

_BODY, _WALL = 0b01, 0b10


class NaiveEnv(ParallelEnv[str, Any, Any]):
    """Discs that drive among boxes and see them with a lidar; no radio, no graph.

    Args:
        n_agents: How many.
        n_boxes: Squares that stand in the room.
        n_rays: Rays of each lidar.
        size_m: Side of the room.
        n_substeps: Steps of the engine in one of the environment.
    """

    metadata: dict[str, Any] = {"name": "naive", "render_modes": []}  # noqa: RUF012 (gymnasium's convention)

    def __init__(
        self,
        n_agents: int = 50,
        *,
        n_boxes: int = 20,
        n_rays: int = 16,
        size_m: float = 60.0,
        n_substeps: int = 5,
    ) -> None:
        """Name the agents and build the spaces."""
        self.possible_agents = [f"robot_{i}" for i in range(n_agents)]
        self.agents: list[str] = []
        self._n_boxes, self._n_rays, self._size_m, self._n_substeps = n_boxes, n_rays, size_m, n_substeps
        self._observation = spaces.Box(-np.inf, np.inf, (4 + n_rays,), np.float32)
        self._action = spaces.Box(-1.0, 1.0, (2,), np.float32)

    def observation_space(self, agent: str) -> spaces.Space[Any]:
        """Position, velocity, lidar."""
        return self._observation

    def action_space(self, agent: str) -> spaces.Space[Any]:
        """Velocity, m/s."""
        return self._action

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Place boxes and robots at random."""
        rng, size = np.random.default_rng(seed), self._size_m
        self._space, self._steps = pymunk.Space(), 0
        corners = [(0.0, 0.0), (size, 0.0), (size, size), (0.0, size)]
        shapes: list[pymunk.Shape] = [
            pymunk.Segment(self._space.static_body, corners[k - 1], corners[k], 0.1) for k in range(4)
        ]
        for x, y in rng.uniform(3.0, size - 3.0, (self._n_boxes, 2)).tolist():
            box = [(x - 1.0, y - 1.0), (x + 1.0, y - 1.0), (x + 1.0, y + 1.0), (x - 1.0, y + 1.0)]
            shapes.append(pymunk.Poly(self._space.static_body, box))
        for shape in shapes:
            shape.filter = pymunk.ShapeFilter(categories=_WALL)
            self._space.add(shape)
        self._bodies = [
            self._robot(*place) for place in rng.uniform(1.0, size - 1.0, (len(self.possible_agents), 2))
        ]
        self.agents = list(self.possible_agents)
        return self._observations(), {agent: {} for agent in self.agents}

    def _robot(self, x_m: float, y_m: float) -> pymunk.Body:
        body = pymunk.Body(1.0, float("inf"))
        body.position = (float(x_m), float(y_m))
        hull = pymunk.Circle(body, 0.15)
        hull.filter = pymunk.ShapeFilter(categories=_BODY)
        self._space.add(body, hull)
        return body

    def step(self, actions: dict[str, Any]) -> tuple[dict[str, Any], ...]:
        """Drive for a second."""
        for agent, body in zip(self.agents, self._bodies, strict=True):
            body.velocity = tuple(actions[agent].tolist())
        for _ in range(self._n_substeps):
            self._space.step(1.0 / self._n_substeps)
        self._steps += 1
        agents, over = self.agents, self._steps >= 50
        self.agents = [] if over else agents
        return (
            self._observations(),
            dict.fromkeys(agents, 0.0),
            dict.fromkeys(agents, False),
            dict.fromkeys(agents, over),
            {agent: {} for agent in agents},
        )

    def _observations(self) -> dict[str, Any]:
        rows = (self._observe(body) for body in self._bodies)
        return dict(zip(self.possible_agents, rows, strict=True))

    def _observe(self, body: pymunk.Body) -> np.ndarray:
        """Rays see boxes and walls."""
        seen, (x, y) = pymunk.ShapeFilter(mask=_WALL), body.position
        row = [x, y, *body.velocity]
        for angle in (2.0 * np.pi / self._n_rays * np.arange(self._n_rays)).tolist():
            end = (x + 4.0 * np.cos(angle), y + 4.0 * np.sin(angle))
            hit = self._space.segment_query_first((x, y), end, 0.0, seen)
            row.append(1.0 if hit is None else hit.alpha)
        return np.array(row, dtype=np.float32)
