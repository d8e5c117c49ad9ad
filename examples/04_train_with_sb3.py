"""stable-baselines3 on the whole team: every robot is a row of one VecEnv, and all share one policy.

Needs the extra ``train``. Run: python examples/04_train_with_sb3.py
"""

from typing import Any

import numpy as np
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecMonitor

from envs.rendezvous_v0 import parallel_env
from train import rendezvous_vec_env

STEPS = 256  # enough to see it run; learning takes some 100 000
ROOM: dict[str, Any] = {"size_m": 4.0, "n_steps": 20}  # small, so that robots meet at once

if __name__ == "__main__":  # worker processes import this file
    # n_workers=2 steps the environments in two processes, with the same results.
    teams = VecMonitor(rendezvous_vec_env("paper-sim-2", n_envs=2, n_workers=0, **ROOM))
    model = PPO("MlpPolicy", teams, n_steps=64, batch_size=64, gamma=0.99, seed=0)
    model.learn(STEPS)
    returns = [episode["r"] for episode in model.ep_info_buffer or ()]
    print(f"{model.num_timesteps} agent-steps, mean return {np.mean(returns):.3f}")

    env = parallel_env("paper-sim-2", **ROOM)  # the policy drives a team of its own
    observations, infos = env.reset(seed=1)
    while env.agents:
        actions = model.predict(np.stack(list(observations.values())), deterministic=True)[0]
        stepped = env.step(dict(zip(env.agents, actions, strict=True)))
        observations, infos = stepped[0], stepped[4]
    print("mapped share:", round(infos["robot_0"]["mapped_share_truth"], 3))
    teams.close()
