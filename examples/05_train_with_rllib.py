"""RLlib on the parallel environment: one policy for all robots, one iteration of PPO.

Needs the extra ``rllib``. Run: python examples/05_train_with_rllib.py
"""

import os

os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")  # nothing is sent anywhere
os.environ.setdefault("RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0")

import ray
from ray.rllib.algorithms.ppo import PPOConfig
from ray.rllib.env.wrappers.pettingzoo_env import ParallelPettingZooEnv
from ray.tune.registry import register_env

from envs.rendezvous_v0 import parallel_env

register_env("rendezvous", lambda config: ParallelPettingZooEnv(parallel_env(**config)))
config = (
    PPOConfig()
    .environment("rendezvous", env_config={"scenario": "paper-sim-2", "size_m": 4.0, "n_steps": 20})
    .env_runners(num_env_runners=0)  # > 0: processes that collect, here or on a cluster
    .multi_agent(policies={"robot"}, policy_mapping_fn=lambda agent, episode, **_: "robot")
    .training(train_batch_size_per_learner=80, minibatch_size=40, num_epochs=2, gamma=0.99)
    .debugging(seed=0)
)
ray.init(num_cpus=1, include_dashboard=False, log_to_driver=False)
algorithm = config.build_algo()
result = algorithm.train()
runners = result["env_runners"]
print(f"{runners['num_env_steps_sampled']:.0f} steps of the team, {runners['num_episodes']:.0f} episodes")
print(f"mean return of the team {runners['episode_return_mean']:.3f}")
algorithm.stop()
ray.shutdown()
