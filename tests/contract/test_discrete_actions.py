"""One choice of 34: what it means, what its mask says, and that learners find it where they look."""

from typing import Any

import numpy as np
import pytest
from gymnasium import spaces
from pettingzoo.test import api_test, parallel_api_test

from baselines.policies import make_policy
from baselines.policies.learned.ray_interface import Rays
from envs import rendezvous_v0
from envs.directions import N_CHOICES, STAY, choice_mask, waypoints_of
from envs.rendezvous_v0 import RendezvousEnv, RendezvousTeamEnv, parallel_env

WALLED: dict[str, Any] = {
    "n_obstacles": 4,
    "size_m": 8.0,
    "obstacle_max_m": 1.2,
    "clearance_m": 0.5,
    "n_steps": 40,
}


def choices(**changes: Any) -> RendezvousEnv:
    """An environment of choices with much in the way."""
    return parallel_env("paper-hw-2", actions="discrete", **{**WALLED, **changes})


def played(env: RendezvousEnv, seed: int, actions: list[dict[str, int]]) -> RendezvousEnv:
    """The same after some steps."""
    env.reset(seed=seed)
    for action in actions:
        env.step(action)
    return env


@pytest.mark.parametrize("observation", ["flat", "dict"])
def test_pettingzoo_accepts_choices(observation: str) -> None:
    parallel_api_test(choices(observation=observation), num_cycles=25)
    api_test(rendezvous_v0.env(actions="discrete", n_steps=20), num_cycles=30)


def test_spaces_are_those_that_learners_know() -> None:
    env = choices(observation="dict")
    assert env.action_space("robot_0") == spaces.Discrete(34)
    seen, infos = env.reset(seed=0)
    pair = seen["robot_1"]
    assert set(pair) == {"observation", "action_mask"}
    assert env.observation_space("robot_1").contains(pair)
    np.testing.assert_array_equal(pair["action_mask"], infos["robot_1"]["action_mask"])
    np.testing.assert_array_equal(pair["observation"], choices().reset(seed=0)[0]["robot_1"])
    assert pair["action_mask"].dtype == np.int8
    env.action_space("robot_1").sample(pair["action_mask"])


def test_a_choice_is_a_ray_as_far_as_it_is_free() -> None:
    """By hand: an open ray is a whole step, one that ends at 0.65 steps is half a step, none is to stay."""
    free = np.full((4, 16), 5.0)
    free[1, 4], free[2, 0] = 0.65, 0.1
    at = waypoints_of(np.array([8, 4, 0, STAY]), free)
    np.testing.assert_allclose(at, [[-1.0, 0.0], [0.0, 0.5], [0.0, 0.0], [0.0, 0.0]], atol=1e-12)


