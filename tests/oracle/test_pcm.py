"""Consistency of measurement pairs against the covariance of the simulation's teams, and against chance."""

import numpy as np
import pytest
from scipy import stats
from support.graphs import random_graph

from wifipgo.graph.consistency import _chains as team_chains
from wifipgo.graph.consistency import loop_chi2
from wifipgo.graph.edges import Edges, select
from wifipgo.graph.outliers.pcm import _chains, consistent_edges, pair_chi2
from wifipgo.graph.posegraph import PoseGraph


def two_robots(seed: int, dims: int, sigma: float = 0.01) -> PoseGraph:
    """Two robots that meet often, with the noise that their information says."""
    _, graph = random_graph(seed, dims=dims, robots=2, poses=6, meetings=16, noise=sigma)
    columns = {name: getattr(graph, name) for name in PoseGraph.__slots__}
    information = np.tile(np.eye(graph.freedom) / sigma**2, (len(graph.tail), 1, 1))
    return PoseGraph(**(columns | {"information": information, "weight": np.ones(len(graph.tail))}))


def test_it_agrees_with_the_planar_teams() -> None:
    """The other implementation adds moments of levers, this one transports covariances."""
    graph = two_robots(0, dims=3, sigma=1e-4)
    keys = np.stack([graph.robot, np.tile(np.arange(6), 2)], axis=-1)  # without gaps
    edges = Edges.measured(
        tail=keys[graph.tail],
        head=keys[graph.head],
        z=graph.z.copy(),
        sigma=(1e-4, 1e-4),
        reported_pose=np.zeros_like(graph.z),
    )
    rows = np.flatnonzero(graph.between_robots)
    theirs = loop_chi2(select(edges, rows), team_chains(edges, 2), np.array([0, 1]))
    ours = pair_chi2(graph, _chains(graph), rows)
    np.testing.assert_allclose(ours, np.minimum(theirs, theirs.T), rtol=2e-2, atol=1e-6)


@pytest.mark.parametrize("dims", [3, 7])
def test_of_good_measurements_the_squares_have_their_law(dims: int) -> None:
    """Pairs without a measurement in common: one value a graph, uniform p-values."""
    p = []
    for seed in range(80):
        graph = two_robots(seed, dims)
        rows = np.flatnonzero(graph.between_robots)[[0, -1]]
        p.append(stats.chi2.sf(pair_chi2(graph, _chains(graph), rows)[0, 1], graph.freedom))
    assert stats.kstest(p, "uniform").pvalue > 0.01


def test_good_measurements_stay() -> None:
    kept = [consistent_edges(two_robots(seed, dims=7)) for seed in range(10)]
    assert np.mean(np.concatenate(kept)) > 0.9
