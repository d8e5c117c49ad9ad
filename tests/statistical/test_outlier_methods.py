"""Outlier methods over many encounters: distributions, and paired gains with intervals."""

import numpy as np
import pytest
from scipy import stats

from baselines.reproduce.encounters import EncounterConfig, simulate_encounter
from wifipgo.graph.metrics import ate_rot, ate_trans
from wifipgo.graph.outliers.methods import solve_robust
from wifipgo.graph.outliers.pcm import chain_odometry, pair_chi2, team_graph

N_TRIALS = 20


def errors(cfg: EncounterConfig, methods: tuple[str, ...]) -> np.ndarray:
    """Eq. 12 + Eq. 13 of each trial and method."""

    def one(trial: int, method: str) -> float:
        e = simulate_encounter(cfg, rng=np.random.default_rng([1, trial]))
        solved, _ = solve_robust(
            e.start, e.edges, e.bearings, robots=[0, 1], outliers=method, start_sigma=e.start_sigma
        )
        return float((ate_trans(solved, e.truth) + ate_rot(solved, e.truth)).mean())

    return np.array([[one(trial, method) for method in methods] for trial in range(N_TRIALS)])


def least_reduction(base: np.ndarray, error: np.ndarray) -> float:
    """Lower end of the 95 % interval of the reduction of the mean error."""
    ratio = error.mean() / base.mean()
    spread = (error - ratio * base).std(ddof=1) / np.sqrt(len(base)) / base.mean()
    return float(1.0 - ratio - 1.96 * spread)


def test_the_error_of_a_good_loop_is_chi_square() -> None:
    """One loop an encounter, through measurements of both robots and odometry of both."""
    cfg = EncounterConfig(odometry_scale=0.3, noise=0.2, sigma_r_rad=0.05)
    drawn = []
    for seed in range(80):
        e = simulate_encounter(cfg, rng=np.random.default_rng(seed))
        graph = team_graph(e.edges, np.arange(len(e.edges)), 2)
        two = np.flatnonzero(graph.between_robots)[[1, 6]]
        drawn.append(pair_chi2(graph, chain_odometry(graph), two)[0, 1])
    assert stats.kstest(np.array(drawn) / cfg.noise**2, stats.chi2(3).cdf).pvalue > 0.01


@pytest.mark.parametrize(
    ("kind", "range_m", "start_known", "least"),
    [("gross", 1.0, True, 0.55), ("gross", 4.0, False, 0.55), ("same", 2.0, False, 0.0)],
)
def test_the_default_pays(kind: str, range_m: float, start_known: bool, least: float) -> None:
    """Gross outliers cost less than half; mild ones cost less than they would. Bearings add to Huber."""
    cfg = EncounterConfig(
        kind=kind, range_m=range_m, n_outliers=4, start_known=start_known, odometry_scale=0.1
    )
    base, huber, default = errors(cfg, ("none", "huber", "bearing")).T
    assert least_reduction(base, default) > least
    assert default.mean() < huber.mean()


def test_bearings_that_are_all_wrong_cost_little() -> None:
    """The 95 % interval of the loss against Huber alone stays above -15 % of the error without a method."""
    cfg = EncounterConfig(kind="gross", range_m=2.0, n_outliers=3, bearings_wrong=True)
    base, huber, default = errors(cfg, ("none", "huber", "bearing")).T
    assert least_reduction(base, base + default - huber) > -0.15
    assert least_reduction(base, default) > 0.4
