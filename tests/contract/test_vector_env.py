"""The environment of many worlds: shapes, spaces, buffers, pictures, and what it refuses."""

import copy
import pickle
from typing import Any

import numpy as np
import pytest

from envs.rendezvous_v0 import Buffers, RendezvousVectorEnv, vector_env

SMALL: dict[str, Any] = {"size_m": 7.0, "n_steps": 4}


def made(**arguments: Any) -> RendezvousVectorEnv:
    """Three worlds at their start."""
    env = vector_env(n_worlds=3, **SMALL, **arguments)
    env.reset(seed=0)
    return env


def test_results_are_arrays_within_the_spaces() -> None:
    env = vector_env("paper-sim-50", n_worlds=2, n_steps=3)
    observations, infos = env.reset(seed=0)
    step = env.step(np.zeros((2, 50, 3)))
    for seen in (observations, step.observations):
        assert seen.dtype == np.float32
        assert seen.shape[:2] == (2, 50)
        assert env.single_observation_space.contains(seen[1, 49])
    assert {x.shape for x in step[1:4]} == {(2, 50)}
    assert {name: x.shape for name, x in infos.items()} == {n: x.shape for n, x in step.infos.items()}
    assert all(x.shape[:2] == (2, 50) for x in infos.values())
    assert all(env.state_space.contains(one) for one in env.state())


def test_the_end_is_said_and_the_next_step_refused() -> None:
    env = made()
    for _ in range(4):
        assert not env.over.any()
        step = env.step(np.zeros((3, 2, 3)))
    assert env.over.all()
    assert step.truncations.all()
    assert not step.terminations.any()
    with pytest.raises(RuntimeError, match="all worlds are over: call reset"):
        env.step(np.zeros((3, 2, 3)))
    env.reset()
    assert not env.over.any()


def test_results_go_into_the_callers_buffers() -> None:
    plain = made()
    size = plain.single_observation_space.shape[0]  # type: ignore[index]
    rows = np.zeros((6, size), np.float32)  # flat rows, as some learners hold them
    flags = np.zeros((2, 3, 2), dtype=bool)
    buffers = Buffers(rows.reshape(3, 2, size), np.zeros((3, 2), np.float32), *flags)
    env = vector_env(n_worlds=3, buffers=buffers, **SMALL)
    seen, _ = env.reset(seed=0)
    assert seen is buffers.observations
    for _ in range(4):
        actions = np.full((3, 2, 3), 0.5)
        step, expected = env.step(actions), plain.step(actions)
        assert np.shares_memory(step.observations, rows)
        np.testing.assert_array_equal(rows, expected.observations.reshape(6, size))
        np.testing.assert_array_equal(buffers.rewards, expected.rewards.astype(np.float32))
        np.testing.assert_array_equal(buffers.truncations, expected.truncations)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ({"n_worlds": 0}, "n_worlds must be an integer >= 1, got 0"),
        ({"n_worlds": True}, "n_worlds must be an integer >= 1"),
        (
            {"n_worlds": 10**9},
            r"n_worlds must be such that all worlds fit in .* GB of memory, got 10{9}: about",
        ),
        ({"render_mode": "human"}, "render_mode must be None or 'rgb_array' for many worlds"),
        ({"reward": "money"}, "reward"),
        ({"n_wheels": 3}, "scenario field"),
    ],
)
def test_arguments_that_are_refused(arguments: dict[str, Any], says: str) -> None:
    with pytest.raises(ValueError, match=says):
        vector_env(**{"n_worlds": 2} | arguments)


@pytest.mark.parametrize(
    ("actions", "says"),
    [
        (np.zeros((3, 3)), r"actions must be of shape \(3, 2, 3\), got \(3, 3\)"),
        (np.zeros((2, 2, 3)), r"actions must be of shape \(3, 2, 3\)"),
        ([[[0.0]], [[0.0, 1.0]]], "actions must be of shape"),
        (np.full((3, 2, 3), np.nan), r"actions\[0, 0\] of world 0, robot_0 must be three finite numbers"),
    ],
)
def test_actions_that_are_refused(actions: Any, says: str) -> None:
    env = made()
    before = env.snapshot()
    with pytest.raises(ValueError, match=says):
        env.step(actions)
    assert pickle.dumps(env.snapshot().seeds) == pickle.dumps(before.seeds)
    env.step(np.zeros((3, 2, 3)))


