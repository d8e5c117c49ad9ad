"""The names that PettingZoo and gymnasium know, and the team as one agent."""

import importlib
import pickle
import subprocess
import sys
import warnings

import gymnasium
import numpy as np
import pettingzoo
import pytest
from gymnasium.utils.env_checker import check_env

import envs
from envs import rendezvous_v0
from envs.rendezvous_v0 import RendezvousTeamEnv
from wifipgo.scenarios import SCENARIOS

TEAM = "wifipgo/RendezvousTeam-v0"
SMALL = [name for name, scenario in SCENARIOS.items() if scenario.n_robots == 2]


def test_pettingzoo_makes_it_by_name() -> None:
    env = pettingzoo.make("parallel", "wifipgo/rendezvous-v0", scenario="paper-sim-2", n_obstacles=2)
    assert isinstance(env, rendezvous_v0.RendezvousEnv)
    assert env.scenario.arena.n_obstacles == 2
    assert pettingzoo.make("parallel", "wifipgo/rendezvous-v0", max_cycles=7).scenario.n_steps == 7
    turns = pettingzoo.make("aec", "wifipgo/rendezvous-v0", scenario="paper-sim-2")
    turns.reset(seed=0)
    assert turns.agent_selection == "robot_0"


def test_importing_twice_is_silent_and_importing_is_enough() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        importlib.reload(envs)
    code = (
        "import sys, envs, gymnasium, pettingzoo\n"
        "assert 'wifipgo.scenarios' not in sys.modules, 'registering loads nothing'\n"
        f"gymnasium.make({TEAM!r}), pettingzoo.make('parallel', 'wifipgo/rendezvous-v0')"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_a_pettingzoo_without_registry_will_do(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(pettingzoo, "register")
    importlib.reload(envs)


@pytest.mark.parametrize("scenario", SMALL)
def test_gymnasium_accepts_the_team_without_a_warning(scenario: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    check_env(gymnasium.make(TEAM, scenario=scenario).unwrapped)


def test_fifty_robots_are_a_team_too() -> None:
    env = gymnasium.make(TEAM, scenario="paper-sim-50", n_steps=1)
    env.reset(seed=0)
    *_, terminated, truncated, _ = env.step(env.action_space.sample())
    assert truncated
    assert not terminated


def test_the_team_is_its_robots() -> None:
    robots = rendezvous_v0.parallel_env("paper-hw-2-obstacles", reward="error")
    team = RendezvousTeamEnv("paper-hw-2-obstacles", reward="error")
    rng = np.random.default_rng(0)
    apart, infos = robots.reset(seed=4)
    together, team_infos = team.reset(seed=4)
    for _ in range(6):
        np.testing.assert_array_equal(together, np.concatenate([apart["robot_0"], apart["robot_1"]]))
        np.testing.assert_equal(team_infos, infos)
        actions = rng.uniform(-1.0, 1.0, (2, 3)).astype(np.float32)
        apart, rewards, *_, infos = robots.step(dict(zip(robots.agents, actions, strict=True)))
        together, reward, terminated, truncated, team_infos = team.step(actions.ravel())
        assert reward == pytest.approx((rewards["robot_0"] + rewards["robot_1"]) / 2)
        assert not terminated
        assert not truncated


def test_an_end_of_the_task_is_no_truncation() -> None:
    team = RendezvousTeamEnv("paper-outliers", size_m=4.0, n_steps=400)
    team.reset(seed=0)
    terminated = truncated = False
    while not (terminated or truncated):
        *_, terminated, truncated, _ = team.step(np.zeros(6, np.float32))
    assert (terminated, truncated) == (True, False)
    with pytest.raises(RuntimeError, match="over"):
        team.step(np.zeros(6, np.float32))


def test_copies_of_a_team_do_the_same() -> None:
    team = RendezvousTeamEnv("paper-sim-2", n_obstacles=2)
    twin = pickle.loads(pickle.dumps(team))
    np.testing.assert_array_equal(team.reset(seed=2)[0], twin.reset(seed=2)[0])


def test_the_team_says_what_is_wrong() -> None:
    with pytest.raises(ValueError, match="observation must be 'flat' for a team, got 'dict'"):
        RendezvousTeamEnv(observation="dict")
    with pytest.raises(ValueError, match=r"paper-hw-3.*known"):
        gymnasium.make(TEAM, scenario="paper-hw-3")
    team = RendezvousTeamEnv()
    team.reset(seed=0)
    with pytest.raises(ValueError, match=r"action must be of shape \(6,\), got \(3,\)"):
        team.step(np.zeros(3, np.float32))
    with pytest.raises(ValueError, match=r"robot_1.*finite"):
        team.step(np.array([0, 0, 0, 0, np.nan, 0], np.float32))
    with pytest.raises(ValueError, match=r"seed must be None or an integer >= 0, got -1"):
        team.reset(seed=-1)


def test_a_team_takes_the_seeds_that_its_robots_take() -> None:
    team = RendezvousTeamEnv()
    np.testing.assert_array_equal(team.reset(seed=np.int64(3))[0], team.reset(seed=3)[0])
