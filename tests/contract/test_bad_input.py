"""What the environment is asked for and cannot do: the message names the field, the rule and the value."""

import subprocess
import sys

import numpy as np
import pytest

from envs import rendezvous_v0


@pytest.mark.parametrize(
    ("actions", "message"),
    [
        ({"robot_0": [0.0, 0.0, 0.0]}, r"robot_1.*must be given"),
        ({"robot_0": [0.0, float("nan"), 0.0], "robot_1": [0.0] * 3}, r"robot_0.*finite"),
        ({"robot_0": [0.0] * 3, "robot_1": [0.0] * 2}, r"robot_1.*shape \(3,\), got \(2,\)"),
        ({"robot_0": [0.0] * 3, "robot_1": [0.0] * 3, "robot_9": [0.0] * 3}, r"robot_9"),
        ({"robot_0": [0.0] * 3, "robot_1": [0.0, -float("inf"), 0.0]}, r"robot_1.*finite, got \[0.0, -inf"),
        ({"robot_0": [0.0] * 3, "robot_1": ["a", "b", "c"]}, r"robot_1.*three numbers, got \['a'"),
        ({"robot_0": [0.0] * 3, "robot_1": None}, r"robot_1.*shape \(3,\), got \(\)"),
        ({}, r"robot_0.*must be given"),
        ({"robot_0": [0.0] * 3, "robot_1": ["1", "2", "3"]}, r"robot_1.*three numbers, got \['1'"),
        ({"robot_0": np.zeros(3), "robot_1": np.zeros(3) + 1j}, r"robot_1.*three numbers, got array"),
        ({"robot_0": [0.0] * 3, "robot_1": [10**400, 0, 0]}, r"robot_1.*three numbers, got \[1000"),
        ({"robot_0": [0.0] * 3, "robot_1": [np.datetime64("2026")] * 3}, r"robot_1.*three numbers"),
    ],
)
def test_bad_actions_name_the_agent(actions: object, message: str) -> None:
    env = rendezvous_v0.parallel_env()
    env.reset(seed=0)
    with pytest.raises(ValueError, match=message):
        env.step(actions)  # type: ignore[arg-type]
    env.step({a: np.zeros(3) for a in env.agents})  # nothing was lost


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"scenario": "paper-hw-3"}, r"paper-hw-3.*known:.*paper-hw-2-obstacles"),
        ({"n_obstacle": 4}, r"n_obstacle.*known:.*n_obstacles"),
        (
            {"observations": "dict"},
            r"field .observations.; known:.*, observation, .*render_mode, .*reward",
        ),
        ({"observation": "image"}, r"image.*dict, flat"),
        ({"reward": "fame"}, r"fame.*known: error, mapped_share_belief, mapped_share_truth, team_error"),
        ({"render_mode": "ascii"}, r"render_mode"),
        ({"n_robots": 1}, r"n_robots must be in 2..1000"),
        ({"n_slots": 2}, r"n_slots must be in 1..1"),
        ({"n_obstacles": 2.5}, r"n_obstacles must be of type int"),
        ({"n_robots": 10**9}, r"Scenario.n_robots must be in 2..1000.*got 1000000000"),
        ({"size_m": 1e100}, r"ArenaConfig.size_m must be in 0.1..2000, got 1e\+100"),
        ({"size_m": 10**400}, r"size_m must be finite"),
        ({"n_substeps": 10**9}, r"ArenaConfig.n_substeps must be in 1..10000"),
        ({"obstacle_density": 1e-300}, r"ArenaConfig.obstacle_density must be 0 or at least 1e-09"),
        ({"sigma_t_m": 1e300}, r"SensingConfig.sigma_t_m must be in 0..10000, got"),
        (
            {"sigma_r_rad": 1.0, "sigma_t_m": 0.0, "noise_scale": (1e5, 1.0)},
            r"SensingConfig.sigma_r_rad must be at most",
        ),
        ({"sensor_range_m": 1e300}, r"SensingConfig.sensor_range_m must be in 0..1e\+06"),
    ],
)
def test_bad_arguments_list_what_exists(arguments: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        rendezvous_v0.parallel_env(**arguments)  # type: ignore[arg-type]


def test_options_hold_for_one_episode() -> None:
    """A curriculum goes up and down; an episode without options is that of the scenario."""
    env = rendezvous_v0.parallel_env()
    counts = [{"n_obstacles": 1}, {"n_obstacles": 4}, {"n_obstacles": 2}, None, {"n_obstacles": np.int64(3)}]
    found = []
    for options in counts:
        env.reset(seed=2, options=options)
        env.step({a: np.zeros(3) for a in env.agents})
        found.append(len(env.world.layout.obstacles_m))
    assert found == [1, 4, 2, 0, 3]
    assert env.base_scenario == rendezvous_v0.parallel_env().scenario


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"n_robots": 3}, r"n_robots.*set when the environment is made, got 3"),
        ({"size_m": 0.5}, r"size_m must be more than four times robot_radius_m \(0.15\) for random"),
        ({"n_slots": 1}, r"n_slots.*set when the environment is made"),
        ({"n_obstacles": -1}, r"ArenaConfig.n_obstacles must be in 0..5000, got -1"),
        ({"n_obstacles": 900}, r"ArenaConfig.n_obstacles must be at most what fits"),
        ({"size_m": float("nan")}, r"size_m must be finite, got nan"),
        ({"n_obstacle": 1}, r"unknown scenario field .n_obstacle.; known: .*n_obstacles"),
    ],
)
def test_what_is_refused_leaves_the_episode(options: dict[str, object], message: str) -> None:
    """The episode goes on, and the next one is the same as if nobody had asked."""
    env, other = rendezvous_v0.parallel_env(), rendezvous_v0.parallel_env()
    for one in (env, other):
        one.reset(seed=0)
    with pytest.raises(ValueError, match=message):
        env.reset(options=options)
    with pytest.raises(ValueError, match=message):
        env.reset(seed=9, options=options)
    env.step({a: np.zeros(3) for a in env.agents})
    assert env.scenario == env.base_scenario
    np.testing.assert_array_equal(env.reset()[0]["robot_0"], other.reset()[0]["robot_0"])


