"""PettingZoo's own tests for every scenario and both observation modes, and what those miss."""

import hashlib
import pickle
import subprocess
import sys

import numpy as np
import pytest
from pettingzoo.test import api_test, parallel_api_test, parallel_seed_test, seed_test

from envs import rendezvous_v0
from wifipgo.scenarios import SCENARIOS

SMALL = [name for name, scenario in SCENARIOS.items() if scenario.n_robots == 2]
MODES = ("flat", "dict")


def random_actions(env: rendezvous_v0.RendezvousEnv, rng: np.random.Generator) -> dict[str, np.ndarray]:
    return {a: rng.uniform(-1.0, 1.0, 3).astype(np.float32) for a in env.agents}


def trajectory_hash(scenario: str, seed: int, n_steps: int) -> str:
    """Hash of everything an episode hands out under seeded random actions."""
    env = rendezvous_v0.parallel_env(scenario=scenario)
    digests = [episode_hash(env, seed, n_steps), episode_hash(env, seed, n_steps)]
    assert digests[0] == digests[1], "a second reset(seed) gave another trajectory"
    return digests[0]


def episode_hash(env: rendezvous_v0.RendezvousEnv, seed: int, n_steps: int) -> str:
    digest, rng = hashlib.sha256(), np.random.default_rng(seed)
    observations, _ = env.reset(seed=seed)
    for _ in range(n_steps):
        for agent, row in observations.items():
            digest.update(agent.encode() + row.tobytes())
        observations, rewards, *_ = env.step(random_actions(env, rng))
        digest.update(repr(rewards).encode())
    return digest.hexdigest()


@pytest.mark.parametrize("observation", MODES)
@pytest.mark.parametrize("scenario", [*SMALL, "paper-sim-50"])
def test_pettingzoo_accepts_it(scenario: str, observation: str) -> None:
    many = scenario == "paper-sim-50"
    env = rendezvous_v0.parallel_env(scenario=scenario, observation=observation)
    parallel_api_test(env, num_cycles=5 if many else 60)
    if not many:
        parallel_seed_test(lambda: rendezvous_v0.parallel_env(scenario=scenario, observation=observation))


@pytest.mark.filterwarnings("ignore:Observation is not a NumPy array")
@pytest.mark.filterwarnings("ignore:Observation space for each agent probably should be")
@pytest.mark.parametrize("observation", MODES)
def test_the_aec_form_is_accepted(observation: str) -> None:
    api_test(rendezvous_v0.env(observation=observation), num_cycles=60)
    seed_test(lambda: rendezvous_v0.env(observation=observation))


@pytest.mark.parametrize("scenario", ["paper-hw-2", "paper-outliers"])
def test_fifty_steps_are_the_same_in_another_process(scenario: str) -> None:
    n_steps = 50 if scenario == "paper-hw-2" else 5
    code = (
        "import sys; sys.path.insert(0, 'tests/contract')\n"
        f"from test_environment import trajectory_hash; print(trajectory_hash({scenario!r}, 11, {n_steps}))"
    )
    other = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert other.stdout.strip() == trajectory_hash(scenario, 11, n_steps)


def test_seeds_and_episodes_differ() -> None:
    env = rendezvous_v0.parallel_env()
    first, _ = env.reset(seed=1)
    second, _ = env.reset()
    other, _ = env.reset(seed=2)
    rows = [np.concatenate(list(o.values())) for o in (first, second, other)]
    assert not np.array_equal(rows[0], rows[1])
    assert not np.array_equal(rows[0], rows[2])


@pytest.mark.parametrize("scenario", ["paper-hw-2-obstacles", "paper-outliers"])
def test_observations_stay_in_their_space(scenario: str) -> None:
    env, rng = rendezvous_v0.parallel_env(scenario=scenario), np.random.default_rng(0)
    for episode in range(6):
        observations, _ = env.reset(seed=episode)
        while env.agents:
            for agent, row in observations.items():
                assert env.observation_space(agent).contains(row)
            corner = rng.choice([-1.0, 1.0], 3).astype(np.float32)
            observations, *_ = env.step(dict.fromkeys(env.agents, corner))


