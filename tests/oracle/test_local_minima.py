"""Optima that a search reaches only from another start or by QR, and minima that are not called optima."""

import numpy as np
import pytest
from support.graphs import random_graph

from wifipgo import se2
from wifipgo.errors import NumericalError
from wifipgo.graph import Edges, last_pose_covariances, marginal_covariances, solve
from wifipgo.graph.optimise import optimise
from wifipgo.graph.posegraph import PoseGraph, pose_graph
from wifipgo.graph.solvers.spatial import solve_graph
from wifipgo.graph.subgraphs import from_team


def ring(n: int, *, sigma_m: float = 0.05, stiff: float = 1.0) -> PoseGraph:
    """One robot once around and back, whose poses all begin at zero; one turn has other information."""
    rng, turn = np.random.default_rng(3), 2.0 * np.pi / n
    tail, head = np.arange(n), np.roll(np.arange(n), -1)
    z = np.tile([1.0, 0.0, turn], (n, 1)) + rng.normal(size=(n, 3)) * [sigma_m, sigma_m, 0.01]
    information = np.tile(np.diag([sigma_m**-2, sigma_m**-2, 1e4]), (n, 1, 1))
    information[n // 2] *= stiff
    key = np.stack([np.zeros(n, dtype=np.int64), np.arange(n)], axis=1)
    return pose_graph(
        robot=key[:, 0],
        index=key[:, 1],
        poses=np.zeros((n, 3)),
        tail=key[tail],
        head=key[head],
        z=z,
        information=information,
    )


@pytest.mark.parametrize("robust", ["none", "huber", "gnc"])
def test_a_ring_without_a_first_guess(robust: str) -> None:
    """From zeros the search ends in a knot of 1 000 times the cost; odometry and chordal poses lead down."""
    graph = ring(20)
    best, report = solve_graph(graph, initial="best", robust=robust)
    expected, chordal = solve_graph(graph, initial="chordal", robust=robust)
    assert report.converged
    assert report.chi2_after == pytest.approx(chordal.chi2_after, rel=1e-6)
    assert report.chi2_after < 20.0
    np.testing.assert_allclose(best, expected, atol=1e-4)


def test_a_worse_minimum_is_not_called_converged() -> None:
    _, report = solve_graph(ring(20), initial="given")
    assert not report.converged
    assert "chordal" in report.doubt
    assert not optimise(ring(20), initial="given").converged
    assert optimise(ring(20)).converged


@pytest.mark.parametrize("stiff", [1e6, 1e9, 1e12])
def test_one_measurement_much_surer_than_the_rest(stiff: float) -> None:
    """Where that one is exact the rest share the error of the ring: known by a solve without it."""
    graph = ring(12, stiff=stiff)
    poses, report = solve_graph(graph, initial="best")
    softer, known = solve_graph(ring(12, stiff=1e4), initial="chordal")
    assert report.converged
    assert report.chi2_after == pytest.approx(known.chi2_after, rel=1e-2)
    np.testing.assert_allclose(poses, softer, atol=1e-3)
    assert np.isfinite(marginal_covariances(graph, poses, np.arange(1, 12))).all()


def test_a_search_that_is_cut_says_so_and_goes_on_if_allowed() -> None:
    _, graph = random_graph(5, dims=7, start_noise=1.0)
    poses, cut = solve_graph(graph, max_iterations=1)
    assert not cut.converged
    assert cut.doubt
    assert np.isfinite(poses).all()
    _, whole = solve_graph(graph, max_iterations=400)
    assert whole.converged
    assert whole.chi2_after < cut.chi2_after


def test_a_kilometre_between_poses_known_to_centimetres() -> None:
    """The check of the result failed, and the poses were lost."""
    n, rng = 12, np.random.default_rng(0)
    graph = ring(n)
    z = graph.z.copy()
    z[:, :2] *= 1e4
    poses = np.zeros((n, 3))
    for k in range(1, n):
        poses[k : k + 1] = se2.compose(poses[k - 1 : k], z[k - 1 : k])
    columns = {name: getattr(graph, name) for name in PoseGraph.__slots__}
    far = PoseGraph(**(columns | {"z": z, "poses": poses + rng.normal(size=(n, 3)) * [1e3, 1e3, 0.1]}))
    outcome = optimise(far)
    assert np.isfinite(outcome.poses).all()


def test_what_cannot_be_solved_names_the_pose() -> None:
    """Information at the ends of the range of numbers: no elimination has the digits."""
    graph = ring(6)
    information = graph.information.copy()
    information[2] *= 1e300
    information[3] *= 1e-300
    columns = {name: getattr(graph, name) for name in PoseGraph.__slots__}
    extreme = PoseGraph(**(columns | {"information": information}))
    try:
        poses, _ = solve_graph(extreme)
    except NumericalError as error:
        assert "working precision" in str(error)  # noqa: PT017
    else:
        assert np.isfinite(poses).all()


def team(sigma_m: float) -> tuple[np.ndarray, Edges]:
    """Two robots on a line that see each other, one measurement of another noise."""
    tail = np.array([[0, 0], [0, 1], [1, 0], [1, 1], [0, 2]])
    head = np.array([[0, 1], [0, 2], [1, 1], [1, 2], [1, 2]])
    z = np.array([[1.0, 0.0, 0.1]] * 4 + [[0.0, 1.0, 0.0]])
    sigma = np.array([[0.1, 0.05]] * 4 + [[sigma_m, sigma_m]])
    edges = Edges.measured(tail=tail, head=head, z=z, sigma=sigma, reported_pose=np.zeros((5, 3)))
    poses = np.zeros((2, 3, 3))
    poses[1, :, 1] = 1.0
    poses[:, :, 0] = np.arange(3)
    return poses, edges


@pytest.mark.parametrize("loss", ["none", "huber", "gnc"])
def test_a_team_with_one_measurement_that_is_exact(loss: str) -> None:
    poses, edges = team(1e-7)
    solved, report = solve(poses, edges, robots=[0, 1], loss=loss, covariances=True)
    seen = se2.between(solved[0, 2:], solved[1, 2:])[0]
    if loss == "none":
        np.testing.assert_allclose(seen, [0.0, 1.0, 0.0], atol=1e-5)
    assert np.isfinite(solved).all()
    assert report.last_pose_covariances is None or np.isfinite(report.last_pose_covariances).all()
    assert np.isfinite(last_pose_covariances(solved, edges, robots=[0, 1])).all()


@pytest.mark.parametrize("initial", ["chordal", "best"])
def test_a_team_from_chordal_poses(initial: str) -> None:
    poses, edges = team(0.05)
    expected, _ = solve(poses, edges, robots=[0, 1])
    lost = poses.copy()
    lost[:, 1:] = 0.0
    lost[:, 1:, 2] = 3.0
    found, report = solve(lost, edges, robots=[0, 1], initial=initial)
    assert report.converged
    np.testing.assert_allclose(found, expected, atol=1e-4)


@pytest.mark.parametrize("initial", ["given", "chordal", "odometry", "best"])
@pytest.mark.parametrize("dims", [3, 7])
def test_known_poses_stay_whatever_the_start(initial: str, dims: int) -> None:
    """Two that disagree with the measurements between them: from odometry they were given up."""
    _, graph = random_graph(2, dims=dims, start_noise=0.1)
    fixed = np.array([3, 9])
    poses = graph.poses.copy()
    poses[fixed[1], :2] += 3.0
    known = graph.with_poses(poses)
    found, report = solve_graph(known, fixed=fixed, initial=initial)
    expected, _ = solve_graph(known, fixed=fixed)
    assert report.converged
    np.testing.assert_allclose(found[fixed], poses[fixed], atol=1e-5)
    np.testing.assert_allclose(found, expected, atol=1e-3)


def test_a_search_of_a_team_that_is_cut_says_so_and_goes_on_if_allowed() -> None:
    """Huber's loss from a bad start takes more than two steps."""
    poses, edges = team(0.05)
    lost = poses.copy()
    lost[:, 1:] = [3.0, -3.0, 2.0]
    _, cut = solve(lost, edges, robots=[0, 1], loss="huber", max_iterations=1)
    assert not cut.converged
    assert "iterations" in cut.doubt
    _, whole = solve(lost, edges, robots=[0, 1], loss="huber", max_iterations=400)
    assert whole.converged
    assert whole.chi2_after < cut.chi2_after


def as_team(graph: PoseGraph) -> tuple[np.ndarray, Edges]:
    """A graph of one robot in the arrays of a team, for the solver of teams."""
    sigma = 1.0 / np.sqrt(np.diagonal(graph.information, axis1=1, axis2=2)[:, [0, 2]])
    key = np.stack([graph.robot, graph.index], axis=1)
    edges = Edges.measured(tail=key[graph.tail], head=key[graph.head], z=graph.z, sigma=sigma)
    return graph.poses[None], edges


@pytest.mark.parametrize("loss", ["none", "huber", "gnc"])
def test_a_worse_minimum_of_a_team_is_not_called_converged(loss: str) -> None:
    """The ring again: both solvers find the same optimum, and a knot, which squares end in, is doubted."""
    poses, edges = as_team(ring(20))
    _, knot = solve(poses, edges, robots=[0], loss=loss)
    best, report = solve(poses, edges, robots=[0], loss=loss, initial="best")
    expected, _ = solve_graph(ring(20), initial="best", robust=loss)
    assert knot.converged == (knot.chi2_after < 1.001 * report.chi2_after) == (loss != "none")
    assert knot.converged or "a worse local minimum" in knot.doubt
    assert report.converged
    np.testing.assert_allclose(best[0], expected, atol=1e-4)


@pytest.mark.parametrize("loss", ["none", "huber", "gnc"])
def test_known_poses_of_a_team_stay(loss: str) -> None:
    """Two known poses that measurements speak against; the solver of graphs with any keys is the oracle."""
    poses, edges = team(0.05)
    poses[0, 2] += [0.4, -0.3, 0.1]
    poses[1, 1] += [-0.2, 0.1, 0.0]
    fixed = np.array([[0, 2], [1, 1]])
    solved, report = solve(poses, edges, robots=[0, 1], loss=loss, fixed=fixed)
    rows = np.array([0, 2, 3, 4])  # the first of each robot, and those two
    expected, _ = solve_graph(from_team(poses, edges), fixed=rows, robust=loss)
    assert (solved[tuple(fixed.T)] == poses[tuple(fixed.T)]).all()
    np.testing.assert_allclose(solved.reshape(-1, 3), expected, atol=2e-4)
    assert report.converged
    assert len(solve(poses, edges, robots=[0, 1], fixed=fixed[:0])[0]) == 2


@pytest.mark.parametrize("fixed", [[[2, 0]], [[0, 3]], [[0, -1]]])
def test_known_poses_that_are_not_there(fixed: list[list[int]]) -> None:
    poses, edges = team(0.05)
    with pytest.raises(ValueError, match="robots that take part"):
        solve(poses, edges, robots=[0, 1], fixed=np.array(fixed))


def test_truncation_of_a_team_begins_where_it_is_told() -> None:
    """More loops are wrong, and alike, than right: a solve that trusts all of them first follows these."""
    rng, n = np.random.default_rng(5), 12
    key = np.stack([np.zeros(n, dtype=np.int64), np.arange(n)], axis=1)
    truth = np.stack([np.arange(n), np.zeros(n), np.zeros(n)], axis=1)
    tail, head = np.concatenate([key[:-1], key[:10]]), np.concatenate([key[1:], key[2:]])
    z = se2.between(truth[tail[:, 1]], truth[head[:, 1]]) + rng.normal(size=(len(tail), 3)) * 0.01
    wrong = n - 1 + np.arange(6)
    z[wrong] += [0.0, 1.0, 0.8]
    sigma = np.tile([0.05, 0.05], (len(tail), 1))
    sigma[: n - 1] *= 3.0  # odometry bends
    edges = Edges.measured(tail=tail, head=head, z=z, sigma=sigma)
    solved, report = solve(truth[None], edges, robots=[0], loss="gnc")
    assert report.downweighted[0].rows.tolist() == wrong.tolist()
    np.testing.assert_allclose(solved[0], truth, atol=0.1)
    graph, weighed = solve_graph(from_team(truth[None], edges), robust="gnc")
    np.testing.assert_allclose(solved[0], graph, atol=1e-4)
    assert len(weighed.downweighted[0].rows) == len(wrong)
