"""The ParallelEnv: dicts and arrays, the clock, the agents. Everything else is below."""

from collections.abc import Mapping
from os import PathLike
from typing import Any

import numpy as np
from gymnasium import logger, spaces
from gymnasium.utils import EzPickle
from jaxtyping import Bool
from pettingzoo import ParallelEnv

from envs._actions import checked_rows
from envs._arguments import NotResetError, changes_of, next_seed
from envs._episode import Episode
from envs._infos import by_agent as infos_by_agent
from envs._playing import played, settings_of, shown
from envs._snapshot import FORMAT, EpisodeSnapshot, blocks_of, check_snapshot
from envs._spaces import by_agent
from envs._standing import standing
from envs._state import state
from envs.render.config import DEFAULT_HEIGHT_PX, RENDER_MODES, RenderConfig
from wifipgo.arithmetic import plain_arithmetic
from wifipgo.errors import BadInputError, pick
from wifipgo.scenarios import Scenario
from wifipgo.state import Tick, World

# Key, beside an episode's number, of the chance that wrappers draw from: no stream of the episode has it.
_WRAPPERS_KEY = 0x3A9


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

    _np_random: np.random.Generator | None = None
    _episode: Episode | None = None

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
        written: dict[str, Any] = {"observation": observation, "actions": actions, "reward": reward}
        written |= {"render_mode": render_mode, "terminate_at_end": terminate_at_end}
        self._settings = settings_of(scenario, max_cycles=max_cycles, **written, **overrides)
        self.base_scenario = self.scenario = self._settings.scenario
        # The value, not its name: a file may have changed when the copy is made.
        EzPickle.__init__(self, self.base_scenario, render_height_px=render_height_px, **written)
        self.render_mode, self._render_config = render_mode, RenderConfig(height_px=render_height_px)
        self._screen: Any = None  # holds pygame's objects from the first picture on
        self.layout, self.possible_agents = self._settings.layout, self._settings.agents
        self.agents: list[str] = []
        # A space of its own for each robot: they are seeded one by one.
        self.observation_spaces = {a: self._settings.observation_space() for a in self.possible_agents}
        self.action_spaces: dict[str, Any] = {a: self._settings.form.space() for a in self.possible_agents}
        self.state_space = self._settings.state_space

    def __repr__(self) -> str:
        """What it is and where it stands."""
        return f"RendezvousEnv({standing(self.scenario, [self._episode] if self._episode else [])})"

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
        scenario = self.base_scenario.with_overrides(**changes_of(options))
        before = self._episode.seeds[0] if self._episode is not None else None
        root, number = next_seed(seed, before)
        now = Episode.begun(scenario, [(root, number)])
        out = self._seen_and_said(now)
        key = np.random.SeedSequence(root, spawn_key=(number, _WRAPPERS_KEY))
        if self.render_mode == "human":
            self._picture(now)
        # At once and last, so that what is refused or interrupted leaves the episode before.
        self._episode, self.scenario = now, scenario
        self.agents, self._np_random = list(self.possible_agents), np.random.default_rng(key)
        return out

    @plain_arithmetic
    def step(
        self, actions: Mapping[str, Any]
    ) -> tuple[dict[str, Any], dict[str, float], dict[str, bool], dict[str, bool], dict[str, dict[str, Any]]]:
        """Advance every robot by one iteration of the paper's loop.

        Whatever exception leaves it, Ctrl-C too, the episode is as it was before, to the bit: the same step
        can be taken again.

        Raises:
            ValueError: An action is missing, for an unknown agent, of another shape or not finite.
            RuntimeError: Before the first reset or after the end.
        """
        before, agents = self._now, self.agents
        if not agents:
            raise RuntimeError("the episode is over: call reset() before step()")
        now, rewards, ended, cut = played(before, self.checked(actions, agents), self._settings)
        ends, late = bool(ended[0]), bool(cut[0])
        observations, said = self._seen_and_said(now)
        out = (
            observations,
            dict(zip(agents, rewards.tolist(), strict=True)),
            dict.fromkeys(agents, ends),
            dict.fromkeys(agents, late),
            said,
        )
        if self.render_mode == "human":
            self._picture(now)
        self._episode, self.agents = now, [] if ends or late else agents
        return out

    def checked(self, actions: Mapping[str, Any], agents: list[str]) -> np.ndarray:
        """Actions of some agents as an array, clipped to their space; refused as by `step`."""
        return checked_rows(self._settings.form, actions, agents)

    def action_masks(self) -> Bool[np.ndarray, "robots choices"]:
        """Choices that have an effect of their own, one row a robot.

        Raises:
            ValueError: The actions are continuous.
            RuntimeError: Before the first reset.
        """
        masks = self._settings.form.masks
        if masks is None:
            raise BadInputError("actions must be 'discrete' for masks, got 'continuous'")
        return masks(self.tick.belief, self.scenario).astype(bool)

    def snapshot(self) -> EpisodeSnapshot:
        """Where the episode stands, chance included: for branching, looking ahead and going on elsewhere.

        Raises:
            RuntimeError: Before the first reset.
        """
        return EpisodeSnapshot(
            format=FORMAT,
            scenario=self.base_scenario,
            blocks=blocks_of(self.layout),
            episode=self._now.kept(),
            agents=tuple(self.agents),
            wrappers=dict(self.np_random.bit_generator.state),
        )

    @plain_arithmetic
    def restore(self, snapshot: object) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
        """Go back, or over, to where a snapshot was taken; from there everything repeats to the bit.

        Args:
            snapshot: What `snapshot` returned, here or in an environment of the same scenario elsewhere.

        Returns:
            Observations and infos, as at the time of the snapshot.

        Raises:
            ValueError: A snapshot of another scenario, layout or version; names what differs. The episode
                before goes on.
        """
        kept = check_snapshot(snapshot, EpisodeSnapshot, self.base_scenario, self.layout)
        now, rng = kept.episode, np.random.default_rng(0)
        rng.bit_generator.state = kept.wrappers
        out = self._seen_and_said(now)
        self._episode, self.scenario = now, now.scenario
        self.agents, self._np_random = list(kept.agents), rng
        return out

    @plain_arithmetic
    def state(self) -> np.ndarray:
        """What is true and believed of the whole team, scaled: for a centralised critic."""
        return state(self.tick, self.scenario)[0]

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

    def _seen_and_said(self, now: Episode) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
        """Observations and infos of all agents."""
        agents, (rows, masks, said) = self.possible_agents, shown(now, self._settings)
        seen = by_agent(rows, agents, self.layout if self._settings.as_dict else None, masks)
        return seen, infos_by_agent(said, agents)