def test_reset_options_are_scenario_fields() -> None:
    env = rendezvous_v0.parallel_env()
    env.reset(seed=0, options={"n_obstacles": 3})
    assert len(env.world.layout.obstacles_m) == 3
    with pytest.raises(ValueError, match="n_robots"):
        env.reset(options={"n_robots": 5})
    with pytest.raises(ValueError, match="walls"):
        env.reset(options={"walls": 5})


def test_stepping_out_of_turn_is_an_error() -> None:
    env = rendezvous_v0.parallel_env(n_steps=1)
    with pytest.raises(RuntimeError, match="reset"):
        env.step({})
    env.reset(seed=0)
    env.step({a: np.zeros(3) for a in env.agents})
    with pytest.raises(RuntimeError, match="over"):
        env.step({})


def test_bad_seeds() -> None:
    with pytest.raises(ValueError, match="seed must be None or an integer >= 0, got -1"):
        rendezvous_v0.parallel_env().reset(seed=-1)


def test_wrong_types_are_named_without_the_checks_of_a_test_run() -> None:
    code = """
import numpy as np
from envs.rendezvous_v0 import parallel_env
from baselines.policies import make_policy
env = parallel_env()
env.reset(seed=0)
blocks = parallel_env(observation="dict").reset(seed=0)[0]
for call in (lambda: env.step(np.zeros((2, 3))), lambda: env.reset(seed=1.5), lambda: env.reset(seed="7"),
             lambda: env.reset(seed=True), lambda: env.reset(options=["n_obstacles"]),
             lambda: env.reset(options={1: 2}), lambda: parallel_env(None),
             lambda: parallel_env(reward=["error"]), lambda: parallel_env(render_height_px="608"),
             lambda: env.action_space("robot_2"), lambda: env.observation_space(0),
             lambda: parallel_env(terminate_at_end=1), lambda: parallel_env(actions=None),
             lambda: make_policy("active", env.scenario).act(blocks)):
    try:
        call()
    except ValueError as problem:
        print(problem)
"""
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert out.splitlines() == [
        "actions must be a mapping from agents to actions, got 'ndarray'",
        "seed must be None or an integer >= 0, got 1.5",
        "seed must be None or an integer >= 0, got '7'",
        "seed must be None or an integer >= 0, got True",
        "options must be None or a mapping, got ['n_obstacles']",
        "options must be a mapping from names of scenario fields, got {1: 2}",
        "scenario must be a name, a file that ends in .toml, or a Scenario, got None",
        "unknown reward ['error']; known: error, mapped_share_belief, mapped_share_truth, team_error",
        "RenderConfig.height_px must be of type int, got '608'",
        "unknown agent 'robot_2'; known: robot_0, robot_1",
        "unknown agent 0; known: robot_0, robot_1",
        "terminate_at_end must be True or False, got 1",
        "unknown form of actions None; known: continuous, discrete",
        "observations must be flat arrays (observation='flat') for a policy, got 'dicts'",
    ]
