"""A VecEnv as a network meets it: through an interface, see `baselines.policies.learned.interfaces`."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium import spaces
from jaxtyping import Int
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper
from stable_baselines3.common.vec_env.base_vec_env import VecEnvObs, VecEnvStepReturn

from baselines.policies.learned.interfaces import Interface
from train._config import CRITICS
from train._truths import N_TRUTH, TRUTHS, truth_of
from wifipgo.errors import pick


class Translated(VecEnvWrapper):
    """Observations as the network is shown them, and its answers as actions.

    Args:
        venv: Rows of flat observations.
        interface: Translates.
        endless: Leave ends by the clock as they are reported, truncations, so that learners put the value
            of the last state there; else they are ends: nothing counts after them.
        critic: One of `train._config.CRITICS`: what a learner's value is read from beside what the robot is
            shown. With "team" there follow `train._truths.N_TRUTH` numbers of the truth about robot and team,
            their means over the team, and the team's mean of the numbers of a robot as a whole.
        n_robots: Of each team.

    Attributes:
        rows: Observations as the environment gave them, for those who want to see what robots see.
    """

    rows: np.ndarray

    def __init__(
        self,
        venv: VecEnv,
        interface: Interface,
        *,
        endless: bool = False,
        critic: str = "own",
        n_robots: int = 1,
    ) -> None:
        """Replace the spaces."""
        self._n_robots, self._critic = n_robots, pick(CRITICS, critic, "critic")
        n_shown = interface.n_shown + n_for_critic(interface, critic)
        shown = spaces.Box(-np.inf, np.inf, (n_shown,), np.float32)
        choices = interface.n_choices
        answers = spaces.MultiDiscrete(list(choices)) if choices else venv.action_space
        super().__init__(venv, shown, answers)
        self.interface, self._endless = interface, endless
        self._memory: Any = None

    def reset(self) -> VecEnvObs:
        """Begin an episode everywhere."""
        self.rows = np.asarray(self.venv.reset())
        self._memory = self.interface.remembered(self.rows, None)
        return self._with_truth(self.interface.shown(self.rows, self._memory), None)

    def step_async(self, actions: np.ndarray) -> None:
        """Hand out what the answers mean."""
        self.venv.step_async(self.interface.commands(actions, self.rows))

    def step_wait(self) -> VecEnvStepReturn:
        """What the step gave, as the network is shown it."""
        rows, rewards, dones, infos = self.venv.step_wait()
        self.rows = np.asarray(rows)
        truth = truth_of(_columns(infos)) if self._critic else None
        if dones.any():
            ended = np.flatnonzero(dones)
            self._translate_ends(infos, ended, truth if truth is None else truth[ended])
        self._memory = self.interface.remembered(self.rows, self._memory)
        if truth is not None:
            truth[dones] = 0.0
        return self._with_truth(self.interface.shown(self.rows, self._memory), truth), rewards, dones, infos

    def _with_truth(self, shown: np.ndarray, truth: np.ndarray | None) -> np.ndarray:
        """What is shown, and behind it what only the value is read from; no truth: that of a beginning."""
        if not self._critic:
            return shown
        n_whole = getattr(self.interface, "n_whole", self.interface.n_shown)
        own = np.zeros((len(shown), N_TRUTH), dtype=np.float32) if truth is None else truth
        mine = np.concatenate([own, shown[:, :n_whole]], axis=1)
        team = mine.reshape(-1, self._n_robots, mine.shape[1]).mean(axis=1).repeat(self._n_robots, axis=0)
        return np.concatenate([shown, own, team], axis=1, dtype=np.float32)

    def _translate_ends(
        self, infos: list[dict[str, Any]], ended: Int[np.ndarray, " ended"], truth: np.ndarray | None
    ) -> None:
        """Show last observations too, all at once."""
        rows = np.stack([infos[k]["terminal_observation"] for k in ended.tolist()])
        then = None if self._memory is None else type(self._memory)(*(each[ended] for each in self._memory))
        last = self._with_truth(self.interface.shown(rows, self.interface.remembered(rows, then)), truth)
        for k, shown in zip(ended.tolist(), last, strict=True):
            cut = infos[k]["TimeLimit.truncated"] and self._endless
            infos[k] = infos[k] | {"terminal_observation": shown, "TimeLimit.truncated": cut}


def n_for_critic(interface: Interface, critic: str) -> int:
    """Numbers that follow what a robot is shown."""
    n_whole = getattr(interface, "n_whole", interface.n_shown)
    return 2 * N_TRUTH + n_whole if pick(CRITICS, critic, "critic") else 0


def _columns(infos: Sequence[dict[str, Any]]) -> dict[str, list[float]]:
    """What is told of the truth, row by row."""
    return {name: [info[name] for info in infos] for name in TRUTHS}
