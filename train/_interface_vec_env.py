"""A VecEnv as a network meets it: through an interface, see `baselines.policies.learned.interfaces`."""

from typing import Any

import numpy as np
from gymnasium import spaces
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper
from stable_baselines3.common.vec_env.base_vec_env import VecEnvObs, VecEnvStepReturn

from baselines.policies.learned.interfaces import Interface


class Translated(VecEnvWrapper):
    """Observations as the network is shown them, and its answers as actions.

    Args:
        venv: Rows of flat observations.
        interface: Translates.
        endless: Leave ends by the clock as they are reported, truncations, so that learners put the value
            of the last state there; else they are ends: nothing counts after them.

    Attributes:
        rows: Observations as the environment gave them, for those who want to see what robots see.
    """

    rows: np.ndarray

    def __init__(self, venv: VecEnv, interface: Interface, *, endless: bool = False) -> None:
        """Replace the spaces."""
        shown = spaces.Box(-np.inf, np.inf, (interface.n_shown,), np.float32)
        choices = interface.n_choices
        answers = spaces.MultiDiscrete(list(choices)) if choices else venv.action_space
        super().__init__(venv, shown, answers)
        self.interface, self._endless = interface, endless

    def reset(self) -> VecEnvObs:
        """Begin an episode everywhere."""
        self.rows = np.asarray(self.venv.reset())
        return self.interface.shown(self.rows)

    def step_async(self, actions: np.ndarray) -> None:
        """Hand out what the answers mean."""
        self.venv.step_async(self.interface.commands(actions, self.rows))

    def step_wait(self) -> VecEnvStepReturn:
        """What the step gave, as the network is shown it."""
        rows, rewards, dones, infos = self.venv.step_wait()
        self.rows = np.asarray(rows)
        if dones.any():
            self._translate_ends(infos, np.flatnonzero(dones).tolist())
        return self.interface.shown(self.rows), rewards, dones, infos

    def _translate_ends(self, infos: list[dict[str, Any]], ended: list[int]) -> None:
        """Show last observations too, all at once."""
        last = self.interface.shown(np.stack([infos[k]["terminal_observation"] for k in ended]))
        for k, shown in zip(ended, last, strict=True):
            cut = infos[k]["TimeLimit.truncated"] and self._endless
            infos[k] = infos[k] | {"terminal_observation": shown, "TimeLimit.truncated": cut}
