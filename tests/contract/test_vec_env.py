"""Our VecEnv: ends of episodes, seeds, options, workers, and what a learner makes of them."""

import multiprocessing
import os
import signal
from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np
import pytest
from support.toy_team import ToyTeam

pytest.importorskip("stable_baselines3")

from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecMonitor

from train import TeamVecEnv, rendezvous_vec_env

N = 3  # environments of the toys below, two rows each


@pytest.fixture(scope="module", params=[0, 2], ids=["here", "2 workers"])
def standing(request: pytest.FixtureRequest) -> Iterator[TeamVecEnv]:
    venv = TeamVecEnv([partial(ToyTeam, render_mode="rgb_array")] * N, n_workers=request.param)
    yield venv
    venv.close()


@pytest.fixture
def toys(standing: TeamVecEnv) -> TeamVecEnv:
    """As good as new, at the cost of no process."""
    standing.set_options()
    standing.set_attr("n_steps", 5)
    standing.env_method("forget")
    return standing


def still(venv: Any) -> np.ndarray:
    return np.zeros((venv.num_envs, *venv.action_space.shape), np.float32)


def episode(venv: TeamVecEnv, n_steps: int) -> list[np.ndarray]:
    """All that comes out of a seeded run with seeded actions."""
    rng = np.random.default_rng(0)
    venv.seed(7)
    out = [np.asarray(venv.reset())]
    for _ in range(n_steps):
        actions = rng.uniform(-1.0, 1.0, still(venv).shape).astype(np.float32)
        observations, rewards, dones, infos = venv.step(actions)
        out += [np.asarray(observations), rewards, dones, np.array([i["TimeLimit.truncated"] for i in infos])]
    return out


def test_ppo_bootstraps_through_the_clock() -> None:
    """Reward 1 for ever at a discount of 0.9 is worth 10; with truncation taken for an end, 4.1 at most."""
    venv = TeamVecEnv([partial(ToyTeam, 5, blind=True)] * 2)
    model = PPO(
        "MlpPolicy",
        venv,
        gamma=0.9,
        gae_lambda=1.0,
        n_steps=20,
        batch_size=80,
        n_epochs=20,
        learning_rate=0.01,
        policy_kwargs={"net_arch": [8]},
        seed=0,
    )
    model.learn(80 * 40)
    value = model.policy.predict_values(model.policy.obs_to_tensor(np.zeros((1, 3), np.float32))[0]).item()
    assert value == pytest.approx(10.0, abs=0.5)


def test_ends_are_reported_as_what_they_are(toys: TeamVecEnv) -> None:
    toys.seed(0)
    before = np.asarray(toys.reset())
    for t in range(1, 6):
        observations, rewards, dones, infos = toys.step(still(toys))
        np.testing.assert_array_equal(rewards, np.tile([1.0, 2.0], N).astype(np.float32))
        assert dones.all() == dones.any() == (t == 5)
        assert [i["TimeLimit.truncated"] for i in infos] == [t == 5] * toys.num_envs
        assert all(("terminal_observation" in i) == (t == 5) for i in infos)
    now = np.asarray(observations)
    for row, info in enumerate(infos):
        np.testing.assert_array_equal(info["terminal_observation"], [5, row % 2, before[row, 2]])
        np.testing.assert_array_equal(now[row, :2], [0, row % 2])
        assert now[row, 2] == toys.reset_infos[row]["draw"] != before[row, 2]


def test_a_task_that_ends_is_no_truncation() -> None:
    toys = TeamVecEnv([partial(ToyTeam, 1, by="termination")])
    toys.reset()
    *_, dones, infos = toys.step(still(toys))
    assert dones.all()
    assert not any(i["TimeLimit.truncated"] for i in infos)


@pytest.mark.usefixtures("spawned")
def test_workers_change_nothing() -> None:
    runs = []
    for n_workers in (0, 2):
        venv = rendezvous_vec_env("paper-sim-2", n_envs=3, n_workers=n_workers, n_steps=4)
        runs += [episode(venv, 6), episode(venv, 6)]
        venv.close()
    for run in runs[1:]:
        for a, b in zip(runs[0], run, strict=True):
            np.testing.assert_array_equal(a, b)


