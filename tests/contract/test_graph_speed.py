"""The speed benchmark of the solvers measures graphs like those of the environment, and writes its rows."""

import json
from pathlib import Path

import numpy as np
import pytest

from benchmarks import graph_speed
from wifipgo import se2
from wifipgo.graph.solvers import solve_team


def test_walks_are_connected_and_odometry_leads_to_the_start(monkeypatch: pytest.MonkeyPatch) -> None:
    """A team's graph has odometry, places seen again and meetings; without noise, dead reckoning fits all."""
    monkeypatch.setattr(graph_speed, "SIGMA", (1e-9, 1e-9))
    start, edges = graph_speed.walked(5, 12, seed=3)
    ahead = edges.head[:, 1] - edges.tail[:, 1]
    assert (edges.head[:55, 0] == edges.tail[:55, 0]).all()
    assert (ahead[:55] == 1).all()
    assert (ahead[55:][~edges.between_robots[55:]] < -2).all()
    z = se2.between(start[tuple(edges.tail.T)], start[tuple(edges.head.T)])
    np.testing.assert_allclose(se2.between(edges.z, z), 0.0, atol=1e-6)


def test_rows_are_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Small graphs stand in for the real ones."""
    monkeypatch.setattr(graph_speed, "PAIRS", (4,))
    monkeypatch.setattr(graph_speed, "TEAM", (3, 4))
    graph_speed.main(graph_speed.GraphSpeedConfig(seconds=0.0, json=tmp_path / "new" / "rows.json"))
    rows = json.loads((tmp_path / "new" / "rows.json").read_text())["rows"]
    assert len(rows) == 8
    assert all(0.0 < row["fastest_ms"] <= row["median_ms"] for row in rows)


def test_a_step_from_far_away_arrives_where_one_from_nearby_does() -> None:
    """Undamped steps from a start that is turned by a radian find the same optimum, and stay there."""
    start, edges = graph_speed.walked(3, 12, seed=5)
    near, _ = solve_team(start, edges)
    far = start.copy()
    far[:, 1:] += np.random.default_rng(0).normal(size=far[:, 1:].shape) * [1.0, 1.0, 0.5]
    found, report = solve_team(far, edges)
    np.testing.assert_allclose(se2.between(near, found), 0.0, atol=1e-5)
    again, after = solve_team(found, edges)
    assert after.iterations <= 2
    np.testing.assert_allclose(after.chi2_after, report.chi2_after, rtol=1e-9)
    np.testing.assert_allclose(se2.between(again, found), 0.0, atol=1e-5)
