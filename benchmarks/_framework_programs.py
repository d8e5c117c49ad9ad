"""Learning frameworks and the short program that each trains with, past a meeting, on this environment.

A program runs in a process of its own, in an environment that has the framework; it prints
``agent-steps N`` when its updates are done. Robots in a room of 4 m meet every few iterations, so infos,
masks and ends of episodes all pass through the learner.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

_MAKE = """
import numpy as np
from envs.rendezvous_v0 import parallel_env
ROOM = dict(scenario="paper-sim-2", size_m=4.0, n_steps=20)

def meets():
    env = parallel_env(**ROOM)
    env.reset(seed=0)
    n = 0
    while env.agents:
        *_, infos = env.step({a: np.zeros(3) for a in env.agents})
        n += any(info["met"].any() for info in infos.values())
    return n
assert meets(), "nobody met"
"""


class Framework(NamedTuple):
    """What is installed for a framework, and what it then runs.

    Attributes:
        package: Distribution whose version is told.
        needs: What pip installs.
        program: Python, run after a preamble that defines ``parallel_env`` and ``ROOM``.
    """

    package: str
    needs: tuple[str, ...]
    program: str


_SB3 = """
from stable_baselines3 import PPO
from train import rendezvous_vec_env
teams = rendezvous_vec_env(n_envs=8, **ROOM)
model = PPO("MlpPolicy", teams, n_steps=32, batch_size=64, seed=0).learn(1024)
print("agent-steps", model.num_timesteps)
"""
_MASKED = """
from sb3_contrib import MaskablePPO
from train import rendezvous_vec_env
teams = rendezvous_vec_env(n_envs=8, actions="discrete", **ROOM)
model = MaskablePPO("MlpPolicy", teams, n_steps=32, batch_size=64, seed=0).learn(1024)
print("agent-steps", model.num_timesteps)
"""
_GYMNASIUM = """
import gymnasium, envs
teams = gymnasium.make_vec("wifipgo/RendezvousTeam-v0", num_envs=8, **ROOM)
teams.reset(seed=0)
for _ in range(60):
    teams.step(teams.action_space.sample())
print("agent-steps", 60 * 8 * 2)
"""
_PETTINGZOO = """
from pettingzoo.test import api_test, parallel_api_test
from envs import rendezvous_v0
for actions in ("continuous", "discrete"):
    parallel_api_test(parallel_env(actions=actions, **ROOM), num_cycles=60)
    api_test(rendezvous_v0.env(actions=actions, **ROOM), num_cycles=60)
print("agent-steps", 4 * 60)
"""
_SUPERSUIT = """
import supersuit
from stable_baselines3 import PPO
env = supersuit.pettingzoo_env_to_vec_env_v1(supersuit.frame_skip_v0(parallel_env(**ROOM), 2))
teams = supersuit.concat_vec_envs_v1(env, 1, base_class="stable_baselines3")
model = PPO("MlpPolicy", teams, n_steps=32, batch_size=64).learn(256)
print("agent-steps", model.num_timesteps)
"""
_TORCHRL = """
import runpy
runpy.run_path("examples/06_collect_with_torchrl.py", run_name="__main__")
print("agent-steps", 4 * 25 * 8 * 2)
"""
_BENCHMARL = """
import runpy
runpy.run_path("examples/07_benchmarl_task.py", run_name="__main__")
print("agent-steps", 2 * 2 * 280)
"""
_SKRL = """
import runpy
runpy.run_path("examples/10_train_with_skrl.py", run_name="__main__")
print("agent-steps", 2 * 8 * 32)
"""
_RLLIB = """
import runpy
runpy.run_path("examples/05_train_with_rllib.py", run_name="__main__")
print("agent-steps", 2 * 80)
"""
_TIANSHOU = """
from pettingzoo.utils.conversions import parallel_to_aec
from tianshou.data import Batch
from tianshou.env import DummyVectorEnv, PettingZooEnv
make = lambda: PettingZooEnv(parallel_to_aec(parallel_env(actions="discrete", observation="dict", **ROOM)))
teams, rng = DummyVectorEnv([make]), np.random.default_rng(0)
seen, _ = teams.reset()
for _ in range(60):
    mask = np.asarray(seen[0]["mask"], dtype=bool)
    seen, _, ended, cut, infos = teams.step(np.array([rng.choice(np.flatnonzero(mask))]))
    Batch.stack([Batch(infos[0]), Batch(infos[0])])
    if ended[0] or cut[0]:
        seen, _ = teams.reset()
print("agent-steps", 60)
"""
FRAMEWORKS: Mapping[str, Framework] = MappingProxyType(
    {
        "pettingzoo": Framework("pettingzoo", (), _PETTINGZOO),
        "gymnasium": Framework("gymnasium", (), _GYMNASIUM),
        "sb3": Framework("stable-baselines3", ("stable-baselines3",), _SB3),
        "sb3-contrib": Framework("sb3-contrib", ("sb3-contrib",), _MASKED),
        "supersuit": Framework("supersuit", ("supersuit", "stable-baselines3"), _SUPERSUIT),
        "torchrl": Framework("torchrl", ("torchrl",), _TORCHRL),
        "benchmarl": Framework("benchmarl", ("benchmarl", "torchrl<0.12"), _BENCHMARL),
        "skrl": Framework("skrl", ("skrl", "tensorboard"), _SKRL),
        "rllib": Framework("ray", ("ray[rllib]", "dm-tree", "torch"), _RLLIB),
        "tianshou": Framework("tianshou", ("tianshou",), _TIANSHOU),
    }
)


def whole_program(name: str) -> str:
    """A framework's program with its preamble."""
    return _MAKE + FRAMEWORKS[name].program
