"""What programs around the environment rely on: clipping, chance, attributes, numpy's error state."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from baselines.policies import POLICIES, Oracle, make_policy
from envs import rendezvous_v0

SMALL: dict[str, Any] = {"size_m": 4.0, "n_steps": 8}


@pytest.fixture
def raising() -> Iterator[None]:
    """A program that wants to hear of every rounding."""
    with np.errstate(all="raise"):
        yield


@pytest.mark.parametrize(
    "action",
    [
        np.array([0.1, 0.2, 0.3]),
        np.array([1.5, -7.0, 0.3], np.float32),
        [0, 1, -1],
        np.array([1.0, 0.0, -1.0], np.float16),
        np.array([3, 0, -3]),
    ],
    ids=["float64", "outside", "list", "float16", "int"],
)
def test_turns_take_what_the_parallel_form_takes(action: Any) -> None:
    turns, together = rendezvous_v0.env(**SMALL), rendezvous_v0.parallel_env(**SMALL)
    turns.reset(seed=1)
    together.reset(seed=1)
    for _ in together.possible_agents:
        turns.step(action)
    seen = together.step(dict.fromkeys(together.agents, action))[0]
    for agent, row in seen.items():
        np.testing.assert_array_equal(turns.observe(agent), row)


@pytest.mark.parametrize(
    ("actions", "action", "message"),
    [
        ("continuous", [0.0, np.nan, 0.0], r"actions\['robot_1'\] must be finite"),
        ("continuous", [0.0, 0.0], r"actions\['robot_1'\] must be of shape \(3,\), got \(2,\)"),
        ("continuous", None, r"actions\['robot_1'\] must be of shape \(3,\)"),
        ("continuous", 5, r"robot_1.*actions='continuous'"),
        ("discrete", [0.0, 0.0, 1.0], r"robot_1.*actions='discrete'"),
    ],
)
def test_a_turn_refuses_at_once_and_names_the_robot(actions: str, action: Any, message: str) -> None:
    env = rendezvous_v0.env(actions=actions, **SMALL)
    env.reset(seed=0)
    good = np.zeros(3) if actions == "continuous" else 3
    env.step(good)
    with pytest.raises(ValueError, match=message):
        env.step(action)
    env.step(good)  # still its turn
    assert env.unwrapped.tick.belief.t == 1


def test_wrappers_draw_from_a_stream_of_their_own() -> None:
    drawn, quiet = (rendezvous_v0.parallel_env(**SMALL) for _ in range(2))
    assert isinstance(drawn.np_random, np.random.Generator)
    firsts = []
    for seed in (3, 3, None, 4):
        rows, rows_quiet = drawn.reset(seed=seed)[0], quiet.reset(seed=seed)[0]
        firsts.append(drawn.np_random.random())
        np.testing.assert_equal(rows, rows_quiet)
        step = {a: np.full(3, 0.5) for a in drawn.agents}
        np.testing.assert_equal(drawn.step(step), quiet.step(step))
    assert firsts[0] == firsts[1]
    assert len(set(firsts)) == 3
    turns = rendezvous_v0.env(**SMALL)
    turns.reset(seed=3)
    assert turns.unwrapped.np_random.random() == firsts[0]


def test_what_is_not_there_before_the_first_reset_is_absent() -> None:
    env = rendezvous_v0.parallel_env()
    assert not hasattr(env, "tick")
    assert not hasattr(env, "world")
    assert getattr(env, "tick", None) is None
    with pytest.raises(RuntimeError, match="reset"):
        env.state()
    env.reset(seed=0)
    assert env.tick.belief.t == 0
    assert hasattr(env, "world")


@pytest.mark.parametrize("changes", [{}, {"sigma_t_m": 2.0, "sigma_r_rad": 1.5}, {"tx_power_dbm": 30.0}])
@pytest.mark.parametrize("n_robots", [2, 4])
def test_the_state_is_finite_and_within_bounds_of_order_one(n_robots: int, changes: dict[str, Any]) -> None:
    env = rendezvous_v0.parallel_env(n_robots=n_robots, n_slots=1, n_steps=30, **changes)
    space = env.state_space
    assert np.isfinite(space.low).all()
    assert np.isfinite(space.high).all()
    assert np.abs(np.stack([space.low, space.high])).max() <= 10.0
    env.reset(seed=0)
    rng = np.random.default_rng(0)
    assert space.contains(env.state())
    while env.agents:
        env.step({a: rng.uniform(-1, 1, 3) for a in env.agents})
        assert space.contains(env.state())


def test_the_state_is_what_its_table_says() -> None:
    env = rendezvous_v0.parallel_env("paper-sim-2", n_steps=5)
    env.reset(seed=2)
    env.step({a: np.array([0.4, 0.1, 1.0]) for a in env.agents})
    truth, belief, size_m = env.tick.truth.poses[1, -1], env.tick.belief, env.scenario.arena.size_m
    row = env.state()[9:18]
    np.testing.assert_allclose(row[:2], truth[:2] / size_m, rtol=1e-6)
    np.testing.assert_allclose(np.arctan2(row[3], row[2]), truth[2], atol=1e-6)
    np.testing.assert_allclose(row[4:6], belief.paths.estimate[1, -1, :2] / size_m, rtol=1e-6)
    np.testing.assert_allclose(np.arctan2(row[7], row[6]), belief.paths.estimate[1, -1, 2], atol=1e-6)
    assert row[8] == pytest.approx(belief.err[1] / env.scenario.rendezvous.err_threshold, rel=1e-6)
    rates = env.state()[18:].reshape(2, 2)
    np.testing.assert_allclose(rates, belief.radio.rate_mbit_s / 65.0, rtol=1e-6)


@pytest.mark.usefixtures("raising")
@pytest.mark.parametrize("policy", sorted(POLICIES))
def test_policies_and_episodes_do_not_heed_seterr(policy: str) -> None:
    env = rendezvous_v0.parallel_env("paper-hw-2-obstacles", n_steps=12, render_mode="rgb_array")
    driver = make_policy(policy, env.scenario)
    rows = env.reset(seed=1)[0]
    driver.reset(1)
    while env.agents:
        if isinstance(driver, Oracle):
            driver.see_truth(env.tick.truth.poses[:, -1])
        rows = env.step(driver.act(rows))[0]
        env.state()
    assert env.render() is not None


@pytest.mark.usefixtures("raising")
@pytest.mark.parametrize(
    "changes",
    [
        {"estimator": "every_step", "outliers": "bearing"},
        {"backend": "distributed"},
        {"aoa_estimator": "music"},
        {"sigma_t_m": 2.0, "sigma_r_rad": 1.5},
        {"tx_power_dbm": -60.0},
        {"n_robots": 4, "n_slots": 3},
        {"actions": "discrete", "observation": "dict"},
    ],
    ids=str,
)
def test_no_kind_of_scenario_heeds_seterr(changes: dict[str, Any]) -> None:
    env = rendezvous_v0.parallel_env("paper-hw-2", size_m=5.0, n_steps=10, **changes)
    env.reset(seed=1)
    rng = np.random.default_rng(0)
    whole = "actions" in changes
    while env.agents:
        env.step({a: int(rng.integers(34)) if whole else rng.uniform(-1, 1, 3) for a in env.agents})
