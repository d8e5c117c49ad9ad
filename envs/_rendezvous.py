"""The ParallelEnv: dicts and arrays, the clock, the agents. Everything else is below."""

from collections.abc import Mapping
from os import PathLike
from typing import Any, NoReturn

import numpy as np
from gymnasium import logger, spaces
from gymnasium.utils import EzPickle
from pettingzoo import ParallelEnv

from envs import _observation
from envs._episode import Episode
from envs._render_config import DEFAULT_HEIGHT_PX, RENDER_MODES, RenderConfig, check_render_mode
from envs._reward import REWARDS, Outcome
from wifipgo.errors import BadInputError, pick, require
from wifipgo.graph import ate_rot, ate_trans
from wifipgo.mapped import first_map, updated_map
from wifipgo.scenarios import Scenario, field_owners, scenario_named
from wifipgo.state import Commands, Tick, World
from wifipgo.survey import team_share

OBSERVATIONS: Mapping[str, str] = {"flat": "one Box", "dict": "the same blocks by name"}
# Fields that decide the spaces or the length of an episode: fixed when an environment is made.
_FIXED = ("n_robots", "n_slots", "n_steps", "n_azimuths", "max_measurements")
# PettingZoo's own conformance test resets with ``options={"options": 1}``.
_IGNORED_OPTIONS = ("options",)
_ARGUMENTS = ("max_cycles", "observation", "render_height_px", "render_mode", "reward", "scenario")
# Kinds of numpy's dtypes that are real numbers: no text, no dates, no complex numbers.
_REAL = "biuf"


