"""Runs of nine relative poses (Sec. 7.3): what is injected, what stays, what five trials show by chance."""

from typing import Any

import numpy as np
import pytest
from scipy.stats import binom

from baselines.reproduce.encounter_grid import ground_truth_error, without
from baselines.reproduce.nine_poses import (
    NinePoses,
    Run,
    heard,
    simulate_run,
    start_sigma,
)
from baselines.reproduce.nine_poses_trials import chance_of_a_panel
from wifipgo import se2
from wifipgo.graph.edges import select
from wifipgo.graph.outliers.methods import solve_robust
from wifipgo.graph.solve_weights import counted_alike


def run_of(key: int, **fields: Any) -> tuple[NinePoses, Run]:
    cfg = NinePoses(**fields)
    return cfg, simulate_run(cfg, rng=np.random.default_rng(key))


@pytest.mark.parametrize("n_outliers", [0, 3, 9])
def test_outliers_are_two_to_three_sigma_off_in_every_component_and_nothing_else_is(n_outliers: int) -> None:
    off = []
    for key in range(40):
        cfg, run = run_of(key, n_outliers=n_outliers, range_m=1.5)
        met = select(run.edges, run.edges.between_robots)
        exact = se2.between(run.truth[tuple(met.tail.T)], run.truth[tuple(met.head.T)])
        np.testing.assert_allclose(np.hypot(exact[:, 0], exact[:, 1]), 1.5, rtol=1e-12)
        sigmas = (met.z - exact) / [cfg.sigma_t_m, cfg.sigma_t_m, cfg.sigma_r_rad]
        sigmas[:, 2] = se2.wrap_angle(sigmas[:, 2] * cfg.sigma_r_rad) / cfg.sigma_r_rad
        bad = run.is_outlier[-cfg.n_met :]
        assert bad.sum() == n_outliers
        assert not run.is_outlier[: -cfg.n_met].any()
        assert ((np.abs(sigmas[bad]) >= 2.0 - 1e-9) & (np.abs(sigmas[bad]) <= 3.0 + 1e-9)).all()
        off.append(sigmas[~bad])
    good = np.concatenate(off)
    if len(good):  # 240 or 360 of them: the deviation of a deviation is 1 / sqrt(2 n)
        assert good.std() == pytest.approx(1.0, abs=4.0 / np.sqrt(2.0 * good.size))


def test_the_number_of_outliers_changes_nothing_else() -> None:
    (_, one), (_, other) = run_of(3, n_outliers=0), run_of(3, n_outliers=4)
    np.testing.assert_array_equal(one.truth, other.truth)
    same = ~other.is_outlier
    np.testing.assert_array_equal(one.edges.z[same], other.edges.z[same])


def test_poses_come_from_as_many_meetings_as_asked() -> None:
    cfg = NinePoses(n_meetings=3, n_between=8)
    gaps = np.diff(cfg.met_at)
    assert cfg.n_met == len(cfg.met_at) == 9
    assert (gaps > 1).sum() == 2
    assert gaps.max() == 9


@pytest.mark.parametrize("alike", [True, False])
def test_without_noise_every_treatment_finds_the_truth(alike: bool) -> None:
    _, run = run_of(1, n_outliers=0, odometry_scale=1e-6, sigma_t_m=1e-6, sigma_r_rad=1e-6)
    edges = counted_alike(run.edges) if alike else run.edges
    bearings = heard(run, np.zeros(9))
    solved, _ = solve_robust(
        run.start, edges, bearings, robots=(0, 1), outliers="paper", start_sigma=start_sigma()
    )
    assert ground_truth_error(solved, run.truth) < 1e-8


def test_removing_the_outliers_leaves_what_no_outlier_touches() -> None:
    _, run = run_of(2, n_outliers=9)
    edges = without(counted_alike(run.edges), run.is_outlier)
    solved, _ = solve_robust(
        run.start,
        edges,
        heard(run, np.zeros(9)),
        robots=(0, 1),
        outliers="none",
        start_sigma=start_sigma(),
    )
    np.testing.assert_allclose(solved[..., :2], run.start[..., :2], atol=1e-6)


def test_chance_of_a_panel_is_binomial_where_trials_are_all_or_nothing() -> None:
    """Of ten trials three lose all of their error: a panel shows 40 % where two or more of its five do."""
    errors = np.ones((10, 2))
    errors[:3, 1] = 0.0
    expected = float(binom.sf(1, 5, 0.3))
    assert chance_of_a_panel(errors, claimed=0.4) == pytest.approx(expected, abs=0.02)
