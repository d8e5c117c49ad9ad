"""Squares without gtsam's objects against gtsam: the same steps, the same optimum, the same covariances.

Below about 1e-3 rad, digits cancel in gtsam's slopes of the logarithm (at 3e-5 rad four are left), so
tolerances against it are those of its slopes; ours are held to finite differences at any turn.
"""

from dataclasses import replace

import gtsam
import numpy as np
import pytest

from wifipgo import se2
from wifipgo.graph import Edges, solve
from wifipgo.graph.edges import select
from wifipgo.graph.solvers import _banded_cholesky as banded
from wifipgo.graph.solvers import _banded_descent
from wifipgo.graph.solvers._banded_descent import banded_optimum
from wifipgo.graph.solvers._gtsam_search import as_values, covariances_of, least_squares
from wifipgo.graph.solvers._linearised import Poses, squares
from wifipgo.graph.solvers._problem import KNOWN_START, REPORTED_SIGMA, UNKNOWN_START, Problem, build, posed

SIGMA = (0.1, 0.05)


def walked(seed: int, n_times: int = 12, noise: float = 1.0) -> tuple[np.ndarray, Edges]:
    """Dead reckoning of three robots; steps, places seen again, meetings of any two, all with weights."""
    rng = np.random.default_rng(seed)
    truth = np.cumsum(rng.uniform(-1.0, 1.0, (3, n_times, 3)), axis=1)
    robot, t = np.indices((3, n_times - 1)).reshape(2, -1)
    steps = np.stack([robot, t], axis=1), np.stack([robot, t + 1], axis=1)
    robot, t = rng.integers(0, 3, 15), rng.integers(3, n_times, 15)
    again = np.stack([robot, t], axis=1), np.stack([robot, rng.integers(0, t - 1)], axis=1)
    robot, other = rng.integers(0, 3, 15), rng.integers(1, 3, 15)
    i, j = rng.integers(1, n_times, (2, 15))
    met = np.stack([robot, i], axis=1), np.stack([(robot + other) % 3, j], axis=1)
    tail, head = (np.concatenate(ends) for ends in zip(steps, again, met, strict=True))
    seen = truth[tuple(head.T)]
    z = se2.between(truth[tuple(tail.T)], seen)
    z += noise * rng.normal(size=z.shape) * np.array(SIGMA)[[0, 0, 1]]
    start, odometry = truth.copy(), z[: 3 * (n_times - 1)].reshape(3, n_times - 1, 3)
    for k in range(n_times - 1):
        start[:, k + 1] = se2.compose(start[:, k], odometry[:, k])
    told = seen + noise * rng.normal(size=seen.shape) * np.array(REPORTED_SIGMA)[[0, 0, 1]]
    weight = rng.uniform(0.3, 1.0, len(tail))
    return start, Edges.measured(tail=tail, head=head, z=z, sigma=SIGMA, weight=weight, reported_pose=told)


def problem_of(
    poses: np.ndarray,
    edges: Edges,
    robots: list[int],
    third_party: str = "fixed_told",
    start_sigma: tuple[float, float] = KNOWN_START,
) -> Problem:
    return posed(
        poses,
        edges,
        groups=[robots],
        third_party=third_party,
        told_sigma=REPORTED_SIGMA,
        start_sigma=start_sigma,
    )


CASES = [
    ([0], "fixed_told", KNOWN_START),
    ([2, 0], "fixed_told", KNOWN_START),
    ([0, 1], "ignore", KNOWN_START),
    ([1, 2], "fixed_told", UNKNOWN_START),
    ([0, 1, 2], "ignore", KNOWN_START),
]


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(("robots", "third_party", "start_sigma"), CASES)
def test_the_way_down_is_that_of_gtsam(
    seed: int, robots: list[int], third_party: str, start_sigma: tuple[float, float]
) -> None:
    """Steps, errors, poses and, at the same poses, covariances; the rest is the rounding of either."""
    poses, edges = walked(seed)
    problem = problem_of(poses, edges, robots, third_party, start_sigma)
    theirs = least_squares(build(problem, edges, huber=False), as_values(problem.start))
    ours = banded_optimum(problem, edges)
    assert ours is not None
    assert ours.iterations == theirs.iterations
    np.testing.assert_allclose([ours.before, ours.after], [theirs.before, theirs.after], rtol=1e-9)
    np.testing.assert_allclose(ours.poses, theirs.poses, atol=1e-6)
    rows = np.array([0, len(problem.start) - 1, 5])
    there = covariances_of(theirs.graph, as_values(ours.poses), rows)
    np.testing.assert_allclose(ours.covariances(rows), there, rtol=1e-5, atol=1e-8)


def off_by(turn_rad: float) -> tuple[Problem, Edges]:
    """Two poses, one measured from the other, whose turn is off."""
    poses = np.array([[[0.0, 0.0, 0.0], [1.0, 2.0, 0.5 + turn_rad]]])
    z = np.array([[1.2, 1.7, 0.5]])
    edges = Edges.measured(tail=np.array([[0, 0]]), head=np.array([[0, 1]]), z=z, sigma=SIGMA)
    return problem_of(poses, edges, [0], start_sigma=(1.0, 1.0)), edges