def test_pickling_keeps_the_arguments() -> None:
    env = rendezvous_v0.parallel_env("paper-hw-2", n_obstacles=2, observation="dict", reward="team_error")
    copy = pickle.loads(pickle.dumps(env))
    assert copy.scenario == env.scenario
    assert copy.reset(seed=3)[0].keys() == env.reset(seed=3)[0].keys()


def test_spaces_are_the_same_object_each_time() -> None:
    env = rendezvous_v0.parallel_env()
    assert env.observation_space("robot_0") is env.observation_space("robot_0")
    assert env.action_space("robot_1") is env.action_space("robot_1")


def test_layout_covers_the_flat_observation_once() -> None:
    env = rendezvous_v0.parallel_env("paper-sim-50")
    used = np.concatenate([np.arange(f.where.start, f.where.stop) for f in env.layout])
    np.testing.assert_array_equal(used, np.arange(env.observation_space("robot_0").shape[0]))  # type: ignore[index]


def test_both_observation_modes_say_the_same() -> None:
    flat, by_name = rendezvous_v0.parallel_env(), rendezvous_v0.parallel_env(observation="dict")
    rows, blocks = flat.reset(seed=5)[0], by_name.reset(seed=5)[0]
    for agent, row in rows.items():
        np.testing.assert_array_equal(np.concatenate(list(blocks[agent].values())), row)


def test_outlier_scenario_ends_after_nine_measurements() -> None:
    env = rendezvous_v0.parallel_env("paper-outliers", size_m=4.0, n_steps=400)
    env.reset(seed=0)
    ended = False
    while env.agents:
        *_, terminated, truncated, _ = env.step({a: np.zeros(3, np.float32) for a in env.agents})
        ended = all(terminated.values())
        assert not any(truncated.values())
    assert ended
    assert env.tick.belief.edges.between_robots.sum() >= 9


def test_state_is_in_its_space() -> None:
    env = rendezvous_v0.parallel_env()
    env.reset(seed=0)
    assert env.state_space.contains(env.state())


@pytest.mark.parametrize(
    ("actions", "message"),
    [
        ({"robot_0": [0.0, 0.0, 0.0]}, r"robot_1.*must be given"),
        ({"robot_0": [0.0, float("nan"), 0.0], "robot_1": [0.0] * 3}, r"robot_0.*finite"),
        ({"robot_0": [0.0] * 3, "robot_1": [0.0] * 2}, r"robot_1.*shape \(3,\), got \(2,\)"),
        ({"robot_0": [0.0] * 3, "robot_1": [0.0] * 3, "robot_9": [0.0] * 3}, r"robot_9"),
    ],
)
def test_bad_actions_name_the_agent(actions: dict[str, list[float]], message: str) -> None:
    env = rendezvous_v0.parallel_env()
    env.reset(seed=0)
    with pytest.raises(ValueError, match=message):
        env.step(actions)
    env.step({a: np.zeros(3) for a in env.agents})  # nothing was lost


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"scenario": "paper-hw-3"}, r"paper-hw-3.*known:.*paper-hw-2-obstacles"),
        ({"n_obstacle": 4}, r"n_obstacle.*known:.*n_obstacles"),
        ({"observation": "image"}, r"image.*dict, flat"),
        ({"reward": "fame"}, r"fame.*known: error, mapped_share_belief, mapped_share_truth, team_error"),
        ({"render_mode": "ascii"}, r"render_mode"),
        ({"n_robots": 1}, r"n_robots must be >= 2"),
        ({"n_slots": 2}, r"n_slots must be in 1..1"),
        ({"n_obstacles": 2.5}, r"n_obstacles must be of type int"),
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
        ({"n_robots": 3}, r"n_robots.*set when the environment is made"),
        ({"n_slots": 1}, r"n_slots.*set when the environment is made"),
        ({"n_obstacles": -1}, r"ArenaConfig.n_obstacles must be >= 0, got -1"),
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
