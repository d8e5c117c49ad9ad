"""Isaac Lab's multi-agent vector interface: dicts of tensors, ends, and what skrl makes of it."""

import numpy as np
import pytest
from support.kinds_of_worlds import KINDS

pytest.importorskip("torch", reason="training is an extra")

import torch

from envs.rendezvous_v0 import parallel_env
from train.isaac_lab_env import RendezvousMarlEnv


@pytest.mark.parametrize("kind", KINDS)
def test_worlds_are_worlds_alone_past_their_ends(kind: str) -> None:
    env, n = RendezvousMarlEnv(num_envs=2, **KINDS[kind]), 2
    alone = [parallel_env(**KINDS[kind]) for _ in range(n)]
    seen, _ = env.reset(seed=5)
    each = [one.reset(seed=5 + k)[0] for k, one in enumerate(alone)]
    env.action_spaces["robot_0"].seed(0)
    ends = 0
    for _ in range(9):
        actions = {a: np.array([env.action_spaces[a].sample() for _ in range(n)]) for a in env.agents}
        for k in range(n):
            for a in env.agents:
                np.testing.assert_array_equal(seen[a][k], each[k][a])
        np.testing.assert_array_equal(env.state(), np.stack([one.state() for one in alone]))
        seen, rewards, ended, cut, extras = env.step({a: torch.from_numpy(x) for a, x in actions.items()})
        for k, one in enumerate(alone):
            last, reward, over, out, infos = one.step({a: actions[a][k] for a in one.agents})
            each[k] = last
            for a in one.possible_agents:
                assert rewards[a][k] == pytest.approx(reward[a])
                assert (bool(ended[a][k]), bool(cut[a][k])) == (over[a], out[a])
                assert extras[a]["err"][k] == pytest.approx(infos[a]["err"])
                if not one.agents:
                    np.testing.assert_array_equal(extras[a]["final_observation"][k], last[a])
            if not one.agents:
                ends, each[k] = ends + 1, one.reset()[0]
    assert ends >= 2


def test_it_has_what_its_users_ask_for() -> None:
    env = RendezvousMarlEnv("paper-sim-2", num_envs=3, n_robots=4, n_slots=3)
    assert (env.num_envs, env.num_agents, env.max_num_agents) == (3, 4, 4)
    assert env.agents == env.possible_agents == [f"robot_{i}" for i in range(4)]
    assert env.unwrapped is env
    assert env.device == torch.device("cpu")
    seen, _ = env.reset(seed=0)
    assert {rows.shape for rows in seen.values()} == {(3, sum(field.size for field in env.worlds.layout))}
    with pytest.raises(ValueError, match="actions must be of all of"):
        env.step({"robot_0": torch.zeros(3, 3)})
    with pytest.raises(ValueError, match="observation must be 'flat' for tensors, got 'dict'"):
        RendezvousMarlEnv(num_envs=2, observation="dict")


@pytest.mark.parametrize("kind", ["small", "choices"])
def test_skrl_wraps_it(kind: str) -> None:
    pytest.importorskip("skrl", reason="not among the dependencies; see docs/frameworks.md")
    from skrl.envs.wrappers.torch import wrap_env  # noqa: PLC0415

    env = wrap_env(RendezvousMarlEnv(num_envs=3, **KINDS[kind]), wrapper="isaaclab-multi-agent")
    seen, _ = env.reset()
    ends = 0
    for _ in range(9):
        action = torch.zeros(3, 1, dtype=torch.int64) if kind == "choices" else torch.zeros(3, 3)
        seen, rewards, ended, cut, _ = env.step(dict.fromkeys(env.possible_agents, action))
        assert seen["robot_1"].shape == (3, *env.observation_spaces["robot_1"].shape)
        assert rewards["robot_0"].shape == ended["robot_0"].shape == cut["robot_0"].shape == (3, 1)
        assert env.state()["robot_0"].shape == (3, *env.state_space("robot_0").shape)
        ends += int(cut["robot_0"].sum())
    assert ends >= 6
