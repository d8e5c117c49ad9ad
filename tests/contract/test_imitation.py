"""Scripts that are imitated drive as they would alone; a network stays as it was where that is asked for."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.special import rel_entr, softmax
from support.short_training import FEW, SHORT, small

from baselines.policies import make_policy
from baselines.policies.learned.network import load_network
from envs.directions import N_MOTIONS
from train._config import EnvsConfig, ImitationConfig, TrainConfig
from train._dagger import _Scripts
from train._rollouts import environments, scenarios_of, teams_of
from train.training import Run, train


def test_scripts_are_those_of_each_environment_alone() -> None:
    """Two scenarios in turn, and environments that end at other times than their neighbours."""
    config = TrainConfig(
        envs=EnvsConfig(scenario="paper-hw-2", others=("paper-hw-2-obstacles",), n_envs=3, n_workers=0),
        imitation=ImitationConfig(policy="frontier_home"),
        seed=4,
    )
    norm = environments(config, config.seed)
    norm.reset()
    scripts, (translated,) = _Scripts(norm, config), teams_of(norm)
    scenarios = [scenarios_of(config)[k % 2] for k in range(3)]
    alone = [make_policy("frontier_home", scenario) for scenario in scenarios]
    episodes = [0, 0, 0]
    for k, policy in enumerate(alone):
        policy.reset(config.seed + k)
    ends = np.array([[0, 0, 0], [0, 1, 0], [0, 0, 0], [1, 1, 0], [0, 0, 0]], dtype=bool)
    for over in ends:
        answers = scripts.answers()
        teams = translated.seen.reshape(3, 2, -1)
        expected = [
            list(policy.act({"robot_0": team[0], "robot_1": team[1]}).values())
            for policy, team in zip(alone, teams, strict=True)
        ]
        np.testing.assert_array_equal(answers, translated.interface.answers(np.array(expected).reshape(6, 3)))
        norm.step(answers)
        scripts.ended(np.repeat(over, 2))
        for k in np.flatnonzero(over).tolist():
            episodes[k] += 1
            alone[k].reset(config.seed + k, episodes[k])
    norm.close()


@pytest.mark.parametrize("second", ["paper-hw-2", "paper-sim-2 n_robots=3"], ids=["alike", "mixed"])
def test_rows_that_are_to_stay_are_those_of_scenarios_where_start_is_imitated(
    tmp_path: Path, done: Run, second: str
) -> None:
    """Five environments take two scenarios in turn: two are of the second, with all their robots."""
    envs = replace(SHORT, others=(second,), n_envs=5)
    imitation = ImitationConfig(policy="voronoi", instead=(f"start in {second}",))
    config = small(tmp_path, envs=envs, start=str(done.config.out), imitation=imitation)
    norm = environments(config, 0)
    norm.reset()
    stays = _Scripts(norm, config).stays
    norm.close()
    # Environments that are alike lie as they are counted, others by scenario.
    expected = [False] * 6 + [True] * 6 if "n_" in second else [False, False, True, True] * 2 + [False] * 2
    assert stays.tolist() == expected


def test_a_network_stays_as_it_was_where_start_is_imitated(tmp_path: Path, done: Run) -> None:
    """Beside lessons of another rule elsewhere, which are learned; more so the more it weighs."""
    envs = replace(SHORT, others=("paper-hw-2",), n_envs=8)
    lessons = ImitationConfig(
        policy="start", instead=("voronoi in paper-hw-2",), rounds=2, agent_steps=160, learning_rate=1e-2
    )
    plain = replace(lessons, policy=f"ppo:path={done.config.out}")
    nothing = replace(FEW, agent_steps=0)
    begun = shutil.copytree(done.config.out, tmp_path / "lr=1, seed:0")
    later = small(tmp_path, envs=envs, ppo=nothing, start=str(begun), imitation=lessons)
    runs = {
        name: train(replace(later, out=tmp_path / name, imitation=each))
        for name, each in (
            ("stays", lessons),
            ("more", replace(lessons, stay_weight=1000.0)),
            ("plain", plain),
        )
    }
    seen, elsewhere = shown_in(later)
    moved = {name: divergence(done, run, seen) for name, run in runs.items()}
    assert moved["more"] < moved["stays"] < 0.2 * moved["plain"]
    assert divergence(done, runs["stays"], elsewhere) > moved["stays"] > 0.0
    mean = load_network(done.checkpoints.path("best") / "policy.npz").mean
    for name, same in (("stays", True), ("plain", False)):
        assert (load_network(runs[name].checkpoints.path() / "policy.npz").mean == mean).all() == same
    assert runs["stays"].norm.training


def shown_in(config: TrainConfig) -> tuple[np.ndarray, np.ndarray]:
    """What robots are shown in a few iterations where the network is to stay, and elsewhere."""
    norm = environments(config, 5)
    norm.reset()
    scripts, shown = _Scripts(norm, config), []
    for _ in range(8):
        shown.append(np.asarray(norm.get_original_obs()))
        norm.step(scripts.answers())
    norm.close()
    return np.concatenate([s[scripts.stays] for s in shown]), np.concatenate(
        [s[~scripts.stays] for s in shown]
    )


def divergence(before: Run, now: Run, shown: np.ndarray) -> float:
    """Kullback-Leibler, by what both score in numpy: directions and a stop, silence and a call."""
    networks = [load_network(run.checkpoints.path("best") / "policy.npz") for run in (before, now)]
    p, q = (
        np.split(network.scores(shown[:, : len(network.mean)]), [N_MOTIONS], axis=1) for network in networks
    )
    return float(
        np.mean(
            [rel_entr(softmax(a, axis=1), softmax(b, axis=1)).sum(axis=1) for a, b in zip(p, q, strict=True)]
        )
    )
