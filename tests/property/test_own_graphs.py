"""Robots of several worlds that solve at every step: each as if its world were alone, to the bit."""

from dataclasses import replace

import numpy as np
import pytest
from support.stacked_graphs import TeamGraph, stacked, team_graph

from wifipgo import se2
from wifipgo.graph.bearings import select_bearings
from wifipgo.graph.config import GraphConfig
from wifipgo.graph.edges import select
from wifipgo.graph.per_robot_smoothing import PerRobotSmoothers
from wifipgo.graph.smoother_updates import BANDED, CAREFUL, INCREMENTAL, Smoothing, no_smoothing

N_ROBOTS, N_TIMES = 3, 8
TEAMS = [team_graph(seed, n_robots=N_ROBOTS, n_times=N_TIMES) for seed in range(3)]
Meetings = dict[int, list[tuple[int, ...]]]
# Rows that sent each other their graphs, and when.
MET: Meetings = {3: [(0, 1)], 5: [(3, 4, 5), (6, 8)], 6: [(1, 2)]}


def smoothed(
    team: TeamGraph, cfg: GraphConfig, met: Meetings
) -> tuple[list[np.ndarray], list[np.ndarray], Smoothing]:
    """Estimates and covariances after each iteration, and what is known at the end."""
    n_rows = len(team.poses)
    sent, cov = np.zeros((n_rows, N_ROBOTS), dtype=int), np.zeros((n_rows, 3, 3))
    smoothing, smoothers = no_smoothing(n_rows, N_ROBOTS), PerRobotSmoothers(cfg)
    estimate, estimates, covariances = team.poses[:, :1], [], []
    for t in range(N_TIMES):
        if t:
            step = se2.between(team.poses[:, t - 1], team.poses[:, t])
            estimate = np.concatenate([estimate, se2.compose(estimate[:, -1], step)[:, None]], axis=1)
        for group in met.get(t, []):
            sent = sent.copy()
            sent[np.ix_(group, [row % N_ROBOTS for row in group])] = t + 1
        heard = select_bearings(team.bearings, team.bearings.observer[:, 1] <= t)
        (estimate, cov), smoothing = smoothers.smoothed(
            smoothing,
            estimate,
            cov,
            edges=select(team.edges, team.edges.measured_at <= t),
            bearings=heard if cfg.outliers == "bearing" else select_bearings(heard, np.arange(0)),
            sent=sent,
        )
        estimates.append(estimate)
        covariances.append(cov)
    return estimates, covariances, smoothing


def alone(k: int, cfg: GraphConfig, teams: list[TeamGraph]) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """World k by itself, its measurements in the order of time."""
    first = N_ROBOTS * k
    met: Meetings = {
        t: [tuple(row - first for row in group) for group in groups if group[0] // N_ROBOTS == k]
        for t, groups in MET.items()
    }
    estimates, covariances, _ = smoothed(stacked([teams[k]]), cfg, met)
    return estimates, covariances


def assert_each_as_if_alone(cfg: GraphConfig, teams: list[TeamGraph]) -> Smoothing:
    """Compare a batch with its worlds, iteration by iteration."""
    estimates, covariances, smoothing = smoothed(stacked(teams), cfg, MET)
    for k in range(len(teams)):
        rows = slice(N_ROBOTS * k, N_ROBOTS * (k + 1))
        for found, own in zip((estimates, covariances), alone(k, cfg, teams), strict=True):
            for there, here in zip(found, own, strict=True):
                np.testing.assert_array_equal(there[rows], here)
    moved = estimates[-1] - stacked(teams).poses
    assert np.abs(moved).max() > 0.05  # else this compares dead reckoning with itself
    return smoothing


@pytest.mark.parametrize("third_party", ["fixed_told", "ignore"])
@pytest.mark.parametrize("outliers", ["none", "huber", "bearing"])
def test_a_world_among_others_is_that_world_alone(outliers: str, third_party: str) -> None:
    cfg = GraphConfig(estimator="every_step", outliers=outliers, third_party=third_party)
    smoothing = assert_each_as_if_alone(cfg, TEAMS)
    assert (smoothing.way == (BANDED if outliers == "none" else INCREMENTAL)).all()


@pytest.mark.parametrize(("sigma", "way"), [((1e-13, 1.0), INCREMENTAL), ((1e-6, 30.0), CAREFUL)])
def test_ways_are_each_robots_own(
    monkeypatch: pytest.MonkeyPatch, sigma: tuple[float, float], way: int
) -> None:
    """Some robots' graphs grow too large for a band, another's is short of digits for it, or for Cholesky."""
    monkeypatch.setattr("wifipgo.graph.per_robot_smoothing.MOST_IN_A_BAND", 2 * N_TIMES)
    teams, own = list(TEAMS), TEAMS[2].edges
    stiff = np.where((own.tail[:, :1] == 1) & (own.tail[:, 1:] >= 2), sigma, own.sigma)
    teams[2] = TEAMS[2]._replace(edges=replace(own, sigma=stiff))
    ways = assert_each_as_if_alone(GraphConfig(estimator="every_step"), teams).way.tolist()
    assert ways[:7] == [BANDED, INCREMENTAL, BANDED, INCREMENTAL, INCREMENTAL, INCREMENTAL, BANDED]
    assert ways[7:] == [way, BANDED]
