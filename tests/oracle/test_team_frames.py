"""Frames of a team whose loops are mostly wrong, against the truth that the right ones were made of."""

import numpy as np
import pytest
from support.graphs import between, compose, small

from wifipgo.errors import NumericalError
from wifipgo.graph.optimise import optimise
from wifipgo.graph.posegraph import PoseGraph, pose_graph
from wifipgo.graph.solvers.spatial import solve_graph
from wifipgo.graph.subgraphs import of_edges
from wifipgo.graph.team_frames import aligned_chains

ROBOTS, POSES, RIGHT = 3, 15, 8


def tunnels(
    dims: int, noise: float, seed: int = 0, wrong_ones: int = 16
) -> tuple[np.ndarray, PoseGraph, np.ndarray]:
    """Truth, a graph that says nothing of where anybody began, and which of its measurements are wrong."""
    rng, freedom = np.random.default_rng(seed), 3 if dims == 3 else 6
    robot, index = np.indices((ROBOTS, POSES)).reshape(2, -1)
    scale = np.concatenate([np.full(freedom - freedom // 2, 5.0), np.full(freedom // 2, 1.0)])
    truth = small(rng.normal(size=(ROBOTS * POSES, freedom)) * scale)
    row = np.arange(ROBOTS * POSES).reshape(ROBOTS, POSES)
    tail, head = [row[:, :-1].ravel()], [row[:, 1:].ravel()]
    for a, b in ((0, 1), (2, 1), (2, 0)):
        tail.append(rng.choice(row[a], RIGHT + wrong_ones))
        head.append(rng.choice(row[b], RIGHT + wrong_ones))
    i, j = np.concatenate(tail), np.concatenate(head)
    z = compose(between(truth[i], truth[j]), small(noise * rng.normal(size=(len(i), freedom))))
    place = np.arange(len(i)) - ROBOTS * (POSES - 1)
    wrong = (place >= 0) & (place % (RIGHT + wrong_ones) >= RIGHT)
    z[wrong] = small(rng.normal(size=(int(wrong.sum()), freedom)) * 2.0 * scale)
    key = np.stack([10 * robot, index], axis=1)
    origin = np.eye(dims)[-1] if dims == 7 else np.zeros(3)
    graph = pose_graph(
        robot=key[:, 0],
        index=key[:, 1],
        poses=np.tile(origin, (len(key), 1)),
        tail=key[i],
        head=key[j],
        z=z,
        information=np.tile(np.eye(freedom) / max(noise, 0.01) ** 2, (len(i), 1, 1)),
    )
    marked = {tuple(one[:2].round(9)) for one in z[wrong]}
    is_wrong = np.array([tuple(one[:2].round(9)) in marked for one in graph.z])
    return compose(between(truth[:1], truth), origin), graph, is_wrong


@pytest.mark.parametrize("dims", [3, 7])
def test_the_right_third_of_the_loops_says_where_all_are(dims: int) -> None:
    truth, graph, _ = tunnels(dims, noise=0.0)
    np.testing.assert_allclose(aligned_chains(graph), truth, atol=1e-6)


def test_robots_that_no_loop_leads_to_keep_their_first_pose() -> None:
    truth, graph, _ = tunnels(3, noise=0.0)
    alone = of_edges(graph, graph.odometry | ((graph.robot[graph.tail] + graph.robot[graph.head]) == 30))
    moved = compose(np.array([[4.0, -2.0, 0.5]]), truth)
    found = aligned_chains(alone.with_poses(moved))
    np.testing.assert_allclose(found[:POSES], moved[:POSES], atol=1e-6)
    expected = compose(moved[POSES], between(truth[POSES : POSES + 1], truth[POSES:]))
    np.testing.assert_allclose(found[POSES:], expected, atol=1e-6)


@pytest.mark.parametrize("dims", [3, 7])
def test_one_answer_from_three_starts_without_a_wrong_loop(dims: int) -> None:
    """From zeros, from wrong frames and from the truth; two loops in three are wrong."""
    truth, graph, is_wrong = tunnels(dims, noise=0.02)
    expected, _ = solve_graph(of_edges(graph, ~is_wrong), truth)
    rng = np.random.default_rng(1)
    lost = compose(small(rng.normal(size=(ROBOTS, graph.freedom)))[graph.robot // 10], truth)
    lost = compose(between(lost[:1], truth[:1]), lost)  # only the first robot begins where it is
    for start in (graph.poses, lost, truth):
        found, report = solve_graph(graph, start, initial="best", robust="gnc")
        assert report.converged
        (down,) = report.downweighted
        assert down.rows[down.weight < 0.5].tolist() == np.flatnonzero(is_wrong).tolist()
        gap = compose(between(found[:1], expected[:1]), found) - expected
        assert np.abs(gap[:, :2]).max() < 1e-3


def test_the_optimum_is_a_start_that_is_kept() -> None:
    _, graph, _ = tunnels(3, noise=0.02)
    found, report = solve_graph(graph, initial="frames", robust="gnc")
    again, second = solve_graph(graph, found, initial="best", robust="gnc")
    assert second.converged
    assert second.chi2_after == pytest.approx(report.chi2_after, rel=1e-6)
    np.testing.assert_allclose(again, found, atol=1e-4)


def test_a_worse_minimum_of_a_team_is_not_called_converged() -> None:
    """One right loop in nine: odometry and any loop between two robots lead to a wrong frame."""
    _, graph, is_wrong = tunnels(3, noise=0.02, wrong_ones=64)
    best, lost = optimise(graph, robust="gnc"), optimise(graph, robust="gnc", initial="odometry")
    assert best.converged
    assert not best.weight[is_wrong].any()
    assert not lost.converged
    assert "frames" in lost.doubt


def test_where_votes_cannot_be_counted_other_starts_are_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    """Noise beyond working precision leaves PCM without an answer; the given poses are near."""
    truth, graph, _ = tunnels(3, noise=0.02, wrong_ones=2)

    def singular(*_: object) -> None:
        raise np.linalg.LinAlgError("Singular matrix")

    monkeypatch.setattr("wifipgo.graph.team_frames.pair_chi2", singular)
    found, report = solve_graph(graph, truth, initial="best", robust="gnc")
    assert report.converged
    assert np.abs(found - truth)[:, :2].max() < 1.0
    with pytest.raises(NumericalError, match="frames of robots"):
        solve_graph(graph, truth, initial="frames", robust="gnc")
