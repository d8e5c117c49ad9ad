"""TorchRL: many worlds are one batch of tensors; rollouts past the ends of episodes, then a fitted value.

Needs ``torchrl``. Run: python examples/06_collect_with_torchrl.py
"""

import torch
from tensordict.nn import TensorDictModule
from torchrl.modules import MultiAgentMLP

from train.torchrl_env import RendezvousTorchEnv

torch.manual_seed(0)
env = RendezvousTorchEnv("paper-sim-2", num_envs=8, size_m=4.0, n_steps=10, return_state=True, seed=0)

rollout = env.rollout(25, break_when_any_done=False)  # worlds that end begin anew
print("observations of (worlds, steps, robots, numbers):", tuple(rollout["robots", "observation"].shape))
print("states of (worlds, steps, numbers):", tuple(rollout["state"].shape))
print("episodes that ended:", int(rollout["next", "done"].sum()))
print("mean reward of random actions:", round(rollout["next", "robots", "reward"].mean().item(), 3))

n_numbers = env.full_observation_spec_unbatched["robots", "observation"].shape[-1]
n_robots, n_moves = env.full_action_spec_unbatched["robots", "action"].shape
layers = {"centralized": False, "share_params": True, "num_cells": (32,)}
network = MultiAgentMLP(n_numbers, n_moves, n_robots, **layers)
policy = TensorDictModule(
    lambda seen: torch.tanh(network(seen)),
    in_keys=[("robots", "observation")],
    out_keys=[("robots", "action")],
)
value = MultiAgentMLP(n_numbers, 1, n_robots, **layers)
optimiser = torch.optim.Adam(value.parameters(), lr=0.001)
for _ in range(3):
    with torch.no_grad():
        batch = env.rollout(25, policy, break_when_any_done=False)
    loss = (value(batch["robots", "observation"]) - batch["next", "robots", "reward"]).square().mean()
    optimiser.zero_grad()
    loss.backward()
    optimiser.step()
    print(f"squared error of a value of the next reward: {loss.item():.4f}")
env.close()
