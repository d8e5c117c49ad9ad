"""PettingZoo's own tests for every scenario and both observation modes, and what an episode promises."""

from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from pettingzoo.test import api_test, max_cycles_test, parallel_api_test, parallel_seed_test, seed_test
from support.small_teams import KINDS

from envs import rendezvous_v0
from wifipgo.scenarios import SCENARIOS

every_scenario = pytest.mark.parametrize("scenario", KINDS)
both_modes = pytest.mark.parametrize("observation", ["flat", "dict"])


def arguments(scenario: str, observation: str) -> dict[str, Any]:
    """What makes an environment; fifty robots get short episodes."""
    short: dict[str, Any] = {"n_steps": 3} if SCENARIOS[scenario].n_robots > 2 else {}
    return {"scenario": scenario, "observation": observation, **short}


@both_modes
@every_scenario
def test_pettingzoo_accepts_the_parallel_form(scenario: str, observation: str) -> None:
    make = partial(rendezvous_v0.parallel_env, **arguments(scenario, observation))
    parallel_api_test(make(), num_cycles=60)
    parallel_seed_test(make)


@pytest.mark.filterwarnings("ignore:Observation is not a NumPy array")
@pytest.mark.filterwarnings("ignore:Observation space for each agent probably should be")
@both_modes
@every_scenario
def test_pettingzoo_accepts_the_turn_based_form(scenario: str, observation: str) -> None:
    make = partial(rendezvous_v0.env, **arguments(scenario, observation))
    api_test(make(), num_cycles=60)
    seed_test(make, num_cycles=30)


@both_modes
@every_scenario
def test_pettingzoo_counts_the_cycles(scenario: str, observation: str) -> None:
    own: dict[str, Any] = {
        "scenario": scenario,
        "observation": observation,
        "max_measurements": 0,
    }  # only the clock ends it
    module = SimpleNamespace(
        parallel_env=partial(rendezvous_v0.parallel_env, **own), env=partial(rendezvous_v0.env, **own)
    )
    max_cycles_test(module)


def test_a_clock_by_both_names_is_refused() -> None:
    with pytest.raises(ValueError, match="max_cycles must be given without n_steps"):
        rendezvous_v0.parallel_env(max_cycles=3, n_steps=4)


def test_seeds_and_episodes_differ() -> None:
    env = rendezvous_v0.parallel_env()
    first, _ = env.reset(seed=1)
    second, _ = env.reset()
    other, _ = env.reset(seed=2)
    rows = [np.concatenate(list(o.values())) for o in (first, second, other)]
    assert not np.array_equal(rows[0], rows[1])
    assert not np.array_equal(rows[0], rows[2])


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
    assert env.tick.belief.log.edges.between_robots.sum() >= 9


def test_state_is_in_its_space() -> None:
    env = rendezvous_v0.parallel_env()
    env.reset(seed=0)
    assert env.state_space.contains(env.state())
