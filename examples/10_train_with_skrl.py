"""skrl: independent PPO, a policy for each robot, on many worlds behind Isaac Lab's interface.

Needs ``skrl``. Run: python examples/10_train_with_skrl.py
"""

from dataclasses import fields
from typing import Any

import torch
from skrl.envs.wrappers.torch import wrap_env
from skrl.memories.torch import RandomMemory
from skrl.multi_agents.torch import ExperimentCfg
from skrl.multi_agents.torch.ippo import IPPO, IPPO_CFG
from skrl.trainers.torch import SequentialTrainer
from skrl.utils import set_seed
from skrl.utils.model_instantiators.torch import deterministic_model, gaussian_model

from train.isaac_lab_env import RendezvousMarlEnv

WORLDS, STEPS = 8, 32  # enough to see it run past the ends of three episodes

set_seed(0)
worlds = RendezvousMarlEnv("paper-sim-2", num_envs=WORLDS, size_m=4.0, n_steps=10)
env = wrap_env(worlds, wrapper="isaaclab-multi-agent")
layers = [{"name": "net", "input": "OBSERVATIONS", "layers": [32], "activations": "tanh"}]
models, memories = {}, {}
for robot in env.possible_agents:
    spaces = {"observation_space": env.observation_space(robot), "action_space": env.action_space(robot)}
    models[robot] = {
        "policy": gaussian_model(**spaces, device=env.device, network=layers, output="ACTIONS"),
        "value": deterministic_model(**spaces, device=env.device, network=layers, output="ONE"),
    }
    memories[robot] = RandomMemory(memory_size=16, num_envs=WORLDS, device=env.device)
names = ("possible_agents", "observation_spaces", "state_spaces", "action_spaces", "device")
# skrl 2.1 takes its own empty dicts of options for ones that leave robots out
options = [field.name for field in fields(IPPO_CFG) if field.name.endswith("_kwargs")]
cfg: dict[str, Any] = {name: {robot: {} for robot in worlds.agents} for name in options}
cfg |= {"rollouts": 16, "experiment": ExperimentCfg(write_interval=0, checkpoint_interval=0)}
shared = {name: getattr(env, name) for name in names}
agent = IPPO(models=models, memories=memories, cfg=cfg, **shared)
quiet = {"timesteps": STEPS, "headless": True, "disable_progressbar": True}
SequentialTrainer(cfg=quiet, env=env, agents=agent).train()
seen = worlds.reset(seed=1)[0]
with torch.no_grad():
    for _ in range(10):  # to the end of an episode, whose infos are the last
        answers = {r: models[r]["policy"].act({"observations": seen[r]}, role="policy")[0] for r in seen}
        stepped = worlds.step(answers)
        seen = stepped[0]
cut, infos = stepped[3:]
print(f"{2 * WORLDS * STEPS} agent-steps; worlds whose time is up: {int(cut['robot_0'].sum())} of {WORLDS}")
print(f"mean mapped share: {infos['robot_0']['mapped_share_truth'].mean().item():.3f}")
worlds.close()
