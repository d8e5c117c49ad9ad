"""TorchRL: the robots are one group of tensors; a rollout under random actions, then under a shared network.

Needs ``torchrl``. Run: python examples/06_collect_with_torchrl.py
"""

import torch
from tensordict.nn import TensorDictModule
from torchrl.envs import PettingZooWrapper
from torchrl.modules import MultiAgentMLP

from envs.rendezvous_v0 import parallel_env

torch.manual_seed(0)
env = PettingZooWrapper(parallel_env("paper-sim-2", size_m=4.0, n_steps=20), return_state=True)
env.set_seed(0)

rollout = env.rollout(20)
print("observations of (steps, robots, numbers):", tuple(rollout["robot", "observation"].shape))
print("mean return under random actions:", round(rollout["next", "robot", "reward"].sum(0).mean().item(), 3))
print(
    "cut by the clock, not ended:",
    bool(rollout["next", "truncated"][-1]),
    bool(rollout["next", "terminated"][-1]),
)

n_numbers = env.observation_spec["robot", "observation"].shape[-1]
n_robots, n_moves = env.full_action_spec["robot", "action"].shape
network = MultiAgentMLP(n_numbers, n_moves, n_robots, centralized=False, share_params=True, num_cells=(32,))
policy = TensorDictModule(
    lambda seen: torch.tanh(network(seen)),
    in_keys=[("robot", "observation")],
    out_keys=[("robot", "action")],
)
with torch.no_grad():
    rollout = env.rollout(20, policy)
print(
    "mean return of an untrained network:", round(rollout["next", "robot", "reward"].sum(0).mean().item(), 3)
)
env.close()
