"""Worlds of `envs.rendezvous_v0` as rows: one call steps all that are made alike.

Has the face of `train._env_batch.Batch`, and gives the same results.
"""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from gymnasium import spaces
from jaxtyping import Bool, Int

from envs.directions import STAY
from envs.rendezvous_v0 import RESET_MASK, RendezvousVectorEnv, Turn, parallel_env, step_and_reset, vector_env
from train._env_batch import Info, InfoTable, Maker, Outcome, Rows, Team, check_alike
from wifipgo.errors import require

# What is asked of one environment, and how many of them are asked for that of one.
_OF_ONE = {"tick": "tick_of", "world": "world_of"}
_OF_ALL = ("action_masks", "state")


class _Group(NamedTuple):
    """Worlds that are made alike: their environment, numbers in the batch, rows of robots, and phase."""

    env: RendezvousVectorEnv
    worlds: Int[np.ndarray, " worlds"]
    rows: Int[np.ndarray, " rows"]
    phase: float


def are_worlds(makers: Sequence[Maker]) -> bool:
    """Whether all makers are ``functools.partial(parallel_env, ...)``, none with a window."""
    return all(
        isinstance(maker, partial)
        and maker.func is parallel_env
        and maker.keywords.get("render_mode") != "human"
        for maker in makers
    )


class WorldBatch:
    """Worlds of one or several scenarios.

    Args:
        makers: Those that `are_worlds` accepts, one a world.
        phases: Share of an episode that each world has behind it when a reset is over, spent standing still;
            those that begin together are stepped at once.

    Raises:
        ValueError: Worlds with other agents or other spaces.
    """

    def __init__(self, makers: Sequence[Any], phases: Sequence[float] = ()) -> None:
        """Make one environment for all worlds that are made alike and begin together."""
        kinds: list[tuple[Any, float]] = []
        kind_of = np.array(
            [_place(*kind, kinds) for kind in zip(makers, phases or [0.0] * len(makers), strict=True)]
        )
        self._groups = [_group(*kind, np.flatnonzero(kind_of == k)) for k, kind in enumerate(kinds)]
        teams = [_team_of(g.env) for g in self._groups]
        check_alike([teams[k] for k in kind_of])
        self.team = teams[0]
        self._render_mode = kinds[0][0].keywords.get("render_mode")
        self._options: list[dict[str, Any]] = [{} for _ in makers]
        self._out: np.ndarray | None = None

    def write_into(self, out: np.ndarray) -> None:
        """Leave flat observations in this array from now on, and hand None back in their place."""
        self._out = out

    def set_options(self, options: Sequence[dict[str, Any]]) -> None:
        """Reset options of every world from its next episode on, until they are set anew."""
        self._options = list(options)

    def reset(self, seeds: Sequence[int | None]) -> tuple[Rows | None, list[Info]]:
        """Begin an episode in every world."""
        begun = [self._begun(g, seeds) for g in self._groups]
        infos = InfoTable(self._columns([infos for _, infos in begun]), np.zeros(0, dtype=int), None)
        return self._observations([seen for seen, _ in begun]), infos.rows()

    def step(self, actions: np.ndarray) -> Outcome:
        """One action a row; a world whose episode ends begins the next."""
        by_world = (-1, len(self.team.agents), *actions.shape[1:])
        turns = [
            step_and_reset(g.env, actions[g.rows].reshape(by_world), partial(self._begin, g))
            for g in self._groups
        ]
        steps = [turn.step for turn in turns]
        terminated = self._joined([step.terminations for step in steps])
        truncated = self._joined([step.truncations for step in steps])
        return Outcome(
            self._observations([step.observations for step in steps]),
            self._joined([step.rewards for step in steps]).astype(np.float32),
            terminated | truncated,
            self._infos(turns, truncated & ~terminated),
            self._first_infos(turns),
        )

    def attribute(self, name: str, which: Sequence[int]) -> list[Any]:
        """An attribute of some worlds."""
        if name == "render_mode":
            return [self._render_mode] * len(which)
        homes = [self._home(world) for world in which]
        if name in _OF_ONE:
            return [getattr(env, _OF_ONE[name])(k) for env, k in homes]
        return [getattr(env, name) for env, _ in homes]

    def assign(self, name: str, value: Any, which: Sequence[int]) -> None:
        """Set an attribute of all worlds that are made alike."""
        for g in self._groups:
            mine = np.isin(g.worlds, which)
            rule = f"of all worlds of {g.env.scenario.name!r}, which are stepped at once"
            require(mine.all() or not mine.any(), "indices", rule, list(which))
            if mine.any():
                setattr(g.env, name, value)

    def call(
        self, name: str, args: Sequence[Any], kwargs: Mapping[str, Any], which: Sequence[int]
    ) -> list[Any]:
        """Call a method for some worlds: ``render``, ``action_masks`` or ``state``.

        Raises:
            ValueError: Another one.
        """
        homes: list[tuple[Any, int]] = [self._home(world) for world in which]
        if name == "render":
            return [env.render(world=k) for env, k in homes]
        rule = f"'render' or one of {_OF_ALL}: worlds that are stepped at once have no others of their own"
        require(name in _OF_ALL, "method", rule, name)
        found = {id(g.env): getattr(g.env, name)(*args, **kwargs) for g in self._groups}
        return [found[id(env)][k] for env, k in homes]

    def wrapped(self, wrapper: type, which: Sequence[int]) -> list[bool]:
        """Whether some worlds are of this type; nothing is wrapped around them."""
        return [issubclass(parallel_env, wrapper)] * len(which)

    def close(self) -> None:
        """Close every environment."""
        for g in self._groups:
            g.env.close()

    def _home(self, world: int) -> tuple[RendezvousVectorEnv, int]:
        """Environment of a world, and its number there."""
        for g in self._groups:
            at = np.searchsorted(g.worlds, world)
            if at < len(g.worlds) and g.worlds[at] == world:
                return g.env, int(at)
        raise IndexError(world)

    def _begun(self, g: _Group, seeds: Sequence[int | None]) -> tuple[Any, dict[str, np.ndarray]]:
        """Begin an episode in all worlds of a group, and stand still until its phase is reached."""
        seen, infos = self._begin(g, np.ones(len(g.worlds), dtype=bool), seeds)
        still = np.full((len(g.worlds), len(self.team.agents), *(self.team.action_space.shape or ())), 0.0)
        if isinstance(self.team.action_space, spaces.Discrete):
            still = np.full(still.shape, STAY)
        for _ in range(int(g.phase * g.env.scenario.n_steps)):
            seen = step_and_reset(g.env, still, partial(self._begin, g)).step.observations
        return seen, infos

    def _begin(
        self, g: _Group, mask: Bool[np.ndarray, " worlds"], seeds: Sequence[int | None] = ()
    ) -> tuple[Any, dict[str, np.ndarray]]:
        """Begin an episode in the worlds of a mask, each with its options."""
        mine = [seed for seed in (seeds[world] for world in g.worlds if seeds) if seed is not None]
        options = [self._options[world] for world in g.worlds]
        left, begun = mask.copy(), None
        while left.any():
            chosen = options[int(left.argmax())]
            now = left & np.array([each == chosen for each in options])
            begun = g.env.reset(seed=mine or None, options={**chosen, RESET_MASK: now})
            left &= ~now
        assert begun is not None
        return begun

    def _joined(self, parts: Sequence[np.ndarray]) -> np.ndarray:
        """Arrays by world and robot of all groups, as one by row."""
        flat = [part.reshape(-1, *part.shape[2:]) for part in parts]
        if len(flat) == 1:
            return flat[0]
        out = np.empty((sum(map(len, flat)), *flat[0].shape[1:]), flat[0].dtype)
        for g, part in zip(self._groups, flat, strict=True):
            out[g.rows] = part
        return out

    def _columns(self, infos: Sequence[Mapping[str, np.ndarray]]) -> dict[str, np.ndarray]:
        return {name: self._joined([each[name] for each in infos]) for name in infos[0]}

    def _observations(self, parts: Sequence[Any]) -> Rows | None:
        """Rows of all groups, or None where they are written elsewhere."""
        if isinstance(parts[0], dict):
            return self._columns(parts)
        rows = self._joined(parts)
        if self._out is None:
            return rows
        self._out[...] = rows
        return None

    def _infos(self, turns: Sequence[Turn], cut: np.ndarray) -> InfoTable:
        columns = self._columns([turn.step.infos for turn in turns])
        ends = [(g, turn) for g, turn in zip(self._groups, turns, strict=True) if turn.ended.any()]
        ended = [g.rows.reshape(len(g.worlds), -1)[turn.ended].ravel() for g, turn in ends]
        finals = [_by_row(turn.final_observations) for _, turn in ends]
        return InfoTable(
            columns | {"TimeLimit.truncated": cut},
            np.concatenate(ended or [np.zeros(0, dtype=int)]),
            _stacked(finals) if finals else None,
        )

    def _first_infos(self, turns: Sequence[Turn]) -> dict[int, Info]:
        """Infos of the rows whose episode began."""
        found: dict[int, Info] = {}
        for g, turn in zip(self._groups, turns, strict=True):
            if turn.first_infos:
                began = np.repeat(turn.ended, len(self.team.agents))
                columns = {name: _by_row(block)[began] for name, block in turn.first_infos.items()}
                infos = InfoTable(columns, np.zeros(0, dtype=int), None).rows()
                found |= dict(zip(g.rows[began].tolist(), infos, strict=True))
        return found


