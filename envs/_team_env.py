"""The team as one agent: a gymnasium environment for a central controller."""

from collections.abc import Mapping
from os import PathLike
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.utils import EzPickle
from jaxtyping import Bool, Float, Real

from envs._rendezvous import RendezvousEnv
from wifipgo.errors import require
from wifipgo.scenarios import Scenario


class RendezvousTeamEnv(gymnasium.Env[np.ndarray, np.ndarray], EzPickle):
    """One controller sees what all robots observe and drives all of them.

    Observation and action are those of the robots, concatenated in the order of `agents`; with
    ``actions="discrete"`` one choice a robot. The reward is the *mean* over the robots: a reward that the
    team shares stays what it is, and the scale does not grow with the team. The info holds each robot's
    info under its name.

    Args:
        scenario: As in `RendezvousEnv`.
        render_mode: As in `RendezvousEnv`.
        arguments: Others of `RendezvousEnv`; observations are always flat.

    Raises:
        ValueError: As `RendezvousEnv`, and for ``observation`` other than "flat".
    """

    metadata = RendezvousEnv.metadata

    def __init__(
        self,
        scenario: str | PathLike[str] | Scenario = "paper-hw-2",
        *,
        render_mode: str | None = None,
        **arguments: Any,
    ) -> None:
        """Make the environment of the robots, and join their spaces."""
        EzPickle.__init__(self, scenario, render_mode=render_mode, **arguments)
        observation = arguments.pop("observation", "flat")
        require(observation == "flat", "observation", "'flat' for a team", observation)
        self.robots = RendezvousEnv(scenario, render_mode=render_mode, **arguments)
        self.render_mode = render_mode
        self.agents = tuple(self.robots.possible_agents)
        self.observation_space = joined_boxes([self.robots.observation_space(a) for a in self.agents])
        self.action_space = joined_actions([self.robots.action_space(a) for a in self.agents])

    def __repr__(self) -> str:
        """What it is and where it stands."""
        return f"{type(self).__name__} of {self.robots!r}"

    def reset(
        self, *, seed: int | np.integer[Any] | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[Float[np.ndarray, " numbers"], dict[str, Any]]:
        """Start an episode, as in `RendezvousEnv.reset`."""
        observations, infos = self.robots.reset(seed=seed, options=options)  # may refuse the seed
        super().reset(seed=None if seed is None else int(seed))
        return np.concatenate(list(observations.values())), infos

    def step(
        self, action: Real[np.ndarray, " moves"]
    ) -> tuple[Float[np.ndarray, " numbers"], float, bool, bool, dict[str, Any]]:
        """Advance the team by one iteration.

        Raises:
            ValueError: The action has another shape or is not finite.
            RuntimeError: Before the first reset or after the end.
        """
        try:
            shape: Any = np.shape(action)
        except ValueError:
            shape = "parts of different lengths"
        require(shape == self.action_space.shape, "action", f"of shape {self.action_space.shape}", shape)
        each = np.split(np.asarray(action), len(self.agents))
        observations, rewards, ended, cut, infos = self.robots.step(dict(zip(self.agents, each, strict=True)))
        return (
            np.concatenate(list(observations.values())),
            float(np.mean(list(rewards.values()))),
            any(ended.values()),
            any(cut.values()),
            infos,
        )

    def action_masks(self) -> Bool[np.ndarray, " choices"]:
        """Choices of every robot, one after the other, that have an effect of their own."""
        return self.robots.action_masks().ravel()

    def render(self) -> Any:
        """The picture that the robots' environment draws."""
        return self.robots.render()

    def close(self) -> None:
        """Close the robots' environment."""
        self.robots.close()


def joined_actions(each: list[spaces.Space[Any]]) -> spaces.Box | spaces.MultiDiscrete:
    """Actions of all robots, or one choice a robot."""
    if isinstance(each[0], spaces.Discrete):
        return spaces.MultiDiscrete([int(space.n) for space in each if isinstance(space, spaces.Discrete)])
    return joined_boxes(each)


def joined_boxes(boxes: list[spaces.Space[Any]]) -> spaces.Box:
    """One box after the other."""
    flat = [box for box in boxes if isinstance(box, spaces.Box)]
    low, high = (np.concatenate([getattr(box, side) for box in flat]) for side in ("low", "high"))
    return spaces.Box(low, high, dtype=np.float32)
