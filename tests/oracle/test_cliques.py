"""Largest sets that agree: networkx's exact cliques, planted ones, and hundreds of good loops in seconds."""

import time

import networkx as nx
import numpy as np
import pytest

from wifipgo import se2
from wifipgo.graph.edges import Edges
from wifipgo.graph.outliers.cliques import largest_clique
from wifipgo.graph.outliers.pcm import consistent, consistent_sets
from wifipgo.graph.posegraph import PoseGraph, pose_graph


def random_agreement(n: int, share: float, seed: int) -> np.ndarray:
    upper = np.triu(np.random.default_rng(seed).random((n, n)) < share, 1)
    return upper | upper.T


@pytest.mark.parametrize("share", [0.0, 0.2, 0.5, 0.8, 0.95, 1.0])
def test_it_is_the_clique_of_networkx(share: float) -> None:
    """The same one of several largest too, so results do not move."""
    for n in (0, 1, 2, 7, 20, 40):
        agree = random_agreement(n, share, seed=n)
        expected, _ = nx.max_weight_clique(nx.from_numpy_array(agree), weight=None)
        members, proven = largest_clique(agree)
        assert proven
        assert members.tolist() == sorted(expected)


def test_a_search_that_is_cut_short_says_so_and_finds_the_planted_set() -> None:
    agree = random_agreement(400, 0.9, seed=1)
    planted = np.random.default_rng(2).permutation(400)[:120]
    agree[np.ix_(planted, planted)] = True
    members, proven = largest_clique(agree, exact_work=2_000)
    assert not proven
    assert len(members) >= 120
    assert agree[np.ix_(members, members)][~np.eye(len(members), dtype=bool)].all()
    np.testing.assert_array_equal(members, largest_clique(agree, exact_work=2_000).members)


def laps(n_loops: int, n_bad: int) -> tuple[PoseGraph, np.ndarray]:
    """One robot on a circle of 40 poses, lap after lap, that knows each place again; the last are wrong."""
    rng, n, sigma = np.random.default_rng(5), 40 + n_loops, np.array([0.02, 0.02, 0.01])
    step = np.array([0.5, 0.0, 2.0 * np.pi / 40])
    truth = np.zeros((n, 3))
    for row in range(1, n):
        truth[row : row + 1] = se2.compose(truth[row - 1 : row], step[None])
    tail = np.append(np.arange(n - 1), np.arange(n_loops))
    head = np.append(np.arange(1, n), np.arange(40, n))
    z = se2.between(truth[tail], truth[head]) + rng.normal(size=(len(tail), 3)) * sigma
    bad = len(tail) - 1 - rng.permutation(n_loops)[:n_bad]
    z[bad] += rng.uniform(0.5, 1.5, (n_bad, 3)) * rng.choice([-1.0, 1.0], (n_bad, 3))
    key = np.stack([np.zeros(n, dtype=np.int64), np.arange(n)], axis=1)
    information = np.tile(np.diag(1.0 / sigma**2), (len(tail), 1, 1))
    graph = pose_graph(
        robot=key[:, 0],
        index=key[:, 1],
        poses=truth,
        tail=key[tail],
        head=key[head],
        z=z,
        information=information,
    )
    is_bad = np.isin(graph.head, head[bad]) & ~graph.odometry
    return graph, is_bad


@pytest.mark.parametrize(("n_loops", "n_bad", "limit_s"), [(1000, 0, 10.0), (400, 100, 5.0)])
def test_hundreds_of_loops_take_seconds(n_loops: int, n_bad: int, limit_s: float) -> None:
    """1 000 loops were a RecursionError, 250 took a minute."""
    graph, is_bad = laps(n_loops, n_bad)
    begin = time.process_time()
    keep, _ = consistent_sets(graph)
    assert time.process_time() - begin < limit_s
    good = ~graph.odometry & ~is_bad
    assert keep[good].mean() > 0.85
    assert not keep[is_bad].any()


def test_hundreds_of_meetings_of_a_pair_take_seconds() -> None:
    """The same for the teams of the simulation."""
    rng, n = np.random.default_rng(0), 300
    truth = np.cumsum(rng.normal(size=(2, n, 3)) * [1.0, 1.0, 0.1], axis=1)
    robot, index = np.indices((2, n - 1)).reshape(2, -1)
    tail = np.concatenate([np.stack([robot, index], 1), np.stack([np.zeros(n, int), np.arange(n)], 1)])
    head = np.concatenate([np.stack([robot, index + 1], 1), np.stack([np.ones(n, int), np.arange(n)], 1)])
    z = se2.between(truth[tail[:, 0], tail[:, 1]], truth[head[:, 0], head[:, 1]])
    z += rng.normal(size=z.shape) * [0.1, 0.1, 0.02]
    edges = Edges.measured(tail=tail, head=head, z=z, sigma=(0.1, 0.02), reported_pose=np.zeros_like(z))
    begin = time.process_time()
    keep = consistent(edges, n_robots=2)
    assert time.process_time() - begin < 5.0
    assert keep[edges.between_robots].mean() > 0.85
