"""Many worlds at once: one call resets or steps all of them, with arrays in and arrays out.

No agents that come and go, no autoreset: adapters to frameworks add what theirs expects. Worlds that
begin together share a clock and are one `Episode`; those that begin anew while others go on are another.
"""

from collections.abc import Mapping, Sequence
from os import PathLike
from typing import Any

import numpy as np
from gymnasium import logger
from gymnasium.utils import EzPickle
from jaxtyping import Bool, Float32, Int8, UInt8

from envs._arguments import NotResetError, changes_of, next_seed
from envs._cohorts import REPLACED, Cohort, without
from envs._episode import Episode
from envs._playing import played, settings_of, shown
from envs._snapshot import FORMAT, VectorSnapshot, blocks_of, check_snapshot
from envs._standing import standing
from envs._vector_arguments import checked_actions, checked_mask, checked_n_worlds, checked_seeds
from envs._vector_results import Buffers, Columns, Infos, Part, VectorStep, columns_of, merged, step_of
from envs.render.config import DEFAULT_HEIGHT_PX, RenderConfig
from wifipgo.arithmetic import plain_arithmetic
from wifipgo.errors import BadInputError, require
from wifipgo.heap import keep_freed_memory
from wifipgo.scenarios import Scenario
from wifipgo.state import Tick, World

RESET_MASK = "reset_mask"  # gymnasium's name, in the options of a reset
_NO_FIELDS = {"observation", "actions", "reward", "terminate_at_end"}  # arguments that are no scenario fields


