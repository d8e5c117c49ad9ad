"""A stable-baselines3 VecEnv over PettingZoo parallel environments, with shared parameters.

Rows are environments times agents: row ``k * n_agents + i`` is agent i of environment k.
"""

from collections.abc import Iterable, Sequence
from copy import deepcopy
from functools import partial
from itertools import chain
from multiprocessing.connection import Connection
from typing import Any

import numpy as np
from gymnasium import spaces
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices, VecEnvObs, VecEnvStepReturn

from baselines.policies.learned.interfaces import Interface
from envs.rendezvous_v0 import parallel_env
from train._env_batch import InfoTable, Maker, Outcome, Rows, Team
from train._env_workers import Crew, LocalCrew, RemoteCrew
from train._shown_batch import Showing
from train._world_batch import are_worlds
from wifipgo.errors import require


class TeamVecEnv(VecEnv):
    """Every agent of every environment is a row; an episode that ends is followed by the next.

    What is reported so that learners get it right: the end of an episode by its clock is a truncation
    (``TimeLimit.truncated``, with the last observation as ``terminal_observation``), so values are
    bootstrapped there; `seed` gives each environment a sequence of episodes of its own.

    Environments given as ``functools.partial(parallel_env, ...)`` that are made alike are stepped at once in
    each process, see `train._world_batch`; others one after the other.

    Differs from stable-baselines3's own in two points. Options set by `set_options` hold from the next
    episode of each environment on until they are set anew, because learners never call `reset` midway.
    `env_method` and `get_images` touch each environment once, however many of its rows are asked for.

    Args:
        makers: Each makes one environment; all alike (see `train._env_batch.Batch`).
        n_workers: Processes that share the environments; 0 steps them in this one.
        phases: Share of its first episode that each environment has behind it, spent standing still, when a
            reset is over: none without. Episodes of different ones end at other times.
        showing: As what observations are shown, and actions taken; as they are without.

    Attributes:
        interface: That of ``showing``; there is none without.

    Raises:
        ValueError: No maker, more workers than environments, or environments that do not fit together.
    """

    interface: Interface

    def __init__(
        self,
        makers: Sequence[Maker],
        *,
        n_workers: int = 0,
        phases: Sequence[float] = (),
        showing: Showing | None = None,
    ) -> None:
        """Make the environments."""
        self.n_envs = len(makers)
        require(self.n_envs >= 1, "makers", "at least one", self.n_envs)
        require(0 <= n_workers <= self.n_envs, "n_workers", f"in 0..{self.n_envs} (environments)", n_workers)
        each = list(phases) or [0.0] * self.n_envs
        require(len(each) == self.n_envs, "phases", f"{self.n_envs}, one an environment", len(each))
        worlds, within = are_worlds(makers), [0.0 <= phase < 1.0 for phase in each]
        rule = "in [0, 1), and 0 unless all environments are partials of parallel_env"
        require(not any(each) or (all(within) and worlds), "phases", rule, each)
        require(showing is None or worlds, "showing", "None unless all are partials of parallel_env", showing)
        if showing is not None:
            self.interface = showing.made()
        self._crews: list[Crew] = []
        shares = np.array_split(np.arange(self.n_envs), max(n_workers, 1))
        for w, share in enumerate(shares):
            mine, behind = [makers[k] for k in share], [each[k] for k in share]
            what = (behind, showing)
            crew: Crew = RemoteCrew(mine, f"worker {w}", *what) if n_workers else LocalCrew(mine, *what)
            self._crews.append(crew)
        self._bounds = np.cumsum([0] + [len(share) for share in shares]).tolist()
        team = self._common_team()
        self.agents = team.agents
        self._share(team)
        self._actions: np.ndarray | None = None
        super().__init__(self.n_envs * len(team.agents), team.observation_space, team.action_space)

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """Seed the next reset; each environment gets a seed of its own.

        Returns:
            The seed of every row.
        """
        states = np.random.SeedSequence(seed).generate_state(self.n_envs)
        self._seeds = [int(state) for state in states for _ in self.agents]
        return self._seeds

    def set_options(self, options: list[dict[str, Any]] | dict[str, Any] | None = None) -> None:
        """Reset options from each environment's next episode on: one dict for all, or one for each."""
        each = [options or {}] * self.n_envs if isinstance(options, dict | None) else options
        require(
            len(each) == self.n_envs, "options", f"a dict or {self.n_envs} dicts, one an environment", each
        )
        self._options = deepcopy(list(each))
        self._ask_all("set_options", [(self._options[lo:hi],) for lo, hi in self._shares()])

    def reset(self) -> VecEnvObs:
        """Begin an episode everywhere; seeds given before are used up."""
        self._drain()
        seeds = self._seeds[:: len(self.agents)]
        begun = self._ask_all("reset", [(seeds[lo:hi],) for lo, hi in self._shares()])
        self._reset_seeds()
        self.reset_infos = list(chain.from_iterable(infos for _, infos in begun))
        return self._joined([rows for rows, _ in begun])

    def step_async(self, actions: np.ndarray) -> None:
        """Hand out one action a row; workers begin at once."""
        shape = (self.num_envs, *(self.action_space.shape or ()))
        require(np.shape(actions) == shape, "actions", f"of shape {shape}", np.shape(actions))
        self._check_open()
        if self._actions is not None:
            raise RuntimeError("step_async() was called twice without step_wait()")
        self._actions = actions
        n = len(self.agents)
        for crew, (lo, hi) in zip(self._crews, self._shares(), strict=True):
            crew.ask("step", actions[lo * n : hi * n])

    def step_wait(self) -> VecEnvStepReturn:
        """What the step gave, by row."""
        if self._actions is None:
            raise RuntimeError("step_wait() was called without step_async()")
        self._actions = None
        parts: list[Outcome] = self._answers()
        for part, (lo, _) in zip(parts, self._shares(), strict=True):
            for row, info in part.reset_infos.items():
                self.reset_infos[lo * len(self.agents) + row] = info
        return (
            self._joined([part.observations for part in parts]),
            np.concatenate([part.rewards for part in parts]),
            np.concatenate([part.dones for part in parts]),
            list(chain.from_iterable(map(_by_row, parts))),
        )

    @property
    def pipes(self) -> tuple[Connection, ...]:
        """What becomes readable when workers answer; none where this process steps the worlds."""
        return tuple(crew.pipe for crew in self._crews if isinstance(crew, RemoteCrew))

    @property
    def seen(self) -> np.ndarray:
        """Observations as the worlds gave them, where something else is shown of them."""
        return np.concatenate(self._ask_all("seen", [()] * len(self._crews)))

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """An attribute of the environment of each row."""
        return self._by_row("attribute", (attr_name,), indices)

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Set an attribute of the environments of some rows."""
        self._by_row("assign", (attr_name, value), indices)

    def env_method(
        self, method_name: str, *method_args: Any, indices: VecEnvIndices = None, **method_kwargs: Any
    ) -> list[Any]:
        """Call a method once in each environment of some rows; each of its rows gets the result.

        Of ``action_masks`` each row gets its own, as masked PPO of sb3-contrib asks for them.
        """
        found = self._by_row("call", (method_name, method_args, method_kwargs), indices)
        if method_name != "action_masks":
            return found
        rows = self._get_indices(indices)
        return [masks[row % len(self.agents)] for masks, row in zip(found, rows, strict=True)]

    def env_is_wrapped(self, wrapper_class: type[Any], indices: VecEnvIndices = None) -> list[bool]:
        """Whether a wrapper of this type is around the environment of each row."""
        return self._by_row("wrapped", (wrapper_class,), indices)

    def get_images(self) -> Sequence[np.ndarray | None]:
        """A picture of each environment, None without ``render_mode="rgb_array"``."""
        if self.render_mode != "rgb_array":
            return [None] * self.n_envs
        return self.env_method("render")[:: len(self.agents)]

    def close(self) -> None:
        """Close the environments and end the workers; a second time does nothing."""
        crews, self._crews = self._crews, []
        for crew in crews:
            crew.dismiss()
        for crew in crews:
            crew.close()

    def _share(self, team: Team) -> None:
        """Let flat observations of workers come through shared memory."""
        space = team.observation_space
        if not isinstance(space, spaces.Box) or space.dtype != np.float32:
            return
        for crew in self._crews:
            if isinstance(crew, RemoteCrew):
                crew.share((crew.n_envs * len(team.agents), *space.shape))

    def _shares(self) -> list[tuple[int, int]]:
        """First environment of each crew, and the one after its last."""
        return list(zip(self._bounds[:-1], self._bounds[1:], strict=True))

    def _common_team(self) -> Team:
        """Wait until all environments are made; if one cannot be, end the workers."""
        try:
            teams: list[Team] = self._answers()
            for w, team in enumerate(teams):
                require(team == teams[0], f"environments of worker {w}", f"like {teams[0]}", team)
        except BaseException:
            self.close()
            raise
        return teams[0]

    def _ask_all(self, name: str, args: Sequence[tuple[Any, ...]]) -> list[Any]:
        """Ask every crew, each with its own arguments."""
        self._drain()
        for crew, own in zip(self._crews, args, strict=True):
            crew.ask(name, *own)
        return self._answers()

    def _answers(self) -> list[Any]:
        """An answer of every crew; all are taken before the first problem is raised."""
        answers, problems = [], []
        for crew in self._crews:
            try:
                answers.append(crew.answer())
            except Exception as problem:
                problems.append(problem)
        if problems:
            raise problems[0]
        return answers

    def _joined(self, parts: Sequence[Rows | None]) -> VecEnvObs:
        """Rows of all crews, in memory of their own: one array, or one for each name."""
        found = [crew.rows if part is None else part for part, crew in zip(parts, self._crews, strict=True)]
        if isinstance(found[0], dict):
            return {key: np.concatenate([part[key] for part in found]) for key in found[0]}  # type: ignore[index]
        return found[0] if len(parts) == 1 and parts[0] is not None else np.concatenate(found)  # type: ignore

    def _drain(self) -> None:
        """Forget a step that nobody waits for."""
        self._check_open()
        if self._actions is not None:
            self._actions = None
            self._answers()

    def _check_open(self) -> None:
        if not self._crews:
            raise RuntimeError("the environments are closed")

    def _by_row(self, name: str, args: tuple[Any, ...], indices: VecEnvIndices) -> list[Any]:
        """Do something once in each environment of some rows, and repeat the result by row."""
        rows = _checked(self._get_indices(indices), self.num_envs)
        wanted = [row // len(self.agents) for row in rows]
        picked = [[k - lo for k in sorted(set(wanted)) if lo <= k < hi] for lo, hi in self._shares()]
        answers = self._ask_all(name, [(*args, which) for which in picked])
        if name == "assign":
            return []
        return [dict(zip(sorted(set(wanted)), chain.from_iterable(answers), strict=True))[k] for k in wanted]


def rendezvous_vec_env(scenario: str, *, n_envs: int, n_workers: int = 0, **arguments: Any) -> TeamVecEnv:
    """Copies of one rendezvous environment; ``arguments`` are those of `envs.rendezvous_v0.parallel_env`."""
    return TeamVecEnv([partial(parallel_env, scenario, **arguments)] * n_envs, n_workers=n_workers)


def _checked(indices: Iterable[int], n_rows: int) -> list[int]:
    rows = [int(row) for row in indices]
    for row in rows:
        require(-n_rows <= row < n_rows, "indices", f"rows in 0..{n_rows - 1}", row)
    return [row % n_rows for row in rows]


def _by_row(part: Outcome) -> list[dict[str, Any]]:
    return part.infos.rows() if isinstance(part.infos, InfoTable) else part.infos
