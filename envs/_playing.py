"""What the environment of one world and that of many have in common: settings, and a step as a function."""

from dataclasses import dataclass
from os import PathLike
from typing import Any, NamedTuple

import numpy as np
from gymnasium import spaces
from jaxtyping import Bool, Float, Float32, Int8

from envs._actions import ACTION_FORMS, ActionForm, Rows
from envs._arguments import scenario_fields
from envs._episode import Episode
from envs._infos import Columns, info_columns
from envs._observation import Field, layout, observe
from envs._reward import REWARDS, Outcome, Reward
from envs._spaces import space_of
from envs._state import state_space
from envs.directions import N_CHOICES
from envs.render.config import check_render_mode
from wifipgo.errors import pick, require
from wifipgo.scenarios import Scenario, scenario_named

OBSERVATIONS = {
    "flat": "one Box",
    "dict": "the same blocks by name; with discrete actions the pair of observation and action_mask",
}
_ARGUMENTS = (
    *("actions", "max_cycles", "observation", "render_height_px", "render_mode", "reward", "scenario"),
    "terminate_at_end",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """What an environment was made with.

    Attributes:
        scenario: What is played, before options of a reset.
        layout: Blocks of the flat observation.
        as_dict: Whether observations are dicts.
        form: How actions are written.
        reward: Of an iteration.
        terminates: Whether the end by the clock is a termination.
    """

    scenario: Scenario
    layout: tuple[Field, ...]
    as_dict: bool
    form: ActionForm
    reward: Reward
    terminates: bool

    @property
    def agents(self) -> list[str]:
        """Names of the robots of a world."""
        return [f"robot_{i}" for i in range(self.scenario.n_robots)]

    @property
    def state_space(self) -> spaces.Box:
        """Space of the state of one world."""
        return state_space(self.scenario.n_robots)

    def observation_space(self) -> spaces.Space[Any]:
        """A new space of the observations of one robot."""
        choices = N_CHOICES if self.form.masks else 0
        return space_of(self.layout, as_dict=self.as_dict, n_choices=choices)


def settings_of(
    scenario: str | PathLike[str] | Scenario,
    *,
    observation: str = "flat",
    actions: str = "continuous",
    reward: str = "mapped_share_truth",
    render_mode: str | None = None,
    max_cycles: int | None = None,
    terminate_at_end: bool = False,
    **overrides: Any,
) -> Settings:
    """Check the arguments of an environment; see `envs.rendezvous_v0.parallel_env`.

    Raises:
        ValueError: An unknown scenario, field, observation, form of actions, reward or render mode; lists
            what exists.
    """
    overrides = scenario_fields(overrides, max_cycles, _ARGUMENTS)
    # The value, not its name: a file may have changed when a copy is made.
    base = scenario if isinstance(scenario, Scenario) else scenario_named(scenario)
    pick(OBSERVATIONS, observation, "observation")
    require(isinstance(terminate_at_end, bool), "terminate_at_end", "True or False", terminate_at_end)
    if render_mode is not None:
        check_render_mode(render_mode)
    played = base.with_overrides(**overrides)
    return Settings(
        scenario=played,
        layout=layout(played),
        as_dict=observation == "dict",
        form=pick(ACTION_FORMS, actions, "form of actions"),
        reward=pick(REWARDS, reward, "reward"),
        terminates=terminate_at_end,
    )


class Shown(NamedTuple):
    """What is seen and said of an episode, by row.

    Attributes:
        observations: Flat ones.
        masks: Of choices, where actions are choices.
        infos: By name.
    """

    observations: Float32[np.ndarray, "robots numbers"]
    masks: Int8[np.ndarray, "robots choices"] | None
    infos: Columns


class Played(NamedTuple):
    """An episode after a step, and what it brought.

    Attributes:
        episode: One iteration on.
        rewards: Of each robot of each world.
        ended: Worlds whose task ended.
        cut: Worlds whose time is up.
    """

    episode: Episode
    rewards: Float[np.ndarray, " robots"]
    ended: Bool[np.ndarray, " worlds"]
    cut: Bool[np.ndarray, " worlds"]


def shown(now: Episode, settings: Settings) -> Shown:
    """Observations and infos of all robots."""
    belief, form = now.tick.belief, settings.form
    masks = form.masks(belief, now.scenario) if form.masks else None
    said = info_columns(now.tick, now.rows, mapped_share=now.map_accuracy.share, masks=masks)
    return Shown(observe(belief, now.scenario), masks, said)


def played(before: Episode, actions: Rows, settings: Settings) -> Played:
    """One iteration of all worlds by actions that were checked, one row a robot."""
    now = before.advanced(settings.form.commands(actions, before.tick.belief, before.scenario))
    gain = now.map_accuracy.share - before.map_accuracy.share
    outcome = Outcome(before.tick.belief, now.tick.belief, gain, now.rows)
    ended = now.is_complete | (now.is_late and settings.terminates)
    return Played(now, settings.reward(outcome, now.scenario), ended, now.is_late & ~ended)
