"""What a value is read from with ``ppo.critic=team``: the truth, behind what the robot is shown."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

from train._config import EnvsConfig, PpoConfig, TrainConfig
from train._rollouts import environments, teams_of
from train._truths import N_TRUTH

MIXED = EnvsConfig(n_envs=2, others=("paper-sim-2 n_robots=3",), overrides=("n_steps=4",), interface="trail")


def test_truth_and_means_of_the_team_follow_what_is_shown() -> None:
    """Two robots, then three; the reckoning takes one robot after the other."""
    norm = environments(TrainConfig(envs=MIXED, ppo=PpoConfig(critic="team")), seed=0)
    n_shown, n_whole = (getattr(teams_of(norm)[0].interface, name) for name in ("n_shown", "n_whole"))
    norm.reset()
    first = np.asarray(norm.get_original_obs())
    assert not first[:, n_shown : n_shown + 2 * N_TRUTH].any()  # nobody is told the truth of a beginning
    norm.step(np.zeros((5, 2), dtype=int))
    _, _, _, infos = norm.step(np.ones((5, 2), dtype=int))
    rows = np.asarray(norm.get_original_obs())
    shown, behind = rows[:, :n_shown], rows[:, n_shown:]
    assert behind.shape[1] == 2 * N_TRUTH + n_whole
    for team in (range(2), range(2, 5)):
        of_team = np.concatenate([behind[team, :N_TRUTH], shown[team, :n_whole]], axis=1).mean(axis=0)
        for k in team:
            seen, mapped = infos[k]["coverage_truth"], infos[k]["mapped_share_truth"]
            errors = np.log1p([infos[k]["ate_trans_truth"], 10.0 * infos[k]["ate_rot_truth"]])
            np.testing.assert_allclose(behind[k, :N_TRUTH], [mapped, seen, seen - mapped, *errors], rtol=1e-5)
            np.testing.assert_allclose(behind[k, N_TRUTH:], of_team, rtol=1e-5, atol=1e-6)
    norm.close()


def test_a_policy_that_would_read_the_truth_is_refused() -> None:
    with pytest.raises(ValueError, match=r"ppo\.critic must be own unless envs\.interface is rays or trail"):
        TrainConfig(envs=replace(MIXED, interface="flat", others=()), ppo=PpoConfig(critic="team"))
    with pytest.raises(ValueError, match=r"unknown ppo\.critic 'all'; known: own, team"):
        PpoConfig(critic="all")