def test_choices_are_those_of_the_learned_interface() -> None:
    """What a network learns on 34 choices it can do through ``rays``, to the bit."""
    env, drive = choices(), parallel_env("paper-hw-2", **WALLED)
    rays, rng = Rays(env.scenario), np.random.default_rng(0)
    rows, drive_rows = env.reset(seed=5)[0], drive.reset(seed=5)[0]
    while env.agents:
        choice = rng.integers(N_CHOICES, size=2)
        answers = np.stack([choice % 17, choice // 17], axis=1)
        commands = rays.commands(answers, np.stack(list(drive_rows.values())))
        rows = env.step(dict(zip(rows, choice, strict=True)))[0]
        drive_rows = drive.step(dict(zip(drive_rows, commands, strict=True)))[0]
    np.testing.assert_array_equal(env.tick.truth.poses, drive.tick.truth.poses)
    np.testing.assert_array_equal(env.tick.belief.team.calls.callee, drive.tick.belief.team.calls.callee)


@pytest.mark.parametrize("changes", [{}, {"tx_power_dbm": -60.0}, {"n_robots": 4, "n_slots": 2}], ids=str)
def test_what_is_masked_does_what_another_choice_does(changes: dict[str, Any]) -> None:
    """Each masked choice gives, to the bit, the step of the same without the way or without the call."""
    env, rng = choices(**changes), np.random.default_rng(1)
    history: list[dict[str, int]] = []
    _, infos = env.reset(seed=3)
    n_masked = 0
    for _ in range(4):
        masks = {agent: info["action_mask"] for agent, info in infos.items()}
        assert all(mask[STAY] for mask in masks.values()), "to stay without a call is always allowed"
        for agent, mask in masks.items():
            for choice in np.flatnonzero(mask == 0)[::11]:
                same = allowed(int(choice), mask)
                assert mask[same]
                stay = dict.fromkeys(env.agents, STAY)
                both = [[*history, stay | {agent: int(c)}] for c in (choice, same)]
                twins = [played(choices(**changes), 3, actions) for actions in both]
                np.testing.assert_array_equal(twins[0].state(), twins[1].state())
                n_masked += 1
        history.append({a: int(rng.integers(N_CHOICES)) for a in env.agents})
        *_, infos = env.step(history[-1])
    assert n_masked > 0


def allowed(choice: int, mask: np.ndarray) -> int:
    """The same choice without what has no effect."""
    call, motion = divmod(choice, 17)
    return (motion if mask[motion] else STAY) + 17 * (call if mask[17 + STAY] else 0)


def test_a_mask_by_hand() -> None:
    free = np.full((2, 16), 2.0)
    free[0, 3] = 0.1  # nearer than a robot goes to a wall
    mask = choice_mask(free, np.array([True, False]))
    assert np.flatnonzero(mask[0] == 0).tolist() == [3, 17 + 3]
    assert mask[1, :17].all()
    assert not mask[1, 17:].any()
    assert choice_mask(np.zeros((1, 16)), np.array([False]))[0].nonzero()[0].tolist() == [STAY]


@pytest.mark.parametrize(
    ("action", "got"),
    [
        (34, "34"),
        (-1, "-1"),
        (1.0, "1.0"),
        (True, "True"),
        ("3", "'3'"),
        (np.zeros(3), "array"),
        (None, "None"),
    ],
    ids=str,
)
def test_what_is_no_choice_is_refused(action: Any, got: str) -> None:
    env = choices()
    env.reset(seed=0)
    with pytest.raises(ValueError, match=rf"actions\['robot_1'\] must be one choice in 0\.\.33.*got {got}"):
        env.step({"robot_0": 3, "robot_1": action})
    env.step({"robot_0": np.int64(3), "robot_1": np.array([5])})


def test_a_policy_of_the_other_kind_is_told() -> None:
    env, drive = choices(), parallel_env()
    rows = env.reset(seed=0)[0]
    with pytest.raises(ValueError, match=r"three numbers are for actions='continuous'"):
        env.step(make_policy("active", env.scenario).act(rows))
    drive.reset(seed=0)
    with pytest.raises(ValueError, match=r"a choice is for actions='discrete'"):
        drive.step({"robot_0": 3, "robot_1": np.int64(4)})
    with pytest.raises(ValueError, match=r"actions must be 'discrete' for masks, got 'continuous'"):
        drive.action_masks()
    with pytest.raises(ValueError, match=r"unknown form of actions 'both'; known: continuous, discrete"):
        parallel_env(actions="both")


def test_a_team_chooses_for_all() -> None:
    team, env = RendezvousTeamEnv(actions="discrete"), parallel_env(actions="discrete")
    assert team.action_space == spaces.MultiDiscrete([34, 34])
    row, rows = team.reset(seed=1)[0], env.reset(seed=1)[0]
    np.testing.assert_array_equal(row, np.concatenate(list(rows.values())))
    mask = np.concatenate([info["action_mask"] for info in env.reset(seed=1)[1].values()])
    np.testing.assert_array_equal(team.action_masks(), mask.astype(bool))
    row, rows = team.step(np.array([20, 5]))[0], env.step({"robot_0": 20, "robot_1": 5})[0]
    np.testing.assert_array_equal(row, np.concatenate(list(rows.values())))
    with pytest.raises(ValueError, match=r"action must be of shape \(2,\), got \(6,\)"):
        team.step(np.zeros(6))


@pytest.mark.parametrize("make", [parallel_env, RendezvousTeamEnv])
def test_an_end_by_the_clock_is_a_termination_if_asked(make: Any) -> None:
    ends = {}
    for asked in (False, True):
        env = make("paper-sim-2", n_steps=2, terminate_at_end=asked, actions="discrete")
        env.reset(seed=0)
        stay = np.array([STAY, STAY]) if make is RendezvousTeamEnv else {"robot_0": STAY, "robot_1": STAY}
        _, _, early, cut_early, _ = env.step(stay)
        _, _, ended, cut, _ = env.step(stay)
        ends[asked] = [any(x.values()) if isinstance(x, dict) else x for x in (early, cut_early, ended, cut)]
    assert ends == {False: [False, False, False, True], True: [False, False, True, False]}
