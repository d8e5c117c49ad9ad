"""Consistency of pairs of measurements against loops multiplied out, and against chance."""

import numpy as np
import pytest
from scipy import stats
from support.graphs import random_graph

from baselines.reproduce.encounters import EncounterConfig, simulate_encounter
from wifipgo import se2, se3
from wifipgo.graph.outliers.pcm import chain_odometry, consistent, consistent_edges, pair_chi2
from wifipgo.graph.posegraph import PoseGraph, keys_of, pose_graph


def two_robots(seed: int, dims: int, sigma: float = 0.01) -> PoseGraph:
    """Two robots that meet often, with the noise that their information says."""
    _, graph = random_graph(seed, dims=dims, robots=2, poses=6, meetings=16, noise=sigma)
    columns = {name: getattr(graph, name) for name in PoseGraph.__slots__}
    information = np.tile(np.eye(graph.freedom) / sigma**2, (len(graph.tail), 1, 1))
    return PoseGraph(**(columns | {"information": information, "weight": np.ones(len(graph.tail))}))


def way_round(graph: PoseGraph, first: int, second: int) -> list[tuple[int, bool]]:
    """Measurements of the loop through two of them and both robots' odometry, and which run forwards."""
    into = {int(graph.head[e]): int(e) for e in np.flatnonzero(graph.odometry)}

    def ends(e: int) -> tuple[int, int]:
        i, j = int(graph.tail[e]), int(graph.head[e])
        return (i, j) if graph.robot[i] < graph.robot[j] else (j, i)

    def along(i: int, j: int) -> list[tuple[int, bool]]:
        steps = [(into[k], i < j) for k in range(min(i, j) + 1, max(i, j) + 1)]
        return steps if i < j else steps[::-1]

    (a, b), (a_too, b_too) = ends(first), ends(second)
    there, back = int(graph.tail[first]) == a, int(graph.tail[second]) != a_too
    return [(first, there), *along(b, b_too), (second, back), *along(a_too, a)]


def loop_chi2(graph: PoseGraph, first: int, second: int) -> float:
    """Squared Mahalanobis error of one loop: its transforms are multiplied, their noise by differences."""
    space = se2 if graph.freedom == 3 else se3
    way, freedom, h = way_round(graph, first, second), graph.freedom, 1e-6

    def error(noise: np.ndarray) -> np.ndarray:
        T = space.exp(np.zeros((1, freedom)))
        for (e, forth), one in zip(way, noise, strict=True):
            z = space.compose(graph.z[e][None], space.exp(one[None]))
            T = space.compose(T, z if forth else space.inverse(z))
        return np.asarray(space.log(T)[0])

    zero, covariance = np.zeros((len(way), freedom)), np.zeros((freedom, freedom))
    for k, (e, _) in enumerate(way):
        J = np.empty((freedom, freedom))
        for axis in range(freedom):
            noise = zero.copy()
            noise[k, axis] = h
            J[:, axis] = (error(noise) - error(-noise)) / (2.0 * h)
        covariance += J @ np.linalg.inv(graph.information[e]) @ J.T
    off = error(zero)
    return float(off @ np.linalg.solve(covariance, off))


@pytest.mark.parametrize("dims", [3, 7])
def test_the_error_of_a_loop_is_that_of_its_transforms(dims: int) -> None:
    """Adjoints against differences of the product of all transforms of the loop."""
    graph = two_robots(0, dims, sigma=1e-3)
    rows = np.flatnonzero(graph.between_robots)[:6]
    ours = pair_chi2(graph, chain_odometry(graph), rows)
    for one, two in ((0, 1), (0, 5), (2, 4)):
        expected = loop_chi2(graph, int(rows[one]), int(rows[two]))
        np.testing.assert_allclose(ours[one, two], expected, rtol=2e-2)


@pytest.mark.parametrize("seed", range(4))
def test_a_team_and_a_graph_of_files_have_one_pcm(seed: int) -> None:
    e = simulate_encounter(EncounterConfig(n_outliers=seed), rng=np.random.default_rng(seed))
    robot, index = np.indices(e.start.shape[:2]).reshape(2, -1)
    graph = pose_graph(
        robot=robot,
        index=index,
        poses=e.start.reshape(-1, 3),
        tail=e.edges.tail,
        head=e.edges.head,
        z=e.edges.z,
        information=np.eye(3) / (e.edges.sigma[:, [0, 0, 1]] ** 2)[:, None, :],
    )
    keys = np.concatenate([keys_of(graph)[graph.tail], keys_of(graph)[graph.head]], axis=1).tolist()
    there = {tuple(key): bool(keep) for key, keep in zip(keys, consistent_edges(graph), strict=True)}
    here = np.concatenate([e.edges.tail, e.edges.head], axis=1).tolist()
    expected = [there[tuple(key)] for key in here]
    np.testing.assert_array_equal(consistent(e.edges, n_robots=2), expected)


@pytest.mark.parametrize("dims", [3, 7])
def test_of_good_measurements_the_squares_have_their_law(dims: int) -> None:
    """Pairs without a measurement in common: one value a graph, uniform p-values."""
    p = []
    for seed in range(80):
        graph = two_robots(seed, dims)
        rows = np.flatnonzero(graph.between_robots)[[0, -1]]
        p.append(stats.chi2.sf(pair_chi2(graph, chain_odometry(graph), rows)[0, 1], graph.freedom))
    assert stats.kstest(p, "uniform").pvalue > 0.01


def test_good_measurements_stay() -> None:
    kept = [consistent_edges(two_robots(seed, dims=7)) for seed in range(10)]
    assert np.mean(np.concatenate(kept)) > 0.9
