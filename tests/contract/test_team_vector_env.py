"""Many teams through gymnasium: what its own ``SyncVectorEnv`` makes of the same worlds, at once."""

from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from gymnasium.wrappers.vector import NormalizeObservation, RecordEpisodeStatistics

from envs.rendezvous_v0 import RendezvousTeamVectorEnv, parallel_env

TEAM = "wifipgo/RendezvousTeam-v0"
KINDS: dict[str, dict[str, Any]] = {
    "small": {"scenario": "paper-sim-2", "size_m": 4.0, "n_steps": 4},
    "ends of their own": {"scenario": "paper-sim-2", "size_m": 4.0, "max_measurements": 6},
    "choices": {"scenario": "paper-hw-2-obstacles", "n_steps": 3, "actions": "discrete"},
    "four robots": {"scenario": "paper-sim-2", "n_robots": 4, "n_slots": 3, "n_steps": 3},
}
MODES = {mode.value: mode for mode in AutoresetMode}


def made(n: int, mode: AutoresetMode, **arguments: Any) -> tuple[VectorEnv, VectorEnv]:
    """The same worlds at once and one by one."""
    at_once = gymnasium.make_vec(
        TEAM, num_envs=n, vectorization_mode="vector_entry_point", autoreset_mode=mode, **arguments
    )
    one_by_one = gymnasium.make_vec(
        TEAM, num_envs=n, vectorization_mode="sync", vector_kwargs={"autoreset_mode": mode}, **arguments
    )
    return at_once, one_by_one


def assert_same(at_once: Any, one_by_one: Any) -> None:
    """Equal where the mask of an entry of an info says that it is there, and everywhere else."""
    if isinstance(one_by_one, dict):
        assert at_once.keys() == one_by_one.keys()
        for name in one_by_one:
            assert_same(at_once[name], one_by_one[name])
    else:
        np.testing.assert_equal(list(at_once), list(one_by_one))
        assert np.asarray(at_once).dtype == np.asarray(one_by_one).dtype


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("mode", ["SameStep", "NextStep"])
def test_at_once_is_one_by_one(kind: str, mode: str) -> None:
    pair = made(2, MODES[mode], **KINDS[kind])
    for space in ("observation_space", "single_action_space", "action_space"):
        assert getattr(pair[0], space) == getattr(pair[1], space)
    began = [env.reset(seed=5) for env in pair]
    np.testing.assert_array_equal(began[0][0], began[1][0])
    assert_same(began[0][1], began[1][1])
    pair[0].action_space.seed(0)
    ends = 0
    for _ in range(10):
        actions = pair[0].action_space.sample()
        stepped = [env.step(actions) for env in pair]
        for mine, theirs in zip(*[s[:4] for s in stepped], strict=True):
            np.testing.assert_array_equal(mine, theirs)
        assert_same(stepped[0][4], stepped[1][4])
        ends += int((stepped[0][2] | stepped[0][3]).sum())
    assert ends >= 2


def test_gymnasium_makes_many_teams_at_once_by_itself() -> None:
    teams = gymnasium.make_vec(TEAM, num_envs=2, scenario="paper-sim-2")
    assert isinstance(teams.unwrapped, RendezvousTeamVectorEnv)
    assert teams.metadata["autoreset_mode"] is AutoresetMode.SAME_STEP
    assert teams.observation_space == batch_space(teams.single_observation_space, 2)
    assert teams.spec is not None
    again = gymnasium.make_vec(teams.spec)
    assert again.num_envs == 2
    np.testing.assert_array_equal(again.reset(seed=1)[0], teams.reset(seed=1)[0])
    teams.close()
    again.close()


def test_a_loop_like_cleanrl_s_runs_past_many_ends() -> None:
    """Returns and lengths of the wrapper, observations before a reset put where they belong."""
    teams = gymnasium.make_vec(TEAM, num_envs=4, **KINDS["small"])
    teams = RecordEpisodeStatistics(teams)
    rows, _ = teams.reset(seed=0)
    teams.action_space.seed(0)
    total, ended = np.zeros(4), 0
    for _ in range(9):
        nexts, rewards, terminated, truncated, infos = teams.step(teams.action_space.sample())
        total += rewards
        if "final_info" in infos:
            done = terminated | truncated
            assert done.all()
            np.testing.assert_array_equal(infos["_final_obs"], done)
            last = np.stack(infos["final_obs"][done])
            assert last.shape == rows.shape
            assert not np.array_equal(last, nexts)
            np.testing.assert_allclose(infos["episode"]["r"], total, rtol=1e-6)
            assert infos["episode"]["l"].tolist() == [4] * 4
            total[:], ended = 0.0, ended + 1
    assert ended == 2


def test_observation_wrappers_of_gymnasium_want_the_next_step() -> None:
    """They refuse same-step autoreset, whoever makes the environment."""
    teams = gymnasium.make_vec(TEAM, num_envs=2, autoreset_mode="NextStep", **KINDS["small"])
    normalised = NormalizeObservation(teams)
    normalised.reset(seed=0)
    for _ in range(6):
        rows, *_ = normalised.step(normalised.action_space.sample())
    assert np.isfinite(rows).all()


def test_without_autoreset_a_mask_begins_worlds() -> None:
    teams = RendezvousTeamVectorEnv(num_envs=3, autoreset_mode="Disabled", **KINDS["ends of their own"])
    teams.reset(seed=0)
    begun = 0
    for _ in range(12):
        rows, _, terminated, truncated, _ = teams.step(np.zeros((3, 6), np.float32))
        ended = terminated | truncated
        if ended.any():
            now, infos = teams.reset(options={"reset_mask": ended})
            np.testing.assert_array_equal(now[~ended], rows[~ended])
            assert not (now[ended] == rows[ended]).all(axis=1).any()
            np.testing.assert_array_equal(infos["_robot_0"], ended)
            begun += 1
    assert begun >= 2


def test_the_teams_say_what_is_wrong() -> None:
    with pytest.raises(ValueError, match="observation must be 'flat' for a team, got 'dict'"):
        RendezvousTeamVectorEnv(num_envs=2, observation="dict")
    with pytest.raises(ValueError, match="n_worlds must be an integer >= 1, got 0"):
        gymnasium.make_vec(TEAM, num_envs=0)
    teams = RendezvousTeamVectorEnv(num_envs=2)
    teams.reset(seed=0)
    with pytest.raises(ValueError, match=r"actions must be of shape \(2, 6\), got \(6,\)"):
        teams.step(np.zeros(6, np.float32))
    with pytest.raises(ValueError, match="'Sometimes'"):
        RendezvousTeamVectorEnv(num_envs=2, autoreset_mode="Sometimes")


def test_seeds_are_those_of_environments_alone() -> None:
    teams = RendezvousTeamVectorEnv("paper-sim-2", num_envs=3)
    for given, seeds in ((7, [7, 8, 9]), ([3, 9, 4], [3, 9, 4])):
        rows, _ = teams.reset(seed=given)
        for k, seed in enumerate(seeds):
            alone, _ = parallel_env("paper-sim-2").reset(seed=seed)
            np.testing.assert_array_equal(rows[k], np.concatenate(list(alone.values())))
