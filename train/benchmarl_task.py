"""The worlds as a task of BenchMARL, which every algorithm of it then takes. Needs ``benchmarl``."""

from collections.abc import Callable
from functools import partial
from typing import Any

from benchmarl.environments.common import TaskClass
from torchrl.data import Composite
from torchrl.envs import EnvBase

from train.torchrl_env import RendezvousTorchEnv


class RendezvousTask(TaskClass):
    """Worlds that are stepped at once; ``config`` has arguments of `train.torchrl_env.RendezvousTorchEnv`."""

    def get_env_fun(
        self, num_envs: int, continuous_actions: bool, seed: int | None, device: Any
    ) -> Callable[[], EnvBase]:
        """A function that makes so many worlds."""
        actions = "continuous" if continuous_actions else "discrete"
        given = {"num_envs": num_envs, "seed": seed, "device": device, "actions": actions}
        return partial(RendezvousTorchEnv, **given, return_state=True, **self.config)

    def supports_continuous_actions(self) -> bool:
        """Waypoints are numbers."""
        return True

    def supports_discrete_actions(self) -> bool:
        """Or one of 34 choices, with a mask."""
        return True

    def max_steps(self, env: EnvBase) -> int:
        """Length of an episode."""
        return int(env.worlds.scenario.n_steps)

    def has_render(self, env: EnvBase) -> bool:
        """Where there is a render mode."""
        return self.config.get("render_mode") is not None

    def group_map(self, env: EnvBase) -> dict[str, list[str]]:
        """All robots are one group."""
        return dict(env.group_map)

    def observation_spec(self, env: EnvBase) -> Composite | None:
        """What a policy sees."""
        return env.robots_spec("observation")

    def info_spec(self, env: EnvBase) -> Composite | None:
        """What is said beside it."""
        return env.robots_spec("info")

    def action_mask_spec(self, env: EnvBase) -> Composite | None:
        """Choices that have an effect of their own, where actions are choices."""
        return env.robots_spec("action_mask")

    def state_spec(self, env: EnvBase) -> Composite:
        """What a centralised critic may look at."""
        return Composite({"state": env.full_observation_spec_unbatched["state"].clone()})

    def action_spec(self, env: EnvBase) -> Composite:
        """What robots answer."""
        return env.full_action_spec_unbatched

    @staticmethod
    def env_name() -> str:
        """Folder of its settings; there is none."""
        return "wifipgo"
