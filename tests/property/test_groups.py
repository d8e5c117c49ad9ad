"""Meetings of several worlds held at once: each leaves what it leaves alone, to the bit."""

from dataclasses import replace
from itertools import product
from types import ModuleType

import numpy as np
import pytest
from support.stacked_graphs import stacked, team_graph

from wifipgo.graph import solve
from wifipgo.graph.backends import BACKENDS, Solution
from wifipgo.graph.distributed import Channel
from wifipgo.graph.outliers.methods import OUTLIER_METHODS
from wifipgo.graph.solvers import THIRD_PARTY, _banded_descent, groups
from wifipgo.graph.solvers.groups import GroupOptimum, solve_groups

TEAMS = [team_graph(seed, n_times=6, n_met=6) for seed in range(3)]
GROUPS = [[0, 1], [3, 4, 5], [6, 8]]  # rows; of one world each
BATCH = stacked(TEAMS)
# What is left of every method when robots meet: gates on direction weighed measurements as they came.
METHODS = {name: method for name, method in OUTLIER_METHODS.items() if method == method.at_rendezvous()}
WAYS = [
    (backend, outliers)
    for backend, outliers in product(BACKENDS, METHODS)
    if BACKENDS[backend].bearings or not METHODS[outliers].bearings
]


def channels(loss: float) -> list[Channel]:
    """A channel a world, with chance of its own."""
    return [Channel(loss=loss, attempts=10, rng=np.random.default_rng(k)) for k in range(len(TEAMS))]


def same(one: Solution | GroupOptimum | None, other: Solution | GroupOptimum | None) -> bool:
    """Whether two answers are equal, to the bit."""
    if one is None or other is None:
        return one is other
    if one.covariances is None or other.covariances is None:
        return one.covariances is other.covariances and np.array_equal(one.poses, other.poses)
    return np.array_equal(one.poses, other.poses) and np.array_equal(one.covariances, other.covariances)


@pytest.mark.parametrize("third_party", THIRD_PARTY)
@pytest.mark.parametrize(("backend", "outliers"), WAYS)
def test_a_group_among_others_finds_what_it_finds_alone(
    backend: str, outliers: str, third_party: str
) -> None:
    solve_by, sent, sent_alone = BACKENDS[backend].solve, channels(0.1), channels(0.1)
    method, moved = METHODS[outliers], []
    found = solve_by(*BATCH, groups=GROUPS, channels=sent, method=method, third_party=third_party)
    for k, (team, group) in enumerate(zip(TEAMS, GROUPS, strict=True)):
        own, channel = [robot - 3 * k for robot in group], sent_alone[k]
        (alone,) = solve_by(*team, groups=[own], channels=[channel], method=method, third_party=third_party)
        assert sent[k].bytes_sent == channel.bytes_sent
        assert same(found[k], alone)
        moved += [] if alone is None else [np.abs(alone.poses - team.poses[own]).max()]
    assert max(moved) > 0.01  # else this compares starts with themselves


def test_answers_are_in_the_order_of_groups_and_of_their_robots() -> None:
    poses, edges, _ = BATCH
    back = solve_groups(poses, edges, groups=[group[::-1] for group in GROUPS[::-1]])
    for group, one in zip(GROUPS, back[::-1], strict=True):
        best, report = solve(poses, edges, robots=group[::-1], covariances=True)
        assert same(one, Solution(best[group[::-1]], report.last_pose_covariances))


@pytest.mark.parametrize(
    ("where", "limit", "value"),
    [(_banded_descent, "WIDEST", 3.0 * 18 * 30**2), (groups, "MOST_POSES", 12)],
)
def test_a_wide_band_among_narrow_ones_is_left_out(
    monkeypatch: pytest.MonkeyPatch, where: ModuleType, limit: str, value: float
) -> None:
    poses, edges, _ = BATCH
    every = solve_groups(poses, edges, groups=GROUPS)
    monkeypatch.setattr(where, limit, value)
    some = solve_groups(poses, edges, groups=GROUPS)
    left = [one is None for one in some]
    assert 0 < sum(left) < len(GROUPS)
    for one, other in zip(some, every, strict=True):
        assert one is None or same(one, other)


def test_one_singular_group_disturbs_nobody() -> None:
    """A measurement 1e10 times as sure as the others leaves no digits to Cholesky."""
    poses, edges, _ = BATCH
    sigma = edges.sigma.copy()
    sigma[(edges.tail[:, 0] == 3) & (edges.tail[:, 1] == 4)] = 1e-13
    found = solve_groups(poses, replace(edges, sigma=sigma), groups=GROUPS)
    every = solve_groups(poses, edges, groups=GROUPS)
    assert found[1] is None or found[1].covariances is None
    assert same(found[0], every[0])
    assert same(found[2], every[2])
