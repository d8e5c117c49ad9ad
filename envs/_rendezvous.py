"""The ParallelEnv: dicts and arrays, the clock, the agents. Everything else is below."""

from collections.abc import Mapping
from functools import partial
from os import PathLike
from typing import Any

import numpy as np
from gymnasium import logger, spaces
from gymnasium.utils import EzPickle
from jaxtyping import Bool
from pettingzoo import ParallelEnv

from envs import _observation
from envs._actions import ACTION_FORMS, checked_rows
from envs._episode import Episode
from envs._infos import infos
from envs._reward import REWARDS, Outcome
from envs._state import state, state_space
from envs.directions import N_CHOICES
from envs.render.config import DEFAULT_HEIGHT_PX, RENDER_MODES, RenderConfig, check_render_mode
from wifipgo.arithmetic import plain_arithmetic
from wifipgo.errors import BadInputError, pick, require
from wifipgo.scenarios import Scenario, field_owners, scenario_named
from wifipgo.state import Tick, World
from wifipgo.world.map_accuracy import MapAccuracy, first_map_accuracy, updated_map_accuracy

OBSERVATIONS: Mapping[str, str] = {
    "flat": "one Box",
    "dict": "the same blocks by name; with discrete actions the pair of observation and action_mask",
}
# Fields that decide the spaces or the length of an episode: fixed when an environment is made.
_FIXED = ("n_robots", "n_slots", "n_steps", "n_azimuths", "max_measurements")
# PettingZoo's own conformance test resets with ``options={"options": 1}``.
_IGNORED_OPTIONS = ("options",)
_ARGUMENTS = (
    *("actions", "max_cycles", "observation", "render_height_px", "render_mode", "reward", "scenario"),
    "terminate_at_end",
)
# Key, beside an episode's number, of the chance that wrappers draw from: no stream of the episode has it.
_WRAPPERS_KEY = 0x3A9


class NotResetError(AttributeError, RuntimeError):
    """Something of an episode was asked for before there is one; so ``hasattr`` says no."""


