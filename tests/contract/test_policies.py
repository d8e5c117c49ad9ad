"""Scripted policies: what they see, what they return, what the paper says they do."""

import numpy as np
import pytest

from baselines.policies import POLICIES, make_policy
from envs.rendezvous_v0 import parallel_env
from wifipgo.scenarios import SCENARIOS, scenario_named


@pytest.mark.parametrize("scenario", list(SCENARIOS))
@pytest.mark.parametrize("name", list(POLICIES))
def test_actions_are_in_their_space_and_repeat(name: str, scenario: str) -> None:
    env = parallel_env(scenario)
    policy = make_policy(name, env.scenario)
    runs = []
    for _ in range(2):
        observations, _ = env.reset(seed=4)
        policy.reset(4)
        for _ in range(3):
            actions = policy.act(observations)
            assert all(env.action_space(a).contains(action) for a, action in actions.items())
            observations, *_ = env.step(actions)
        runs.append(np.concatenate(list(actions.values())))
    np.testing.assert_array_equal(runs[0], runs[1])


def test_random_never_calls_and_walks_like_active_until_somebody_does() -> None:
    env = parallel_env("paper-hw-2")
    observations, _ = env.reset(seed=0)
    walkers = [make_policy(name, env.scenario) for name in ("random", "active")]
    for walker in walkers:
        walker.reset(9)
    first, second = (np.stack(list(w.act(observations).values())) for w in walkers)
    np.testing.assert_array_equal(first, second)
    assert (first[:, 2] < 0.0).all()


def observation_of(**blocks: float) -> dict[str, np.ndarray]:
    """Two robots in the open that see each other, with some blocks of robot 0 set by hand."""
    env = parallel_env("paper-hw-2")
    row = np.zeros(sum(f.size for f in env.layout), np.float32)
    values = {"slot0/present": 1.0, "slot0/discrepancy": 1.0, "lidar": 1.0} | blocks
    for field in env.layout:
        row[field.where] = values.get(field.name, 0.0)
    return {"robot_0": row, "robot_1": row.copy()}


def act(**blocks: float) -> np.ndarray:
    policy = make_policy("active", scenario_named("paper-hw-2"))
    policy.reset(0)
    return policy.act(observation_of(**blocks))["robot_0"]


def test_a_lost_robot_calls_and_waits() -> None:
    """Algorithm 2: above the threshold it requests, and the called robot is the one that moves."""
    np.testing.assert_allclose(act(**{"own/err": 1.2}), [0.0, 0.0, 1.0])


def test_a_lost_robot_that_nobody_hears_walks_on() -> None:
    """Two that are out of each other's reach would otherwise wait for ever."""
    action = act(**{"own/err": 1.2, "slot0/present": 0.0})
    assert np.hypot(*action[:2]) > 0.5
    assert action[2] > 0.0


def test_a_called_robot_drives_along_the_strongest_path() -> None:
    """Algorithm 1: a full step towards the peak, here at the middle of bin 45."""
    env = parallel_env("paper-hw-2")
    observations = observation_of(**{"slot0/calls_me": 1.0})
    profile = next(f for f in env.layout if f.name == "slot0/profile")
    observations["robot_0"][profile.start + 45] = 1.0
    policy = make_policy("active", env.scenario)
    policy.reset(0)
    action = policy.act(observations)["robot_0"]
    bearing = -np.pi + 2.0 * np.pi / 72.0 * 45.5
    np.testing.assert_allclose(action[:2], [np.cos(bearing), np.sin(bearing)], atol=1e-6)
    assert action[2] < 0.0


def test_of_two_that_call_each_other_the_less_lost_comes() -> None:
    mutual = {"slot0/calls_me": 1.0, "slot0/i_call": 1.0, "own/err": 2.0}
    waits = act(**mutual, **{"slot0/err": 1.5})
    comes = act(**mutual, **{"slot0/err": 3.0})
    assert np.hypot(*waits[:2]) == 0.0
    assert np.hypot(*comes[:2]) == pytest.approx(1.0, abs=1e-6)


def test_unknown_policy_lists_what_exists() -> None:
    with pytest.raises(ValueError, match=r"greedy.*known: active, random"):
        make_policy("greedy", scenario_named("paper-hw-2"))
