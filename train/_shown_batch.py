"""Worlds as a network meets them: through an interface, see `baselines.policies.learned.interfaces`.

It lies around the worlds and not around the VecEnv, so that processes translate what their worlds show.
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from gymnasium import spaces
from jaxtyping import Float32, Shaped

from baselines.policies.learned.interfaces import Interface, make_interface
from train._config import CRITICS
from train._env_batch import Info, InfoTable, Outcome, Rows, Team
from train._truths import N_TRUTH, TRUTHS, truth_of
from train._world_batch import WorldBatch
from wifipgo.scenarios import Scenario

_CUT = "TimeLimit.truncated"


class Showing(NamedTuple):
    """How observations are shown.

    Attributes:
        interface: Name in `baselines.policies.learned.interfaces.INTERFACES`.
        scenario: That it is made for.
        endless: Leave ends by the clock as they are reported, truncations, so that learners put the value
            of the last state there; else they are ends: nothing counts after them.
        critic: One of `train._config.CRITICS`: what a learner's value is read from beside what the robot is
            shown. With "team" there follow `train._truths.N_TRUTH` numbers of the truth about robot and team,
            their means over the team, and the team's mean of the numbers of a robot as a whole.
    """

    interface: str
    scenario: Scenario
    endless: bool = False
    critic: str = "own"

    def made(self) -> Interface:
        """The interface."""
        return make_interface(self.interface, self.scenario)


class ShownBatch:
    """Worlds that show what a network is shown and take its answers.

    Infos have what is true (`train._truths.TRUTHS`) and how episodes end, nothing else; those of the rows
    that begin are left out.

    Args:
        worlds: All of one interface.
        showing: How.

    Attributes:
        seen: Observations as the worlds gave them, for those who want to see what robots see.
    """

    seen: np.ndarray

    def __init__(self, worlds: WorldBatch, showing: Showing) -> None:
        """Replace the spaces."""
        self._worlds, self._endless, self._critic = worlds, showing.endless, CRITICS[showing.critic]
        self.interface = showing.made()
        agents, _, actions = worlds.team
        n_shown = self.interface.n_shown + n_for_critic(self.interface, showing.critic)
        shown = spaces.Box(-np.inf, np.inf, (n_shown,), np.float32)
        choices = self.interface.n_choices
        self.team = Team(agents, shown, spaces.MultiDiscrete(list(choices)) if choices else actions)
        self._out: np.ndarray | None = None
        self._memory: Any = None

    def write_into(self, out: np.ndarray) -> None:
        """Leave what is shown in this array from now on, and hand None back in its place."""
        self._out = out

    def set_options(self, options: Sequence[dict[str, Any]]) -> None:
        """As `WorldBatch.set_options`."""
        self._worlds.set_options(options)

    def reset(self, seeds: Sequence[int | None]) -> tuple[Rows | None, list[Info]]:
        """Begin an episode in every world."""
        rows, infos = self._worlds.reset(seeds)
        self.seen, self._memory = np.asarray(rows), None
        return self._handed(self._shown(None)), infos

    def step(self, answers: np.ndarray) -> Outcome:
        """An answer a row; a world whose episode ends begins the next."""
        step = self._worlds.step(self.interface.commands(answers, self.seen))
        infos, dones = step.infos, step.dones
        assert isinstance(infos, InfoTable)
        truth = truth_of(infos.columns)
        last = self._shown_last(infos, truth) if len(infos.ended) else None
        self.seen = np.asarray(step.observations)
        truth[dones] = 0.0
        told = {name: infos.columns[name] for name in TRUTHS} | {_CUT: infos.columns[_CUT] & self._endless}
        shown = self._handed(self._shown(truth))
        return Outcome(shown, step.rewards, dones, InfoTable(told, infos.ended, last), {})

    def attribute(self, name: str, which: Sequence[int]) -> list[Any]:
        """As `WorldBatch.attribute`."""
        return self._worlds.attribute(name, which)

    def assign(self, name: str, value: Any, which: Sequence[int]) -> None:
        """As `WorldBatch.assign`."""
        self._worlds.assign(name, value, which)

    def call(
        self, name: str, args: Sequence[Any], kwargs: Mapping[str, Any], which: Sequence[int]
    ) -> list[Any]:
        """As `WorldBatch.call`."""
        return self._worlds.call(name, args, kwargs, which)

    def wrapped(self, wrapper: type, which: Sequence[int]) -> list[bool]:
        """As `WorldBatch.wrapped`."""
        return self._worlds.wrapped(wrapper, which)

    def close(self) -> None:
        """Close every world."""
        self._worlds.close()

    def _shown(self, truth: Float32[np.ndarray, "rows truths"] | None) -> Float32[np.ndarray, "rows shown"]:
        """What is observed now, as it is shown and remembered."""
        self._memory = self.interface.remembered(self.seen, self._memory)
        return self._with_truth(self.interface.shown(self.seen, self._memory), truth)

    def _shown_last(
        self, infos: InfoTable, truth: Float32[np.ndarray, "rows truths"]
    ) -> Float32[np.ndarray, "ended shown"]:
        """Last observations of episodes; what was remembered of others stays."""
        ended, rows = infos.ended, infos.final_observations
        assert isinstance(rows, np.ndarray)
        then = None if self._memory is None else type(self._memory)(*(each[ended] for each in self._memory))
        return self._with_truth(
            self.interface.shown(rows, self.interface.remembered(rows, then)), truth[ended]
        )

    def _with_truth(
        self, shown: Shaped[np.ndarray, "rows _"], truth: Float32[np.ndarray, "rows truths"] | None
    ) -> Float32[np.ndarray, "rows _"]:
        """What is shown, and behind it what only the value is read from; no truth: that of a beginning."""
        if not self._critic:
            return shown
        n_whole, n_robots = _n_whole(self.interface), len(self.team.agents)
        own = np.zeros((len(shown), N_TRUTH), dtype=np.float32) if truth is None else truth
        mine = np.concatenate([own, shown[:, :n_whole]], axis=1)
        team = mine.reshape(-1, n_robots, mine.shape[1]).mean(axis=1).repeat(n_robots, axis=0)
        return np.concatenate([shown, own, team], axis=1, dtype=np.float32)

    def _handed(self, shown: np.ndarray) -> np.ndarray | None:
        """Rows, or None where they are written elsewhere."""
        if self._out is None:
            return shown
        self._out[...] = shown
        return None


def n_for_critic(interface: Interface, critic: str) -> int:
    """Numbers that follow what a robot is shown."""
    return 2 * N_TRUTH + _n_whole(interface) if CRITICS[critic] else 0


def _n_whole(interface: Interface) -> int:
    """Numbers of a robot as a whole; all, if it does not tell directions apart."""
    return int(getattr(interface, "n_whole", interface.n_shown))
