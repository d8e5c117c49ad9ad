"""PufferLib's environment: flat rows, written in place, with or without PufferLib."""

import numpy as np
import pytest
from support.kinds_of_worlds import KINDS

from envs.puffer_env import RendezvousPufferEnv
from envs.rendezvous_v0 import parallel_env


@pytest.mark.parametrize("kind", KINDS)
def test_rows_are_worlds_alone_past_their_ends(kind: str) -> None:
    env, n = RendezvousPufferEnv(num_worlds=2, **KINDS[kind]), 2
    alone = [parallel_env(**KINDS[kind]) for _ in range(n)]
    env.reset(seed=5)
    each = [list(one.reset(seed=5 + k)[0].values()) for k, one in enumerate(alone)]
    env.single_action_space.seed(0)
    ends, returns = 0, np.zeros(n)
    for _ in range(9):
        np.testing.assert_array_equal(env.observations, np.concatenate(each))
        actions = np.array([env.single_action_space.sample() for _ in range(env.num_agents)])
        *_, told = env.step(actions)
        over = []
        for k, one in enumerate(alone):
            rows = slice(2 * k, 2 * k + 2)
            seen, rewards, ended, cut, _ = one.step(dict(zip(one.agents, actions[rows], strict=True)))
            np.testing.assert_array_equal(env.rewards[rows], np.array(list(rewards.values()), np.float32))
            np.testing.assert_array_equal(env.terminals[rows], list(ended.values()))
            np.testing.assert_array_equal(env.truncations[rows], list(cut.values()))
            returns[k] += np.mean(list(rewards.values()))
            each[k] = list(seen.values())
            if not one.agents:
                each[k] = list(one.reset()[0].values())
                over.append(returns[k])
                returns[k] = 0.0
        assert len(told) == bool(over)
        if over:
            ends += len(over)
            assert told[0]["episode_return"] == pytest.approx(np.mean(over))
    assert ends >= 2


@pytest.mark.skipif(RendezvousPufferEnv.__base__ is not object, reason="PufferLib makes the buffers itself")
def test_buffers_are_the_caller_s() -> None:
    observations, rewards = np.zeros((4, 368), np.float32), np.ones(4, np.float32)
    env = RendezvousPufferEnv(
        "paper-sim-2", num_worlds=2, buf={"observations": observations, "rewards": rewards}, seed=3
    )
    env.reset()
    assert env.observations is observations
    assert env.rewards is rewards
    assert not rewards.any()
    first = observations.copy()
    assert first.any()
    env.step(np.ones((4, 3), np.float32))
    assert not np.array_equal(first, observations)
    with pytest.raises(ValueError, match="observation must be 'flat' for rows, got 'dict'"):
        RendezvousPufferEnv(observation="dict")
    env.close()


def test_pufferlib_makes_it() -> None:
    pufferlib = pytest.importorskip("pufferlib", reason="not among the dependencies; see docs/frameworks.md")
    vector = pytest.importorskip("pufferlib.vector")
    teams = vector.make(
        RendezvousPufferEnv, env_kwargs=KINDS["small"] | {"num_worlds": 3}, backend=pufferlib.PufferEnv
    )
    teams.async_reset(0)
    for _ in range(9):
        seen, rewards, *_ = teams.recv()
        assert (seen.shape, rewards.shape) == ((6, 368), (6,))
        teams.send(np.zeros((6, 3), np.float32))
    teams.close()