class RendezvousEnv(ParallelEnv[str, Any, Any], EzPickle):
    """Robots explore, lose their way, call each other over Wi-Fi and meet.

    Args:
        scenario: Name in `wifipgo.scenarios.SCENARIOS`, a file that ends in ``.toml``, or a `Scenario`.
        observation: "flat" (one Box) or "dict" (the same blocks by name; with discrete actions the pair
            ``{"observation": flat, "action_mask": mask}`` of PettingZoo's convention).
        actions: "continuous" (a waypoint and a request) or "discrete" (one of 34, see `envs.directions`).
        reward: Name in `envs.rendezvous_v0.REWARDS`; the default is what the mapped share grew by.
        render_mode: None, "rgb_array" or "human" (a window, drawn at each reset and step).
        render_height_px: Height of the pictures, a multiple of 16.
        max_cycles: PettingZoo's name for the scenario's ``n_steps``.
        terminate_at_end: Report the end by the clock as a termination, for learners that know no other.
        overrides: Any field of the scenario, e.g. ``n_obstacles=4``.

    Raises:
        ValueError: An unknown scenario, field, observation, form of actions, reward or render mode; lists
            what exists.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012 (gymnasium's convention)
        "name": "rendezvous_v0",
        "render_modes": list(RENDER_MODES),
        "is_parallelizable": True,
        "render_fps": 5,
    }

    def __init__(
        self,
        scenario: str | PathLike[str] | Scenario = "paper-hw-2",
        *,
        observation: str = "flat",
        actions: str = "continuous",
        reward: str = "mapped_share_truth",
        render_mode: str | None = None,
        render_height_px: int = DEFAULT_HEIGHT_PX,
        max_cycles: int | None = None,
        terminate_at_end: bool = False,
        **overrides: Any,
    ) -> None:
        """Check the arguments and build the spaces."""
        for name in overrides:
            pick({**dict.fromkeys(_ARGUMENTS), **field_owners()}, name, "scenario field")
        if max_cycles is not None:
            require(
                "n_steps" not in overrides, "max_cycles", "given without n_steps, its other name", max_cycles
            )
            overrides["n_steps"] = max_cycles
        # The value, not its name: a file may have changed when the copy is made.
        base = scenario if isinstance(scenario, Scenario) else scenario_named(scenario)
        EzPickle.__init__(
            self,
            base,
            observation=observation,
            actions=actions,
            reward=reward,
            render_mode=render_mode,
            render_height_px=render_height_px,
            terminate_at_end=terminate_at_end,
            **overrides,
        )
        pick(OBSERVATIONS, observation, "observation")
        require(isinstance(terminate_at_end, bool), "terminate_at_end", "True or False", terminate_at_end)
        if render_mode is not None:
            check_render_mode(render_mode)
        self.base_scenario = self.scenario = base.with_overrides(**overrides)
        self.render_mode, self._render_config = render_mode, RenderConfig(height_px=render_height_px)
        self._screen: Any = None  # holds pygame's objects from the first picture on
        self.layout = _observation.layout(self.scenario)
        self.possible_agents = [f"robot_{i}" for i in range(self.scenario.n_robots)]
        self.agents: list[str] = []
        self._as_dict, self._reward = observation == "dict", pick(REWARDS, reward, "reward")
        self._form, self._terminates = pick(ACTION_FORMS, actions, "form of actions"), terminate_at_end
        n_choices = N_CHOICES if self._form.masks else 0
        make = partial(_observation.space_of, self.layout, as_dict=self._as_dict, n_choices=n_choices)
        self.observation_spaces = {a: make() for a in self.possible_agents}
        self.action_spaces: dict[str, Any] = {a: self._form.space() for a in self.possible_agents}
        self.state_space = state_space(self.scenario.n_robots)
        self._np_random: np.random.Generator | None = None
        self._episode: Episode | None = None

    def observation_space(self, agent: str) -> spaces.Space[Any]:
        """The same object for an agent each time."""
        return pick(self.observation_spaces, agent, "agent")

    def action_space(self, agent: str) -> spaces.Space[Any]:
        """Waypoint in the body frame, in step lengths, and a request: > 0 calls; or a number of 34."""
        return pick(self.action_spaces, agent, "agent")

    @property
    def tick(self) -> Tick:
        """State of the episode, truth included: for evaluation and pictures, never for policies."""
        return self._now.tick

    @property
    def world(self) -> World:
        """Room and obstacles of the episode, for evaluation and pictures."""
        return self._now.world

    @property
    def _now(self) -> Episode:
        if self._episode is None:
            raise NotResetError("reset() must be called before the episode is looked at or stepped")
        return self._episode

    @property
    def np_random(self) -> np.random.Generator:
        """Chance for wrappers; each reset keys it anew, and what is drawn leaves the episode as it is."""
        if self._np_random is None:
            self._np_random = np.random.default_rng(np.random.SeedSequence())
        return self._np_random

    @plain_arithmetic
    def reset(
        self, seed: int | np.integer[Any] | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
        """Start an episode; a seed starts its sequence of episodes anew.

        Args:
            seed: Root of all chance. Without one the next episode of the sequence follows.
            options: Scenario fields for this episode only, e.g. ``{"n_obstacles": 4}``; the next reset
                starts from the scenario that the environment was made with.

        Raises:
            ValueError: A seed that is no integer >= 0, an option that does not exist or that would change the
                spaces, or a room that cannot be laid out. The episode before goes on.
        """
        scenario = self.base_scenario.with_overrides(**_changes(options))
        now = Episode.begun(scenario, self._next_episode(seed))
        mapped = _first_map(now.tick)
        out = self._seen_and_said(now, mapped.share)
        key = np.random.SeedSequence(now.seed[0], spawn_key=(now.seed[1], _WRAPPERS_KEY))
        if self.render_mode == "human":
            self._picture(now)
        # At once and last, so that what is refused or interrupted leaves the episode before.
        self._episode, self._mapped, self.scenario = now, mapped, scenario
        self.agents, self._np_random = list(self.possible_agents), np.random.default_rng(key)
        return out

    @plain_arithmetic
    def step(
        self, actions: Mapping[str, Any]
    ) -> tuple[dict[str, Any], dict[str, float], dict[str, bool], dict[str, bool], dict[str, dict[str, Any]]]:
        """Advance every robot by one iteration of the paper's loop.

        Whatever exception leaves it, Ctrl-C too, the episode is as it was before, to the bit: the same step
        can be taken again. That one then repeats the iterations so far.

        Raises:
            ValueError: An action is missing, for an unknown agent, of another shape or not finite.
            RuntimeError: Before the first reset or after the end.
        """
        before, agents = self._now, self.agents
        if not agents:
            raise RuntimeError("the episode is over: call reset() before step()")
        rows = self.checked(actions, agents)
        now = before.advanced(self._form.commands(rows, before.tick.belief, before.scenario))
        mapped = _updated_map(self._mapped, before.tick, now.tick)
        outcome = Outcome(before.tick.belief, now.tick.belief, mapped.share - self._mapped.share)
        full = self.scenario.max_measurements
        done = bool(full) and int(now.tick.belief.log.edges.between_robots.sum()) >= full
        late = now.tick.belief.t >= self.scenario.n_steps
        ends = done or (late and self._terminates)
        observations, said = self._seen_and_said(now, mapped.share)
        out = (
            observations,
            dict(zip(agents, self._reward(outcome, self.scenario).tolist(), strict=True)),
            dict.fromkeys(agents, ends),
            dict.fromkeys(agents, late and not ends),
            said,
        )
        if self.render_mode == "human":
            self._picture(now)
        self._episode, self._mapped, self.agents = now, mapped, [] if done or late else agents
        return out

    def checked(self, actions: Mapping[str, Any], agents: list[str]) -> np.ndarray:
        """Actions of some agents as an array, clipped to their space; refused as by `step`."""
        return checked_rows(self._form, actions, agents)

    def action_masks(self) -> Bool[np.ndarray, "robots choices"]:
        """Choices that have an effect of their own, one row a robot.

        Raises:
            ValueError: The actions are continuous.
            RuntimeError: Before the first reset.
        """
        if self._form.masks is None:
            raise BadInputError("actions must be 'discrete' for masks, got 'continuous'")
        return self._form.masks(self.tick.belief, self.scenario).astype(bool)

    @plain_arithmetic
    def state(self) -> np.ndarray:
        """What is true and believed of the whole team, scaled: for a centralised critic."""
        return state(self.tick, self.scenario)

    @plain_arithmetic
    def render(self) -> np.ndarray | None:
        """Draw where the episode stands: an array in mode "rgb_array", the window in mode "human"."""
        if self.render_mode is None:
            logger.warn(
                "render() draws nothing without a render_mode, e.g. parallel_env(render_mode='human')"
            )
            return None
        return self._picture(self._now)

    def _picture(self, now: Episode) -> np.ndarray | None:
        """Where an episode stands, on the screen that the first picture opens."""
        if self._screen is None and self.render_mode is not None:
            from envs.render.screen import screen_for  # noqa: PLC0415 (pygame loads with the first picture)

            self._screen = screen_for(self.render_mode, self._render_config, self.metadata["render_fps"])
        picture: np.ndarray | None = self._screen.show(now.tick, now.world, now.scenario)
        return picture

    def close(self) -> None:
        """Close the window; a later `render` opens another."""
        if self._screen is not None:
            self._screen.close()
            self._screen = None

    def _next_episode(self, seed: int | np.integer[Any] | None) -> tuple[int, int]:
        """Root of all chance, and the number of the episode under it."""
        if seed is not None:
            whole = isinstance(seed, int | np.integer) and not isinstance(seed, bool)
            require(whole and seed >= 0, "seed", "None or an integer >= 0", seed)
            return int(seed), 0
        if self._episode is not None:
            entropy, number = self._episode.seed
            return entropy, number + 1
        root = np.random.SeedSequence().entropy
        return root if isinstance(root, int) else 0, 0

    def _seen_and_said(
        self, now: Episode, mapped_share: float
    ) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
        """Observations and infos of all agents."""
        belief, agents, form = now.tick.belief, self.possible_agents, self._form
        masks = form.masks(belief, now.scenario) if form.masks else None
        rows = _observation.observe(belief, now.scenario)
        seen = _observation.by_agent(rows, agents, self.layout if self._as_dict else None, masks)
        return seen, infos(now.tick, agents, mapped_share=mapped_share, masks=masks)


def _first_map(tick: Tick) -> MapAccuracy:
    """Map of the team beside the truth."""
    return first_map_accuracy(tick.truth.cells, tick.truth.poses, tick.belief.paths.estimate)


def _updated_map(mapped: MapAccuracy, before: Tick, after: Tick) -> MapAccuracy:
    """The same after an iteration."""
    truth, estimate = after.truth, after.belief.paths.estimate
    return updated_map_accuracy(mapped, truth.cells, truth.poses, before.belief.paths.estimate, estimate)


def _changes(options: Mapping[str, Any] | None) -> dict[str, Any]:
    """Scenario fields that reset options change."""
    require(options is None or isinstance(options, Mapping), "options", "None or a mapping", options)
    changes = {name: value for name, value in (options or {}).items() if name not in _IGNORED_OPTIONS}
    for name, value in changes.items():
        require(isinstance(name, str), "options", "a mapping from names of scenario fields", options)
        require(name not in _FIXED, f"options[{name!r}]", "set when the environment is made", value)
    return changes