def test_the_world_and_robot_of_a_bad_action_are_named() -> None:
    env, actions = made(), np.zeros((3, 2, 3))
    actions[2, 1, 0] = np.inf
    with pytest.raises(ValueError, match=r"actions\[2, 1\] of world 2, robot_1 must be three finite numbers"):
        env.step(actions)
    chosen = made(actions="discrete")
    with pytest.raises(ValueError, match=r"actions\[1, 0\] of world 1, robot_0 must be one choice in 0..33"):
        chosen.step(np.array([[0, 0], [34, 0], [0, 0]]))
    with pytest.raises(ValueError, match="one choice in"):
        chosen.step(np.full((3, 2), 0.5))


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"seed": -1}, "seed must be"),
        ({"seed": [1, 2]}, "seed must be 3 long, one a world, got 2"),
        ({"options": {"n_robots": 3}}, "set when the environment is made"),
        ({"options": {"n_wheels": 3}}, "scenario field"),
        ({"options": {"reset_mask": [True]}}, r"options\['reset_mask'\] must be 3 bools"),
        ({"options": {"reset_mask": np.zeros(3, dtype=bool)}}, r"reset_mask'\] must be True for some world"),
    ],
)
def test_resets_that_are_refused(given: dict[str, Any], says: str) -> None:
    env = made()
    env.step(np.zeros((3, 2, 3)))
    with pytest.raises(ValueError, match=says):
        env.reset(**given)
    assert env.cohorts[0].episode.tick.belief.t == 1  # the episodes before go on


def test_nothing_can_be_asked_before_the_first_reset() -> None:
    env = vector_env(n_worlds=2, **SMALL)
    for ask in (lambda: env.over, env.state, env.snapshot, lambda: env.step(np.zeros((2, 2, 3)))):
        with pytest.raises(RuntimeError, match="reset"):
            ask()
    with pytest.raises(ValueError, match="True for all at first"):
        env.reset(options={"reset_mask": np.array([True, False])})


def test_options_hold_for_one_reset() -> None:
    env = made()
    env.reset(seed=1, options={"n_obstacles": 2, "obstacle_max_m": 1.1, "clearance_m": 0.4})
    assert [len(layout.obstacles_m) for layout in env.cohorts[0].episode.world.layouts] == [2, 2, 2]
    env.reset(seed=1)
    assert not env.world_of(0).layout.obstacles_m


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_copies_are_made_of_the_arguments(copied: Any) -> None:
    env = made(actions="discrete", reward="team_error")
    twin = copied(env)
    assert (twin.n_worlds, twin.scenario) == (3, env.scenario)
    np.testing.assert_array_equal(twin.reset(seed=0)[0], env.reset(seed=0)[0])
    actions = np.full((3, 2), 20)
    np.testing.assert_array_equal(twin.step(actions).rewards, env.step(actions).rewards)


def test_pictures_of_one_world_and_of_all() -> None:
    env = made(render_mode="rgb_array", render_height_px=320)
    one, every = env.render(world=1), env.render()
    assert one is not None
    assert every is not None
    assert every.shape[0] > 2 * one.shape[0]
    height, width = one.shape[:2]
    np.testing.assert_array_equal(every[:height, width + 4 : 2 * width + 4], one)
    with pytest.raises(ValueError, match=r"world must be in 0\.\.2, got 3"):
        env.render(world=3)


def test_a_snapshot_of_something_else_is_refused() -> None:
    env, other = made(), vector_env(n_worlds=2, **SMALL)
    other.reset(seed=0)
    with pytest.raises(ValueError, match="snapshot must be of 3 worlds, got 2"):
        env.restore(other.snapshot())
    with pytest.raises(ValueError, match="snapshot must be what snapshot"):
        env.restore(3)


def test_a_large_team_steps() -> None:
    env = vector_env("paper-sim-200", n_worlds=1)
    env.reset(seed=0)
    step = env.step(np.zeros((1, 200, 3)))
    assert np.isfinite(step.infos["err"]).all()
