"""TorchRL's environment of many worlds: its own check, resets by mask, equality with worlds alone."""

from typing import Any

import numpy as np
import pytest

pytest.importorskip("torchrl", reason="not among the dependencies; see docs/frameworks.md")

import torch
from torchrl.envs.utils import check_env_specs

from envs.rendezvous_v0 import parallel_env
from train.torchrl_env import RendezvousTorchEnv

KINDS: dict[str, dict[str, Any]] = {
    "small": {"scenario": "paper-sim-2", "size_m": 4.0, "n_steps": 5},
    "with a state": {"scenario": "paper-sim-2", "size_m": 4.0, "n_steps": 5, "return_state": True},
    "choices": {"scenario": "paper-hw-2-obstacles", "n_steps": 4, "actions": "discrete"},
    "ends of their own": {"scenario": "paper-sim-2", "size_m": 4.0, "max_measurements": 6},
    "four robots": {"scenario": "paper-sim-2", "n_robots": 4, "n_slots": 3, "n_steps": 4},
}


@pytest.mark.parametrize("kind", KINDS)
def test_torchrl_accepts_it(kind: str) -> None:
    env = RendezvousTorchEnv(num_envs=2, seed=0, **KINDS[kind])
    check_env_specs(env)
    assert env.batch_size == (2,)
    assert env.group_map == {"robots": env.worlds.possible_agents}
    env.close()


@pytest.mark.parametrize("kind", KINDS)
def test_worlds_are_worlds_alone_past_their_ends(kind: str) -> None:
    arguments = dict(KINDS[kind])
    env = RendezvousTorchEnv(num_envs=2, seed=7, **arguments)
    torch.manual_seed(0)
    rollout = env.rollout(11, break_when_any_done=False)
    arguments.pop("return_state", None)
    for k in range(2):
        alone = parallel_env(**arguments)
        seen, _ = alone.reset(seed=7 + k)
        for t in range(11):
            now = rollout[k, t]
            np.testing.assert_array_equal(now["robots", "observation"], np.stack(list(seen.values())))
            if "state" in rollout.keys():  # noqa: SIM118
                np.testing.assert_array_equal(now["state"], alone.state())
            if "action_mask" in rollout["robots"].keys():  # noqa: SIM118
                np.testing.assert_array_equal(now["robots", "action_mask"], alone.action_masks())
            actions = dict(zip(alone.agents, now["robots", "action"].numpy(), strict=True))
            seen, rewards, ended, cut, infos = alone.step(actions)
            told = now["next", "robots"]
            np.testing.assert_array_equal(told["observation"], np.stack(list(seen.values())))
            np.testing.assert_array_equal(told["reward"][:, 0], np.array(list(rewards.values()), np.float32))
            for name in ("err", "met", "bumps_truth"):
                np.testing.assert_array_equal(
                    told["info", name], np.array([info[name] for info in infos.values()], np.float32)
                )
            flags = {"terminated": any(ended.values()), "truncated": any(cut.values())}
            for name, flag in (flags | {"done": not alone.agents}).items():
                assert now["next", name].item() == flag, (t, name)
            if not alone.agents:
                seen, _ = alone.reset()
    assert rollout["next", "done"].sum() >= 2


def test_only_worlds_of_a_mask_begin() -> None:
    env = RendezvousTorchEnv("paper-sim-2", num_envs=3, seed=0, n_steps=9)
    played = env.rollout(4)[:, -1]["next"]
    mask = torch.tensor([[False], [True], [False]])
    now = env.reset(played.clone().set("_reset", mask))
    same = (now["robots", "observation"] == played["robots", "observation"]).flatten(1).all(dim=1)
    assert same.tolist() == [True, False, True]
    with pytest.raises(ValueError, match="observation must be 'flat' for tensors, got 'dict'"):
        RendezvousTorchEnv(num_envs=2, observation="dict")


def test_a_seed_repeats_all_episodes() -> None:
    env = RendezvousTorchEnv("paper-sim-2", num_envs=2, n_steps=3, size_m=4.0)
    runs = []
    for _ in range(2):
        env.set_seed(4)
        torch.manual_seed(1)
        runs.append(env.rollout(8, break_when_any_done=False))
    assert (runs[0] == runs[1]).all()


def test_benchmarl_takes_the_task() -> None:
    pytest.importorskip("benchmarl", reason="not among the dependencies; see docs/frameworks.md")
    from train.benchmarl_task import RendezvousTask  # noqa: PLC0415

    task = RendezvousTask("RENDEZVOUS", {"scenario": "paper-sim-2", "n_steps": 4})
    for continuous in (True, False):
        env = task.get_env_fun(3, continuous, 0, "cpu")()
        assert env.batch_size == (3,)
        assert task.max_steps(env) == 4
        seen: Any = task.observation_spec(env)
        assert seen["robots", "observation"].shape == (2, 368)
        assert (task.action_mask_spec(env) is None) == continuous
        assert task.state_spec(env)["state"].shape == env.worlds.state_space.shape
