"""Parallel environments as arrays: one row for each agent of each environment, ended ones begin anew.

Knows neither stable-baselines3 nor torch, so that a worker process starts fast and stays small.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from gymnasium import spaces
from pettingzoo import ParallelEnv

from wifipgo.errors import require

Maker = Callable[[], ParallelEnv[str, Any, Any]]
Rows = np.ndarray | dict[str, np.ndarray]
Info = dict[str, Any]


class Team(NamedTuple):
    """What all environments of a batch have in common."""

    agents: tuple[str, ...]
    observation_space: spaces.Space[Any]
    action_space: spaces.Space[Any]


class InfoTable(NamedTuple):
    """Infos of all rows by name, from which those of each row are made where they are wanted.

    Attributes:
        columns: Arrays with one entry a row.
        ended: Rows whose episode ended.
        final_observations: Their last ones; None where no row ended.
    """

    columns: Mapping[str, np.ndarray]
    ended: np.ndarray
    final_observations: Rows | None

    def rows(self) -> list[Info]:
        """A dict for each row, with ``terminal_observation`` where the episode ended."""
        cells = [column.tolist() if column.ndim == 1 else list(column) for column in self.columns.values()]
        infos = [dict(zip(self.columns, row, strict=True)) for row in zip(*cells, strict=True)]
        for k, row in enumerate(self.ended.tolist()):
            infos[row]["terminal_observation"] = _picked(self.final_observations, k)
        return infos


class Outcome(NamedTuple):
    """What a step gives, by row.

    Attributes:
        observations: Of the new episode where one ended; None where they were written elsewhere.
        rewards: float32.
        dones: The row's episode ended, in whatever way.
        infos: The environment's own, with ``TimeLimit.truncated`` and, at an end, ``terminal_observation``.
        reset_infos: Of the rows whose episode began with this step.
    """

    observations: Rows | None
    rewards: np.ndarray
    dones: np.ndarray
    infos: list[Info] | InfoTable
    reset_infos: dict[int, Info]


class Batch:
    """Some parallel environments, stepped one after the other in this process.

    Args:
        makers: Each makes one environment. All need the same agents, which stay until the end of the
            episode, and one observation and one action space for all agents.

    Raises:
        ValueError: The same object twice, or environments or agents that differ.
    """

    def __init__(self, makers: Sequence[Maker]) -> None:
        """Make the environments, and check that they fit together."""
        self._envs = [make() for make in makers]
        require(
            len(set(map(id, self._envs))) == len(self._envs),
            "makers",
            "functions that make an environment of their own each",
            "the same environment twice",
        )
        teams = [_team_of(env) for env in self._envs]
        check_alike(teams)
        self.team = teams[0]
        # For each environment: options of its next episodes.
        self._options: list[dict[str, Any]] = [{} for _ in self._envs]
        self._out: np.ndarray | None = None

    def write_into(self, out: np.ndarray) -> None:
        """Leave flat observations in this array from now on, and hand None back in their place."""
        self._out = out

    def set_options(self, options: Sequence[dict[str, Any]]) -> None:
        """Reset options of every environment from its next episode on, until they are set anew."""
        self._options = list(options)

    def reset(self, seeds: Sequence[int | None]) -> tuple[Rows | None, list[Info]]:
        """Begin an episode in every environment."""
        begun = [self._begin(k, seed) for k, seed in enumerate(seeds)]
        return self._stacked([o for o, _ in begun]), self._infos([i for _, i in begun])

    def step(self, actions: np.ndarray) -> Outcome:
        """One action a row; an environment whose episode ends begins the next."""
        agents = self.team.agents
        observations, rewards, infos = [], [], []
        dones = np.zeros(len(actions), dtype=bool)
        reset_infos: dict[int, Info] = {}
        for k, (env, first) in enumerate(zip(self._envs, range(0, len(actions), len(agents)), strict=True)):
            seen, reward, terminated, truncated, info = env.step(
                dict(zip(agents, actions[first : first + len(agents)], strict=True))
            )
            for i, a in enumerate(agents, first):
                dones[i] = terminated[a] or truncated[a]
                infos.append({**info[a], "TimeLimit.truncated": bool(truncated[a] and not terminated[a])})
                rewards.append(reward[a])
            if _ended(env, dones[first : first + len(agents)], agents):
                for i, a in enumerate(agents, first):
                    infos[i]["terminal_observation"] = _copied(seen[a])
                seen, begun = self._begin(k, None)
                reset_infos.update(enumerate(self._infos([begun]), first))
            observations.append(seen)
        return Outcome(
            self._stacked(observations), np.array(rewards, dtype=np.float32), dones, infos, reset_infos
        )

    def attribute(self, name: str, which: Sequence[int]) -> list[Any]:
        """An attribute of some environments."""
        return [getattr(self._envs[k], name) for k in which]

    def assign(self, name: str, value: Any, which: Sequence[int]) -> None:
        """Set an attribute of some environments."""
        for k in which:
            setattr(self._envs[k], name, value)

    def call(
        self, name: str, args: Sequence[Any], kwargs: Mapping[str, Any], which: Sequence[int]
    ) -> list[Any]:
        """Call a method of some environments, once each."""
        return [getattr(self._envs[k], name)(*args, **kwargs) for k in which]

    def wrapped(self, wrapper: type, which: Sequence[int]) -> list[bool]:
        """Whether a wrapper of this type is around some environments."""
        return [_is_wrapped(self._envs[k], wrapper) for k in which]

    def close(self) -> None:
        """Close every environment."""
        for env in self._envs:
            env.close()

    def _begin(self, k: int, seed: int | None) -> tuple[Mapping[str, Any], Mapping[str, Info]]:
        # An environment that takes no options is not handed any.
        options = {"options": dict(self._options[k])} if self._options[k] else {}
        return self._envs[k].reset(seed=seed, **options)

    def _infos(self, infos: Sequence[Mapping[str, Info]]) -> list[Info]:
        return [dict(info.get(a, {})) for info in infos for a in self.team.agents]

    def _stacked(self, observations: Sequence[Mapping[str, Any]]) -> Rows | None:
        rows = [o[a] for o in observations for a in self.team.agents]
        if isinstance(self.team.observation_space, spaces.Dict):
            return {key: np.stack([row[key] for row in rows]) for key in self.team.observation_space}
        if self._out is None:
            return np.stack(rows)
        np.stack(rows, out=self._out)
        return None


def check_alike(teams: Sequence[Team]) -> None:
    """Refuse environments that cannot be rows of one table."""
    for k, team in enumerate(teams):
        if team is not teams[0]:
            require(team == teams[0], f"environment {k}", f"like environment 0, {teams[0]}", team)


def _picked(observations: Rows | None, k: int) -> Any:
    """One row of observations."""
    if isinstance(observations, dict):
        return {name: block[k] for name, block in observations.items()}
    return None if observations is None else observations[k]


def _team_of(env: ParallelEnv[str, Any, Any]) -> Team:
    """Agents and the spaces that they share."""
    agents = tuple(env.possible_agents)
    seen, done = env.observation_space(agents[0]), env.action_space(agents[0])
    for a in agents[1:]:
        what = f"of {agents[0]} (parameters are shared)"
        require(env.observation_space(a) == seen, f"observation space of {a}", f"that {what}", "another")
        require(env.action_space(a) == done, f"action space of {a}", f"that {what}", "another")
    return Team(agents, seen, done)


def _ended(env: ParallelEnv[str, Any, Any], dones: np.ndarray, agents: Sequence[str]) -> bool:
    """Whether the episode is over; refuse one that is over for some agents only."""
    if dones.any() != dones.all() or bool(env.agents) == bool(dones.all()):
        gone = [a for a, done in zip(agents, dones, strict=True) if done]
        raise RuntimeError(
            f"agents must stay until the episode ends for all; over for {gone}, live {env.agents}"
        )
    return bool(dones.all())


def _copied(observation: Any) -> Any:
    """A copy that no later step writes into."""
    if isinstance(observation, Mapping):
        return {key: np.array(value) for key, value in observation.items()}
    return np.array(observation)


def _is_wrapped(env: Any, wrapper: type) -> bool:
    while not isinstance(env, wrapper):
        if "env" not in vars(env):
            return False
        env = env.env
    return True