def _place(maker: Any, phase: float, kinds: list[tuple[Any, float]]) -> int:
    """Number of the kind of a world, which is a new one if none before is alike."""
    for k, (kind, its_phase) in enumerate(kinds):
        if (kind.args, kind.keywords, its_phase) == (maker.args, maker.keywords, phase):
            return k
    kinds.append((maker, phase))
    return len(kinds) - 1


def _group(kind: Any, phase: float, worlds: Int[np.ndarray, " worlds"]) -> _Group:
    env = vector_env(**kind.keywords | {"n_worlds": len(worlds)}, **_scenario(kind.args))
    n = len(env.possible_agents)
    return _Group(env, worlds, (worlds[:, None] * n + np.arange(n)).ravel(), phase)


def _scenario(args: tuple[Any, ...]) -> dict[str, Any]:
    """The one argument of `parallel_env` that may come without its name."""
    return dict(zip(("scenario",), args, strict=False))


def _team_of(env: RendezvousVectorEnv) -> Team:
    return Team(tuple(env.possible_agents), env.single_observation_space, env.single_action_space)


def _by_row(x: Any) -> Any:
    """Without the axis of worlds."""
    if isinstance(x, dict):
        return {name: _by_row(block) for name, block in x.items()}
    return x.reshape(-1, *x.shape[2:])


def _stacked(parts: Sequence[Rows]) -> Rows:
    """One after the other."""
    if isinstance(parts[0], dict):
        return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    return np.concatenate(parts)  # type: ignore[arg-type]