def test_each_environment_has_its_own_episodes(toys: TeamVecEnv) -> None:
    seeds = toys.seed(3)
    assert seeds[::2] == seeds[1::2]
    draws = [np.asarray(toys.reset())[::2, 2]]
    draws += [np.asarray(toys.reset())[::2, 2]]  # not seeded again: the next episodes
    assert len(set(np.concatenate(draws).tolist())) == 2 * N
    toys.seed(3)
    np.testing.assert_array_equal(np.asarray(toys.reset())[::2, 2], draws[0])
    assert len(set(TeamVecEnv([ToyTeam] * 500).seed(4))) == 500


def test_options_hold_until_set_anew(toys: TeamVecEnv) -> None:
    toys.reset()
    toys.set_options({"level": 2})
    assert toys.get_attr("options") == [{}] * 2 * N
    for _ in range(10):
        toys.step(still(toys))
    assert toys.get_attr("options") == [{"level": 2}] * 2 * N  # two automatic resets later
    toys.set_options([{"level": k} for k in range(N)])
    toys.reset()
    assert [o["level"] for o in toys.get_attr("options")[::2]] == [0, 1, 2]
    with pytest.raises(ValueError, match="options must be a dict or 3 dicts"):
        toys.set_options([{}])


def test_attributes_and_methods_go_by_row(toys: TeamVecEnv) -> None:
    toys.reset()
    assert toys.get_attr("n_steps") == [5] * 2 * N
    toys.set_attr("n_steps", 9, indices=[2])
    assert toys.get_attr("n_steps") == [5, 5, 9, 9, 5, 5]
    assert toys.get_attr("n_steps", indices=3) == [9]
    assert toys.get_attr("n_steps", indices=[5, 2, -3]) == [5, 9, 9]
    assert toys.env_method("note", "x") == [1] * 2 * N  # once for each environment, not for each row
    assert toys.env_method("note", what="y", indices=[4, 0]) == [2, 2]
    assert toys.get_attr("calls", indices=[0, 2, 4]) == [["x", "y"], ["x"], ["x", "y"]]
    assert toys.env_is_wrapped(VecMonitor) == [False] * 2 * N
    assert toys.env_is_wrapped(ToyTeam, indices=[1]) == [True]
    assert not toys.has_attr("nothing_of_this_name")
    with pytest.raises(ValueError, match=r"indices must be rows in 0\.\.5, got 6"):
        toys.get_attr("n_steps", indices=6)


def test_pictures_are_one_for_each_environment(toys: TeamVecEnv) -> None:
    toys.reset()
    toys.step(still(toys))
    assert [image.tolist() for image in toys.get_images() if image is not None] == [[[[1] * 3] * 4] * 4] * N
    tiled = toys.render()
    assert tiled is not None
    assert tiled.shape == (8, 8, 3)


def test_returns_add_up() -> None:
    venv = VecMonitor(rendezvous_vec_env("paper-sim-2", n_envs=2, n_steps=5))
    venv.seed(1)
    venv.reset()
    total = np.zeros(venv.num_envs)
    for _ in range(5):
        _, rewards, dones, infos = venv.step(still(venv))
        total += rewards
    assert dones.all()
    np.testing.assert_allclose([i["episode"]["r"] for i in infos], total, rtol=1e-5, atol=1e-6)
    assert [i["episode"]["l"] for i in infos] == [5] * 4
    assert all("ate_trans_truth" in i for i in infos)


def test_learning_repeats_to_the_bit() -> None:
    def weights() -> np.ndarray:
        venv = rendezvous_vec_env("paper-sim-2", n_envs=2, n_steps=6)
        model = PPO("MlpPolicy", venv, n_steps=8, batch_size=16, n_epochs=2, seed=3)
        model.learn(64)
        return np.concatenate([p.detach().numpy().ravel() for p in model.policy.parameters()])

    np.testing.assert_array_equal(weights(), weights())