def dense(band: np.ndarray) -> np.ndarray:
    """The symmetric matrix of a band of diagonals."""
    n = band.shape[1]
    lower = sum(np.diag(diagonal[: n - k], -k) for k, diagonal in enumerate(band))
    return lower + np.tril(lower, -1).T


@pytest.mark.parametrize("turn_rad", [0.0, 0.02, 0.3, -3.0])
def test_residuals_and_slopes_are_those_of_gtsam(turn_rad: float) -> None:
    """Half the chi-square, its slope and the information; gtsam's are in the axes of each pose."""
    problem, edges = off_by(turn_rad)
    graph, values = build(problem, edges, huber=False), as_values(problem.start)
    sq, start = squares(problem.chains, edges)
    at = banded.linearised(sq, start)
    slope = banded.slopes(sq, at)
    order = gtsam.Ordering()
    for key in sq.order.tolist():
        order.push_back(key)
    information, pull = graph.linearize(values).hessian(order)
    yaw_rad = problem.start[sq.order, 2]
    turn = np.eye(6)
    for k, (c, s) in enumerate(zip(np.cos(yaw_rad), np.sin(yaw_rad), strict=True)):
        turn[3 * k : 3 * k + 2, 3 * k : 3 * k + 2] = [[c, -s], [s, c]]
    np.testing.assert_allclose(at.error, graph.error(values), rtol=1e-12)
    np.testing.assert_allclose(banded.gradient(sq, at, slope), -turn @ pull, rtol=1e-9, atol=1e-8)
    found = dense(*banded.normal_equations(sq, at, slope))
    np.testing.assert_allclose(found, turn @ information @ turn.T, rtol=1e-9, atol=1e-8)


@pytest.mark.parametrize("turn_rad", [0.0, 1e-9, 3e-5, 0.99e-4, 1.01e-4, 1e-3, 0.3, -3.0])
def test_slopes_are_those_of_finite_differences(turn_rad: float) -> None:
    """Of the residuals, over sigma, by x, y and yaw of both poses: at any turn."""
    problem, edges = off_by(turn_rad)
    sq, start = squares(problem.chains, edges)

    def residuals(move: np.ndarray) -> np.ndarray:
        """Over sigma, both poses moved."""
        p_m, yaw_rad = start.p_m.copy(), start.yaw_rad.copy()
        p_m[:2] += move[::3] + 1j * move[1::3]
        yaw_rad[:2] += move[2::3]
        at = banded.linearised(sq, Poses(p_m, yaw_rad))
        rows = np.stack([at.off_m.real, at.off_m.imag, at.away_rad])
        return (rows * np.sqrt(sq.information[[0, 0, 1]])).ravel()

    jacobian = np.stack([residuals(h) - residuals(-h) for h in 1e-6 * np.eye(6)], axis=1) / 2e-6
    at = banded.linearised(sq, start)
    slope = banded.slopes(sq, at)
    found = dense(*banded.normal_equations(sq, at, slope))
    np.testing.assert_allclose(found, jacobian.T @ jacobian, rtol=1e-7, atol=1e-5)
    down = jacobian.T @ residuals(np.zeros(6))
    np.testing.assert_allclose(banded.gradient(sq, at, slope), down, rtol=1e-7, atol=1e-5)


def test_poses_that_nothing_holds_are_left_to_gtsam() -> None:
    """The last two poses know of each other only: no band, and an answer all the same."""
    poses, edges = walked(0, noise=0.0)
    alone = select(edges, (edges.tail[:, 0] == 0) & (edges.head[:, 0] == 0))
    last = alone.tail[:, 1] >= 10, alone.head[:, 1] >= 10
    loose = select(alone, last[0] == last[1])
    assert banded_optimum(problem_of(poses, loose, [0]), loose) is None
    solved, _ = solve(poses, loose, robots=[0])
    assert np.isfinite(solved).all()


def test_a_wide_band_is_left_to_gtsam(monkeypatch: pytest.MonkeyPatch) -> None:
    """Either way gives the same poses and report."""
    poses, edges = walked(1)
    ours, report = solve(poses, edges, robots=[0, 1], covariances=True)
    monkeypatch.setattr(_banded_descent, "WIDEST", 0.0)
    theirs, other = solve(poses, edges, robots=[0, 1], covariances=True)
    np.testing.assert_allclose(ours, theirs, atol=1e-6)
    np.testing.assert_allclose(report.chi2_after, other.chi2_after, rtol=1e-9)
    assert report.last_pose_covariances is not None
    assert other.last_pose_covariances is not None
    np.testing.assert_allclose(
        report.last_pose_covariances, other.last_pose_covariances, rtol=1e-5, atol=1e-8
    )


@pytest.mark.parametrize("robots", [[0], [0, 1, 2]])
def test_next_to_no_weight_is_none(robots: list[int]) -> None:
    start, edges = walked(3)
    met = np.arange(len(edges)) >= len(edges) - 15
    none, hardly = (replace(edges, weight=np.where(met, least, edges.weight)) for least in (0.0, 5e-324))
    expected, report = solve(start, none, robots=robots)
    solved, same = solve(start, hardly, robots=robots)
    np.testing.assert_array_equal(solved, expected)
    assert (same.n_used, same.n_dropped) == (report.n_used, report.n_dropped)