class RendezvousVectorEnv(EzPickle):
    """Many worlds of one scenario; world k of the batch is `RendezvousEnv` with the seed of world k.

    Args:
        scenario: As `RendezvousEnv`, as all that is not named here.
        n_worlds: How many.
        buffers: Arrays to write results into instead of new ones.
        render_mode: None or "rgb_array".
        render_height_px: Height of the picture of one world.
        arguments: Of `RendezvousEnv`.

    Raises:
        ValueError: ``n_worlds`` is less than 1 or more than fits in memory, or `RendezvousEnv` refuses.
    """

    metadata: Mapping[str, Any] = {"name": "rendezvous_v0", "render_modes": ["rgb_array"], "render_fps": 5}

    def __init__(
        self,
        scenario: str | PathLike[str] | Scenario = "paper-hw-2",
        *,
        n_worlds: int = 64,
        buffers: Buffers | None = None,
        render_mode: str | None = None,
        render_height_px: int = DEFAULT_HEIGHT_PX,
        **arguments: Any,
    ) -> None:
        """Check the arguments and build the spaces."""
        if render_mode == "human":
            raise BadInputError("render_mode must be None or 'rgb_array' for many worlds, got 'human'")
        keep_freed_memory()
        self._settings = settings_of(scenario, render_mode=render_mode, **arguments)
        self.base_scenario = self.scenario = self._settings.scenario
        # The value, not its name: a file may have changed when the copy is made. Its overrides are in it.
        kept = {name: arguments[name] for name in _NO_FIELDS & arguments.keys()}
        given = {"n_worlds": n_worlds, "buffers": buffers, "render_mode": render_mode}
        EzPickle.__init__(self, self.scenario, **given, render_height_px=render_height_px, **kept)
        self.n_worlds, self.n_robots = checked_n_worlds(n_worlds, self.scenario), self.scenario.n_robots
        self.possible_agents, self.layout = self._settings.agents, self._settings.layout
        self.single_observation_space = self._settings.observation_space()
        self.single_action_space = self._settings.form.space()
        self.state_space = self._settings.state_space
        self.render_mode, self._picture = render_mode, RenderConfig(height_px=render_height_px)
        self._buffers = buffers
        self._seeds: list[tuple[int, int] | None] = [None] * self.n_worlds
        self._cohorts: tuple[Cohort, ...] = ()
        self._last: Columns = {}

    def __repr__(self) -> str:
        """What it is and where it stands."""
        episodes = [cohort.episode for cohort in self._cohorts]
        return f"RendezvousVectorEnv({standing(self.scenario, episodes, n_worlds=self.n_worlds)})"

    @property
    def over(self) -> Bool[np.ndarray, " worlds"]:
        """Worlds whose episode is over.

        Raises:
            RuntimeError: Before the first reset.
        """
        last = self._after_reset()
        over: np.ndarray = last["terminations"][:, 0] | last["truncations"][:, 0]
        return over

    @property
    def cohorts(self) -> tuple[Cohort, ...]:
        """Worlds by when they began, with the state of their episodes; truth included, never for policies."""
        self._after_reset()
        return self._cohorts

    def _after_reset(self) -> Columns:
        if not self._last:
            raise NotResetError("reset() must be called before worlds are looked at or stepped")
        return self._last

    @plain_arithmetic
    def reset(
        self,
        seed: int | np.integer[Any] | Sequence[int | None] | None = None,
        options: Mapping[str, Any] | None = None,
    ) -> tuple[Any, Infos]:
        """Begin an episode in every world, or in some.

        Args:
            seed: Of world 0; those after it have the numbers that follow. Or one for each world. Without
                one, the next episode of each world's own sequence.
            options: Scenario fields for these episodes, the same for all; and ``reset_mask``, an array of
                bools, one a world: only these begin, the others stay where they are.

        Returns:
            Observations and infos of all worlds.

        Raises:
            ValueError: A seed, a mask or an option that is refused, or a room that cannot be laid out. The
                episodes before go on.
        """
        require(options is None or isinstance(options, Mapping), "options", "None or a mapping", options)
        mask = (options or {}).get(RESET_MASK)
        changes = changes_of({k: v for k, v in (options or {}).items() if k != RESET_MASK})
        worlds, given = checked_mask(mask, self.n_worlds), checked_seeds(seed, self.n_worlds)
        if not self._last:
            require(len(worlds) == self.n_worlds, "options['reset_mask']", "True for all at first", mask)
        seeds = list(self._seeds)
        for k in worlds.tolist():
            seeds[k] = next_seed(given[k], seeds[k])
        scenario = self._settings.scenario.with_overrides(**changes)
        now = Episode.begun(scenario, [own for k in worlds.tolist() if (own := seeds[k]) is not None])
        columns = columns_of(shown(now, self._settings), self.n_robots)
        part = Part(worlds, np.arange(len(worlds)), columns)
        last = merged([part], self._last, self.n_worlds)
        self._seeds, self._last = seeds, last
        self._cohorts = (*without(self._cohorts, worlds), Cohort(worlds, now))
        out = step_of(last, self._settings, self._buffers)
        return out.observations, out.infos

    @plain_arithmetic
    def step(self, actions: Any) -> VectorStep:
        """Advance every world that is not over by one iteration.

        Whatever exception leaves it, Ctrl-C too, all worlds are as they were before.

        Args:
            actions: Of each robot of each world, ``(worlds, robots, 3)``, or ``(worlds, robots)`` of
                choices; those of worlds that are over are not looked at.

        Raises:
            ValueError: Actions of another shape, or not finite; names world and robot.
            RuntimeError: Before the first reset, or when all worlds are over.
        """
        over = self.over
        if over.all():
            raise RuntimeError("all worlds are over: call reset() before step()")
        rows = checked_actions(self._settings.form, actions, over, self.n_robots)
        cohorts, parts = [], []
        for cohort in self._cohorts:
            among = cohort.among(~over)
            if not len(among):
                cohorts.append(cohort)
                continue
            own = rows if len(among) == self.n_worlds else self._rows_of(rows, cohort)
            now, rewards, ended, cut = played(cohort.episode, own, self._settings)
            view = shown(now, self._settings)
            columns = columns_of(view, self.n_robots, rewards, ended, cut)
            cohorts.append(cohort.advanced(now, ended | cut))
            parts.append(Part(cohort.worlds[among], among, columns))
        last = merged(parts, self._last, self.n_worlds)
        out = step_of(last, self._settings, self._buffers)
        self._cohorts, self._last = tuple(cohorts), last
        return out

    def _rows_of(self, rows: np.ndarray, cohort: Cohort) -> np.ndarray:
        """Actions of a cohort's worlds; one that is played elsewhere does here whatever that does."""
        each = rows.reshape(self.n_worlds, self.n_robots, *rows.shape[1:])
        return each[cohort.worlds].reshape(-1, *rows.shape[1:])

    @plain_arithmetic
    def state(self) -> Float32[np.ndarray, "worlds numbers"]:
        """What is true and believed of each team, scaled: for a centralised critic."""
        out = np.zeros((self.n_worlds, *self.state_space.shape), dtype=np.float32)
        for cohort in self.cohorts:
            there = cohort.worlds != REPLACED
            out[cohort.worlds[there]] = cohort.states()[there]
        return out

    def action_masks(self) -> Int8[np.ndarray, "worlds robots choices"]:
        """Choices that have an effect of their own.

        Raises:
            ValueError: The actions are continuous.
            RuntimeError: Before the first reset.
        """
        if self._settings.form.masks is None:
            raise BadInputError("actions must be 'discrete' for masks, got 'continuous'")
        return self._after_reset()["infos/action_mask"]

    def snapshot(self) -> VectorSnapshot:
        """Where all worlds stand, chance included.

        Raises:
            RuntimeError: Before the first reset.
        """
        return VectorSnapshot(
            format=FORMAT,
            scenario=self.scenario,
            blocks=blocks_of(self.layout),
            cohorts=tuple(one._replace(episode=one.episode.kept()) for one in self.cohorts),
            seeds=tuple(self._seeds),
            last=dict(self._last),
        )

    @plain_arithmetic
    def restore(self, snapshot: object) -> tuple[Any, Infos]:
        """Go back, or over, to where a snapshot of as many worlds was taken.

        Returns:
            Observations and infos, as at the time of the snapshot.

        Raises:
            ValueError: A snapshot of another scenario, layout, version or number of worlds.
        """
        kept = check_snapshot(snapshot, VectorSnapshot, self.scenario, self.layout)
        n = len(kept.seeds)
        require(n == self.n_worlds, "snapshot", f"of {self.n_worlds} worlds", n)
        out = step_of(kept.last, self._settings, self._buffers)
        self._seeds, self._last = list(kept.seeds), dict(kept.last)
        self._cohorts = kept.cohorts
        return out.observations, out.infos

    @plain_arithmetic
    def render(self, world: int | None = None) -> UInt8[np.ndarray, "height width 3"] | None:
        """Draw one world, or all of them side by side.

        Returns:
            The picture; None, with a warning, without ``render_mode="rgb_array"``.
        """
        if self.render_mode is None:
            logger.warn("render() draws nothing without render_mode='rgb_array'")
            return None
        from envs.render.mosaic import mosaic  # noqa: PLC0415 (pygame loads with a picture)

        which = range(self.n_worlds) if world is None else [world]
        return mosaic([self._picture_of(k) for k in which])

    def _picture_of(self, world: int) -> UInt8[np.ndarray, "height width 3"]:
        from envs.render.mosaic import picture_of  # noqa: PLC0415

        home = self._home(world)
        views = home.tick_of(world), home.world_of(world)
        return picture_of(*views, home.episode.scenario, self._picture)

    def tick_of(self, world: int) -> Tick:
        """State of one world, truth included: for evaluation and pictures, never for policies."""
        return self._home(world).tick_of(world)

    def world_of(self, world: int) -> World:
        """Room and obstacles of one world."""
        return self._home(world).world_of(world)

    def _home(self, world: int) -> Cohort:
        """The cohort that a world belongs to."""
        require(0 <= world < self.n_worlds, "world", f"in 0..{self.n_worlds - 1}", world)
        (home,) = (cohort for cohort in self.cohorts if world in cohort.worlds)
        return home

    def close(self) -> None:
        """Nothing is held open."""


def vector_env(
    scenario: str | PathLike[str] | Scenario = "paper-hw-2", n_worlds: int = 64, **arguments: Any
) -> RendezvousVectorEnv:
    """Many worlds at once; arguments of `parallel_env`."""
    return RendezvousVectorEnv(scenario, n_worlds=n_worlds, **arguments)


def flat_vector_env(
    scenario: str | PathLike[str] | Scenario,
    n_worlds: int,
    *,
    whom: str,
    observation: str = "flat",
    **arguments: Any,
) -> RendezvousVectorEnv:
    """Many worlds for adapters that take flat observations only; ``whom`` says what they are for."""
    require(observation == "flat", "observation", f"'flat' for {whom}", observation)
    return RendezvousVectorEnv(scenario, n_worlds=n_worlds, **arguments)