def test_dict_observations_are_arrays_by_name() -> None:
    venv = rendezvous_vec_env("paper-hw-2", n_envs=2, n_workers=1, n_steps=1, observation="dict")
    observations = venv.reset()
    assert isinstance(observations, dict)
    assert observations["own/position"].shape == (4, 2)
    observations, _, _, infos = venv.step(still(venv))
    assert infos[3]["terminal_observation"]["own/position"].shape == (2,)
    venv.close()


def test_a_step_that_nobody_waits_for_is_dropped(toys: TeamVecEnv) -> None:
    toys.reset()
    toys.step_async(still(toys))
    with pytest.raises(RuntimeError, match="twice"):
        toys.step_async(still(toys))
    assert np.asarray(toys.reset())[:, 0].tolist() == [0.0] * 2 * N
    with pytest.raises(RuntimeError, match="without step_async"):
        toys.step_wait()


@pytest.mark.parametrize("n_workers", [0, 2])
def test_what_an_environment_raises_arrives(n_workers: int) -> None:
    toys = TeamVecEnv([ToyTeam, ToyTeam, partial(ToyTeam, fails_at=2)], n_workers=n_workers)
    toys.reset()
    toys.step(still(toys))
    with pytest.raises(ZeroDivisionError, match="the toy broke") as caught:
        toys.step(still(toys))
    if n_workers:
        assert "In worker 1" in caught.value.__notes__[0]
        assert "toy_team.py" in caught.value.__notes__[0]
    assert np.asarray(toys.reset())[:, 0].tolist() == [0.0] * 6  # it goes on
    toys.close()
    with pytest.raises(RuntimeError, match="closed"):
        toys.reset()
    toys.close()


def test_a_dead_worker_is_reported_and_closing_does_not_hang() -> None:
    before = set(multiprocessing.active_children())
    toys = TeamVecEnv([ToyTeam] * 3, n_workers=2)
    toys.reset()
    workers = {
        process.name: process for process in multiprocessing.active_children() if process not in before
    }
    os.kill(workers["worker 1"].pid or 0, signal.SIGKILL)
    with pytest.raises(RuntimeError, match=r"worker 1 with 1 environments died \(exit code -9\)"):
        toys.step(still(toys))
    toys.close()
    assert not workers["worker 0"].is_alive()


def broken() -> ToyTeam:
    raise ImportError("no such thing")


def the_same(toy: ToyTeam) -> ToyTeam:
    return toy


@pytest.mark.parametrize(
    ("makers", "n_workers", "problem", "message"),
    [
        ([], 0, ValueError, "makers must be at least one"),
        ([ToyTeam], 2, ValueError, r"n_workers must be in 0\.\.1"),
        ([partial(the_same, ToyTeam())] * 2, 0, ValueError, "the same environment twice"),
        ([ToyTeam, partial(ToyTeam, agents=3)], 0, ValueError, "environment 1 must be like environment 0"),
        ([ToyTeam, partial(ToyTeam, agents=3)], 2, ValueError, "environments of worker 1 must be like"),
        ([ToyTeam, broken], 2, ImportError, "no such thing"),
    ],
)
def test_bad_arguments(makers: list[Any], n_workers: int, problem: type[Exception], message: str) -> None:
    before = set(multiprocessing.active_children())
    with pytest.raises(problem, match=message):
        TeamVecEnv(makers, n_workers=n_workers)
    assert set(multiprocessing.active_children()) <= before


def test_bad_scenario_fields_keep_their_type_across_processes() -> None:
    with pytest.raises(ValueError, match=r"unknown scenario field 'n_obstacle'.*known:.*n_obstacles"):
        rendezvous_vec_env("paper-sim-2", n_envs=1, n_workers=1, n_obstacle=3)
    toys = TeamVecEnv([ToyTeam])
    with pytest.raises(ValueError, match=r"actions must be of shape \(2, 1\), got \(2, 3\)"):
        toys.step(np.zeros((2, 3)))