class RendezvousEnv(ParallelEnv[str, Any, Any], EzPickle):
    """Robots explore, lose their way, call each other over Wi-Fi and meet.

    Args:
        scenario: Name in `wifipgo.scenarios.SCENARIOS`, a file that ends in ``.toml``, or a `Scenario`.
        observation: "flat" (one Box) or "dict" (the same blocks by name).
        reward: Name in `envs.rendezvous_v0.REWARDS`; the default is what the mapped share grew by.
        render_mode: None, "rgb_array" or "human" (a window, drawn at each reset and step).
        render_height_px: Height of the pictures, a multiple of 16.
        max_cycles: PettingZoo's name for the scenario's ``n_steps``.
        overrides: Any field of the scenario, e.g. ``n_obstacles=4``.

    Raises:
        ValueError: An unknown scenario, field, observation, reward or render mode; lists what exists.
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
        reward: str = "mapped_share_truth",
        render_mode: str | None = None,
        render_height_px: int = DEFAULT_HEIGHT_PX,
        max_cycles: int | None = None,
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
            reward=reward,
            render_mode=render_mode,
            render_height_px=render_height_px,
            **overrides,
        )
        pick(OBSERVATIONS, observation, "observation")
        if render_mode is not None:
            check_render_mode(render_mode)
        self.base_scenario = self.scenario = base.with_overrides(**overrides)
        self.render_mode, self._render_config = render_mode, RenderConfig(height_px=render_height_px)
        self._screen: Any = None  # holds pygame's objects from the first picture on
        self.layout = _observation.layout(self.scenario)
        self.possible_agents = [f"robot_{i}" for i in range(self.scenario.n_robots)]
        self.agents: list[str] = []
        self._as_dict, self._reward = observation == "dict", pick(REWARDS, reward, "reward")
        make = _observation.dict_space if self._as_dict else _observation.flat_space
        self.observation_spaces = {a: make(self.layout) for a in self.possible_agents}
        self.action_spaces = {a: spaces.Box(-1.0, 1.0, (3,), np.float32) for a in self.possible_agents}
        n_state = self.scenario.n_robots * 7 + self.scenario.n_robots**2
        self.state_space = spaces.Box(-np.inf, np.inf, (n_state,), np.float32)
        self._episode: Episode | None = None

    def observation_space(self, agent: str) -> spaces.Space[Any]:
        """The same object for an agent each time."""
        return pick(self.observation_spaces, agent, "agent")

    def action_space(self, agent: str) -> spaces.Space[Any]:
        """Waypoint in the body frame, in step lengths, and a request: > 0 calls a neighbour."""
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
            raise RuntimeError("reset() must be called before the episode is looked at or stepped")
        return self._episode

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
        mapped = first_map(now.tick)
        out = self._observations(now), self._infos(now, mapped.share)
        if self.render_mode == "human":
            self._picture(now)
        # At once and last, so that what is refused or interrupted leaves the episode before.
        self._episode, self._mapped, self.scenario = now, mapped, scenario
        self.agents = list(self.possible_agents)
        return out

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
        now = before.advanced(_commands(actions, agents))
        mapped = updated_map(self._mapped, before.tick, now.tick)
        outcome = Outcome(before.tick.belief, now.tick.belief, mapped.share - self._mapped.share)
        full = self.scenario.max_measurements
        done = bool(full) and int(now.tick.belief.edges.between_robots.sum()) >= full
        late = now.tick.belief.t >= self.scenario.n_steps
        out = (
            self._observations(now),
            dict(zip(agents, self._reward(outcome, self.scenario).tolist(), strict=True)),
            dict.fromkeys(agents, done),
            dict.fromkeys(agents, late and not done),
            self._infos(now, mapped.share),
        )
        if self.render_mode == "human":
            self._picture(now)
        self._episode, self._mapped, self.agents = now, mapped, [] if done or late else agents
        return out

    def state(self) -> np.ndarray:
        """True pose, estimated pose and Err of every robot, then all link rates: for a centralised critic."""
        truth, belief = self.tick.truth, self.tick.belief
        own = np.concatenate([truth.poses[:, -1], belief.estimate[:, -1], belief.err[:, None]], axis=1)
        return np.concatenate(
            [own.ravel(), belief.rate_mbit_s.ravel()], dtype=np.float32, casting="same_kind"
        )

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
            from envs._render_screen import screen_for  # noqa: PLC0415 (pygame loads with the first picture)

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

    def _observations(self, now: Episode) -> dict[str, Any]:
        rows = _observation.observe(now.tick.belief, now.scenario)
        pairs = zip(self.possible_agents, rows, strict=True)
        return {a: _observation.by_name(r, self.layout) for a, r in pairs} if self._as_dict else dict(pairs)

    def _infos(self, now: Episode, mapped_share: float) -> dict[str, dict[str, Any]]:
        """Metrics of each robot; those that end in ``_truth`` read what robots cannot know."""
        truth, belief = now.tick.truth, now.tick.belief
        n = len(belief.err)
        group_of = {robot: group for group in belief.met for robot in group}
        columns = {
            "err": belief.err.tolist(),
            "met": [group_of.get(robot, ()) for robot in range(n)],
            "ate_trans_truth": ate_trans(belief.estimate, truth.poses).tolist(),
            "ate_rot_truth": ate_rot(belief.estimate, truth.poses).tolist(),
            "bumps_truth": truth.bumps.tolist(),
            "distance_m_truth": truth.distance_m.tolist(),
            "mapped_share_belief": [team_share(belief.survey)] * n,
            "mapped_share_truth": [mapped_share] * n,
            "coverage_truth": [truth.cells.share] * n,
        }
        rows = zip(self.possible_agents, zip(*columns.values(), strict=True), strict=True)
        return {agent: dict(zip(columns, row, strict=True)) for agent, row in rows}


def _changes(options: Mapping[str, Any] | None) -> dict[str, Any]:
    """Scenario fields that reset options change."""
    require(options is None or isinstance(options, Mapping), "options", "None or a mapping", options)
    changes = {name: value for name, value in (options or {}).items() if name not in _IGNORED_OPTIONS}
    for name, value in changes.items():
        require(isinstance(name, str), "options", "a mapping from names of scenario fields", options)
        require(name not in _FIXED, f"options[{name!r}]", "set when the environment is made", value)
    return changes


def _commands(actions: Mapping[str, Any], agents: list[str]) -> Commands:
    """Check actions and stack them; a waypoint or request outside [-1, 1] is clipped."""
    require(
        isinstance(actions, Mapping), "actions", "a mapping from agents to actions", type(actions).__name__
    )
    for name in actions.keys() - set(agents):
        require(False, f"actions[{name!r}]", f"for one of {agents}", name)
    for agent in agents:
        if agent not in actions:
            raise BadInputError(f"actions[{agent!r}] must be given: one action for each live agent")
    try:
        rows = np.array([actions[agent] for agent in agents])
    except (TypeError, ValueError):
        rows = np.zeros(0)
    if rows.shape != (len(agents), 3) or rows.dtype.kind not in _REAL:
        _refuse_shapes(actions, agents)
    if not np.isfinite(rows).all():
        first = int(np.isfinite(rows).all(axis=1).argmin())
        raise BadInputError(f"actions[{agents[first]!r}] must be finite, got {rows[first].tolist()}")
    rows = np.minimum(np.maximum(rows.astype(np.float64), -1.0), 1.0)
    return Commands(rows[:, :2], rows[:, 2] > 0.0)


def _refuse_shapes(actions: Mapping[str, Any], agents: list[str]) -> NoReturn:
    """Say which action is not three numbers."""
    for agent in agents:
        try:
            shape: Any = np.shape(actions[agent])
        except ValueError:
            shape = "parts of different lengths"
        require(shape == (3,), f"actions[{agent!r}]", "of shape (3,)", shape)
        real = np.array(actions[agent]).dtype.kind in _REAL
        require(real, f"actions[{agent!r}]", "three numbers", actions[agent])
    raise BadInputError(f"actions must be three numbers each, got {dict(actions)}")
