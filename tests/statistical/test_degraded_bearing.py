"""Directions that are made worse have the errors that they are said to have, and nothing else changes."""

import numpy as np
import pytest
from scipy import stats

from baselines.evaluation.episodes import run_episodes
from baselines.policies import make_policy
from baselines.policies.degraded_bearing import CorrelatedNormals
from baselines.policies.observation_view import Columns, View
from envs.rendezvous_v0 import parallel_env
from wifipgo.errors import BadInputError
from wifipgo.rows import Generators
from wifipgo.scenarios import scenario_named

SCENARIO = scenario_named("paper-hw-2")


def numbers(memory: float, *, n_steps: int, seed: int = 0) -> np.ndarray:
    """Numbers of two robots in each of two worlds, step by step; the second world begins anew half-way."""
    made, columns = CorrelatedNormals(memory), Columns.of(SCENARIO)
    each = [np.random.default_rng([seed, k]) for k in range(2)]
    out = []
    for step in range(n_steps):
        begins = np.ones(4, dtype=bool) if step == 0 else None
        out.append(made.step(View(np.zeros((4, columns.n_numbers)), columns, 2, begins), Generators(each)))
    return np.array(out)


@pytest.mark.parametrize("memory", [0.0, 0.8])
def test_errors_are_standard_normal_with_the_stated_memory(memory: float) -> None:
    ends = np.concatenate([numbers(memory, n_steps=4, seed=seed) for seed in range(150)], axis=1)
    first, last = ends[0], ends[3]
    for sample in (first, last):
        assert stats.kstest(sample, "norm").pvalue > 1e-3
    assert np.corrcoef(ends[2], last)[0, 1] == pytest.approx(memory, abs=0.09)
    assert np.corrcoef(ends[0], last)[0, 1] == pytest.approx(memory**3, abs=0.12)


def driven(spec: str, seed: int) -> float:
    """Direction in which a called robot in the open drives, from that in which it hears its caller."""
    env = parallel_env(scenario=SCENARIO)
    row = np.zeros(sum(block.size for block in env.layout), np.float32)
    values = {"slot0/present": 1.0, "slot0/discrepancy": 1.0, "lidar": 1.0, "slot0/calls_me": 1.0}
    for block in env.layout:
        row[block.where] = values.get(block.name, 0.0)
    profile = next(block for block in env.layout if block.name == "slot0/profile")
    row[profile.start + 45] = 1.0
    policy = make_policy(spec, SCENARIO)
    policy.reset(seed)
    step = policy.act({"robot_0": row, "robot_1": row.copy()})["robot_0"]
    heard = -np.pi + 2.0 * np.pi / 72.0 * 45.5
    return float(np.angle(np.exp(1j * (np.arctan2(step[1], step[0]) - heard))))


def test_a_called_robot_drives_off_by_that_error() -> None:
    off = np.array([driven("noisy_bearing:sigma_deg=30", seed) for seed in range(40)])
    assert stats.kstest(off, "norm", args=(0.0, np.deg2rad(30.0))).pvalue > 1e-3
    anywhere = np.array([driven("noisy_bearing:sigma_deg=360", seed) for seed in range(40)])
    assert stats.kstest(anywhere, "uniform", args=(-np.pi, 2.0 * np.pi)).pvalue > 1e-3


def test_without_an_error_it_is_the_papers_policy_and_walks_stay_paired() -> None:
    short = scenario_named("paper-hw-2", n_steps=8, size_m=8.0, err_threshold=0.5)
    active, exact, off = (
        run_episodes(short, spec, [3, 4])
        for spec in ("active", "noisy_bearing:sigma_deg=0", "noisy_bearing:sigma_deg=90")
    )
    for k in range(2):  # at first nobody calls
        np.testing.assert_array_equal(active[k].reference, exact[k].reference)
        np.testing.assert_array_equal(active[k].reference[:, :2], off[k].reference[:, :2])
    assert any(not np.array_equal(active[k].reference, off[k].reference) for k in range(2))


@pytest.mark.parametrize("wrong", ["sigma_deg=-1", "sigma_deg=361", "memory=1"])
def test_errors_that_cannot_be_are_refused(wrong: str) -> None:
    with pytest.raises(BadInputError, match=f"noisy_bearing:{wrong.partition('=')[0]}"):
        make_policy(f"noisy_bearing:{wrong}", SCENARIO)
