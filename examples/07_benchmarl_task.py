"""BenchMARL: the environment as a task class, which every algorithm of BenchMARL then takes.

Needs ``benchmarl``. Run: python examples/07_benchmarl_task.py
"""

from collections.abc import Callable
from functools import partial
from typing import Any

from benchmarl.algorithms import MappoConfig
from benchmarl.environments.pettingzoo.common import PettingZooClass
from benchmarl.experiment import Experiment, ExperimentConfig
from benchmarl.models.mlp import MlpConfig
from torchrl.envs import EnvBase, PettingZooWrapper

from envs.rendezvous_v0 import parallel_env


class RendezvousTask(PettingZooClass):
    """Scenario and overrides come from the task's config."""

    def get_env_fun(
        self, num_envs: int, continuous_actions: bool, seed: int | None, device: Any
    ) -> Callable[[], EnvBase]:
        """A function that makes one environment."""
        make = partial(parallel_env, **self.config)
        return lambda: PettingZooWrapper(make(), return_state=True, seed=seed, device=device)

    def supports_continuous_actions(self) -> bool:
        """Waypoints are numbers."""
        return True

    def supports_discrete_actions(self) -> bool:
        """Nothing to choose from."""
        return False

    def has_state(self) -> bool:
        """A centralised critic may look at it."""
        return True

    def max_steps(self, env: EnvBase) -> int:
        """Length of an episode."""
        return int(self.config["max_cycles"])


if __name__ == "__main__":
    config = ExperimentConfig.get_from_yaml()
    config.max_n_frames, config.on_policy_collected_frames_per_batch = 80, 40
    config.on_policy_minibatch_size, config.on_policy_n_minibatch_iters = 20, 1
    config.on_policy_n_envs_per_worker, config.evaluation_episodes, config.evaluation_interval = 2, 1, 40
    config.loggers, config.create_json, config.render, config.project_name = [], False, False, "rendezvous"
    task = RendezvousTask("RENDEZVOUS", {"scenario": "paper-sim-2", "size_m": 4.0, "max_cycles": 10})
    mappo, mlp = MappoConfig.get_from_yaml(), MlpConfig.get_from_yaml()
    experiment = Experiment(task, mappo, mlp, seed=0, config=config, critic_model_config=mlp)
    experiment.run()
    print(f"{experiment.total_frames} frames, mean return {experiment.mean_return:.3f}")
