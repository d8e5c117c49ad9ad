"""BenchMARL: many worlds at once under MAPPO with waypoints, then under QMIX with masked choices.

Needs ``benchmarl``. Run: python examples/07_benchmarl_task.py
"""

from benchmarl.algorithms import MappoConfig, QmixConfig
from benchmarl.experiment import Experiment, ExperimentConfig
from benchmarl.models.mlp import MlpConfig

from train.benchmarl_task import RendezvousTask


def settings() -> ExperimentConfig:
    """So few frames that it ends in a minute: eight worlds, each past the ends of three episodes."""
    config = ExperimentConfig.get_from_yaml()
    config.max_n_frames = config.on_policy_collected_frames_per_batch = 8 * 35
    config.off_policy_collected_frames_per_batch = 8 * 35
    config.on_policy_n_envs_per_worker = config.off_policy_n_envs_per_worker = 8
    config.on_policy_minibatch_size, config.on_policy_n_minibatch_iters = 70, 2
    config.off_policy_train_batch_size, config.off_policy_n_optimizer_steps = 70, 2
    config.off_policy_memory_size = 1000
    config.evaluation_episodes, config.evaluation_interval = 8, 8 * 35
    config.loggers, config.create_json, config.render, config.project_name = [], False, False, "rendezvous"
    return config


if __name__ == "__main__":
    task = RendezvousTask("RENDEZVOUS", {"scenario": "paper-sim-2", "size_m": 4.0, "n_steps": 10})
    mlp = MlpConfig.get_from_yaml()
    for name, algorithm in (("MAPPO", MappoConfig.get_from_yaml()), ("QMIX", QmixConfig.get_from_yaml())):
        experiment = Experiment(task, algorithm, mlp, seed=0, config=settings(), critic_model_config=mlp)
        experiment.run()
        print(f"{name}: {experiment.total_frames} frames, mean return {experiment.mean_return:.3f}")
