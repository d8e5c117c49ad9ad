"""The bench of the tunnels: costs by hand, verdicts at their limits, and what it says without data."""

from pathlib import Path

import numpy as np
import pytest
from support.graphs import random_graph

from benchmarks.tunnels import (
    BY_ROBOTS,
    Answer,
    Config,
    Row,
    demands_of,
    furthest_m,
    main,
    row_of,
    starts_of,
    truncated_cost,
)
from wifipgo.errors import BadInputError
from wifipgo.graph.posegraph import pose_graph


def answer(start: str, **figures: float) -> Row:
    """Just good enough."""
    least = {"kept": 600, "chi2": 7600.0, "cost": 5e4, "same_loops": 7e3, "furthest_m": 1.0, "cpu_s": 25.0}
    return Row(start=start, **{**least, **figures})  # type: ignore[arg-type]


def test_a_loop_costs_its_square_or_the_limit_and_odometry_always_its_square() -> None:
    """Sigma 1: 5 m off is 25; 99 % of chi-squares with 3 degrees of freedom lie below 11.345."""
    ends, z = np.array([[0, 1], [0, 2], [0, 2]]), np.array([[6.0, 0, 0], [2.0, 0, 0], [6.0, 0, 0]])
    graph = pose_graph(
        robot=np.zeros(3, dtype=int),
        index=np.arange(3),
        poses=np.array([[0.0, 0, 0], [1.0, 0, 0], [1.0, 0, 0]]),
        tail=np.array([[0, 0]] * 3),
        head=np.stack([np.zeros(3, dtype=int), ends[:, 1]], axis=1),
        z=z,
        information=np.tile(np.eye(3), (3, 1, 1)),
    )
    assert truncated_cost(graph, graph.poses) == pytest.approx(25.0 + 1.0 + 11.3449, abs=1e-3)
    found = Answer(graph.poses, np.array([1.0, 1.0, 0.0]), 1.0)
    row = row_of("odometry", graph, found, found)
    assert row.kept == 1
    assert row.chi2 == row.same_loops == pytest.approx(26.0)


def test_starts_differ_and_distance_is_in_metres() -> None:
    _, graph = random_graph(1, dims=7, start_noise=0.5)
    starts = list(starts_of(graph).values())
    for k, start in enumerate(starts):
        assert all(furthest_m(start, other) > 0.1 for other in starts[:k])
    moved = starts[0].copy()
    moved[2, :3] += [3.0, 0.0, 4.0]
    moved[3, 3:] *= -1.0
    assert furthest_m(starts[0], moved) == pytest.approx(5.0)


def test_a_demand_is_held_up_to_its_limit() -> None:
    """The worst of all starts counts, and only the gap of the robots' answer."""
    rows = [answer("a"), answer("b"), answer(BY_ROBOTS, cost=5.09e4, same_loops=7.1e3, kept=3)]
    assert all(demand.held for demand in demands_of(rows))
    worse = {"kept": 599, "chi2": 7601.0, "cpu_s": 26.0, "furthest_m": 1.1}
    for field, value in worse.items():
        held = [demand.held for demand in demands_of([rows[0], answer("b", **{field: value}), rows[2]])]
        assert held.count(False) == 1
    for field, value in {"cost": 5.2e4, "same_loops": 7.2e3, "furthest_m": 1.1}.items():
        held = [demand.held for demand in demands_of([*rows[:2], answer(BY_ROBOTS, **{field: value})])]
        assert held.count(False) == 1


def test_without_data_it_says_where_to_get_them(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match=r"data must be a folder .* docs/howto/data\.md"):
        main(Config(data=tmp_path))
