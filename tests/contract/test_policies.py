"""Scripted policies: what they see, what they return, what the paper says they do."""

import numpy as np
import pytest
from support.small_teams import KINDS

from baselines.policies import POLICIES, Oracle, make_policy
from envs.rendezvous_v0 import parallel_env
from wifipgo.scenarios import scenario_named


@pytest.mark.parametrize("scenario", KINDS)
@pytest.mark.parametrize("name", list(POLICIES))
def test_actions_are_in_their_space_and_repeat(name: str, scenario: str) -> None:
    env = parallel_env(scenario)
    policy = make_policy(name, env.scenario)
    runs = []
    for _ in range(2):
        observations, _ = env.reset(seed=4)
        policy.reset(4)
        for _ in range(3 if env.scenario.n_robots == 2 else 2):
            if isinstance(policy, Oracle):
                policy.see_truth(env.tick.truth.poses[:, -1])
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
    with pytest.raises(ValueError, match=r"greedy.*known: active, both_drive, .*, random, .*, vision"):
        make_policy("greedy", scenario_named("paper-hw-2"))


@pytest.mark.parametrize("name", sorted(POLICIES))
def test_unknown_parameter_lists_what_exists(name: str) -> None:
    with pytest.raises(ValueError, match=r"parameter of policy .*speed.*known"):
        make_policy(f"{name}:speed=3", scenario_named("paper-hw-2"))


@pytest.mark.parametrize(
    "spec", ["periodic:period=0", "covariance:spread_m=0", "frontier_home:release=2", "leapfrog:period=0"]
)
def test_values_that_cannot_mean_anything_are_refused(spec: str) -> None:
    with pytest.raises(ValueError, match=spec.split("=", maxsplit=1)[0]):
        make_policy(spec, scenario_named("paper-hw-2"))


def test_who_is_asked_first_does_not_matter() -> None:
    """A policy without chance of its own gives each robot the same action in any order."""
    env = parallel_env("paper-sim-2")
    observations, _ = env.reset(seed=3)
    backwards = dict(reversed(observations.items()))
    first, second = (make_policy("frontier", env.scenario).act(o) for o in (observations, backwards))
    for agent in observations:
        np.testing.assert_array_equal(first[agent], second[agent])


def test_only_an_oracle_is_shown_the_truth() -> None:
    scenario = scenario_named("paper-hw-2")
    shown = [name for name in POLICIES if isinstance(make_policy(name, scenario), Oracle)]
    assert shown == ["oracle_bearing"]
    blind = make_policy("oracle_bearing", scenario)
    with pytest.raises(RuntimeError, match="see_truth"):
        blind.act(observation_of())


def acted(spec: str, **blocks: float) -> np.ndarray:
    policy = make_policy(spec, scenario_named("paper-hw-2"))
    policy.reset(0)
    return policy.act(observation_of(**{"own/heading": 1.0} | blocks))["robot_0"]


def test_a_lost_robot_that_sees_another_drives_to_it_and_else_walks_on() -> None:
    lost = {"own/err": 2.0, "own/sighted_bearing": 1.0}
    seen = acted("vision", **lost, **{"own/sighted": 0.9})
    np.testing.assert_allclose(seen[:2], np.full(2, np.sqrt(0.5)), atol=1e-6)  # cos = sin = 1: 45 degrees
    dark = acted("vision", **lost, **{"own/sighted": 0.0})
    assert np.hypot(*(dark - seen)[:2]) > 1e-3
    assert seen[2] < 0.0


def test_frontier_home_turns_back_when_uncertain() -> None:
    """The start is at the origin and the robot in the far corner of its estimate, heading at 45 degrees."""
    far = {"own/position": 0.9, "own/start": 0.0, "survey": 0.0}
    home = acted("frontier_home", **far, **{"own/recorded_spread": 5.0})
    np.testing.assert_allclose(home[:2], [-1.0, 0.0], atol=1e-5)
    out = acted("frontier_home", **far, **{"own/recorded_spread": 0.1})
    assert np.hypot(*(out - home)[:2]) > 0.1


@pytest.mark.parametrize(
    ("spec", "blocks"),
    [
        ("periodic:period=5", {"own/since_met": 5 / 50}),
        ("covariance:spread_m=2", {"own/spread": 2.5}),
        ("frontier_active", {"own/err": 1.5}),
        ("frontier_home", {"own/err": 1.5}),
    ],
)
def test_triggers_call(spec: str, blocks: dict[str, float]) -> None:
    assert acted(spec, **blocks)[2] > 0.0
    assert acted(spec)[2] < 0.0


def test_a_frontier_is_where_nothing_was_seen() -> None:
    """All but one square are known: the robot heads for it."""
    env = parallel_env("paper-hw-2")
    observations = observation_of(**{"own/heading": 1.0, "survey": 1.0, "own/position": 0.5})
    survey = next(f for f in env.layout if f.name == "survey")
    observations["robot_0"][survey.start + 15 * 16 + 15] = 0.0
    policy = make_policy("frontier", env.scenario)
    np.testing.assert_allclose(policy.act(observations)["robot_0"][:2], [1.0, 0.0], atol=1e-5)
