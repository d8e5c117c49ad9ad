"""Poses that minimise what Err sums, against scipy on the sum written out."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from wifipgo import se2
from wifipgo.errors import BadInputError
from wifipgo.graph.backends import BACKENDS, Solution
from wifipgo.graph.bearings import Bearings
from wifipgo.graph.config import GraphConfig
from wifipgo.graph.edges import Edges
from wifipgo.graph.metrics import residual_error
from wifipgo.graph.outliers.methods import OutlierMethod
from wifipgo.graph.solve_weights import SOLVE_WEIGHTS
from wifipgo.graph.solvers import last_pose_covariances


def met(sigmas: tuple[float, float], seed: int = 0) -> tuple[np.ndarray, Edges]:
    """Dead reckoning and edges of two robots, each with its own noise, that drive four steps and meet."""
    rng = np.random.default_rng(seed)
    truth = np.cumsum(rng.uniform(0.2, 1.0, (2, 5, 3)), axis=1)
    own = [((r, t), (r, t + 1)) for r in range(2) for t in range(4)]
    tail, head = np.array([*own, ((0, 2), (1, 2)), ((1, 4), (0, 4)), ((0, 4), (0, 0))]).transpose(1, 0, 2)
    sigma = np.array(sigmas)[tail[:, 0]][:, None] * [1.0, 0.5]
    T_world_head = truth[tuple(head.T)]
    z = (
        se2.between(truth[tuple(tail.T)], T_world_head)
        + rng.normal(size=(len(tail), 3)) * sigma[:, [0, 0, 1]]
    )
    start = truth.copy()
    for t in range(4):
        start[:, t + 1] = se2.compose(start[:, t], z[:8].reshape(2, 4, 3)[:, t])
    return start, Edges.measured(tail=tail, head=head, z=z, sigma=sigma, reported_pose=T_world_head)


def solved(start: np.ndarray, edges: Edges, weights: str) -> Solution:
    found = SOLVE_WEIGHTS[weights](BACKENDS["gtsam"].solve)(
        start,
        edges,
        Bearings.empty(),
        groups=[(0, 1)],
        method=OutlierMethod(),
        third_party="ignore",
        channels=[],
    )
    assert found[0] is not None
    return found[0]


def plain_squares(free: np.ndarray, start: np.ndarray, edges: Edges) -> np.ndarray:
    """Residuals in metres and radians, first poses held."""
    poses = start.copy()
    poses[:, 1:] = free.reshape(2, 4, 3)
    d = poses[tuple(edges.head.T)] - poses[tuple(edges.tail.T)]
    c, s = np.cos(poses[tuple(edges.tail.T)][:, 2]), np.sin(poses[tuple(edges.tail.T)][:, 2])
    off = np.stack(
        [d[:, 0] - c * edges.z[:, 0] + s * edges.z[:, 1], d[:, 1] - s * edges.z[:, 0] - c * edges.z[:, 1]]
    )
    return np.concatenate([off.ravel(), 2.0 * np.sin(0.5 * (d[:, 2] - edges.z[:, 2]))])


def test_unit_weights_minimise_what_err_sums() -> None:
    start, edges = met((0.05, 0.6))
    best = least_squares(plain_squares, start[:, 1:].ravel(), args=(start, edges), xtol=1e-12, ftol=1e-12)
    found = solved(start, edges, "unit").poses
    cost = np.square(plain_squares(found[:, 1:].ravel(), start, edges)).sum()
    assert cost == pytest.approx(2.0 * best.cost, rel=2e-2)  # of turns, the solver squares the angle itself
    true_weights = solved(start, edges, "information").poses
    assert cost < 0.8 * np.square(plain_squares(true_weights[:, 1:].ravel(), start, edges)).sum()


def test_err_of_both_robots_is_that_sum_once_they_told_each_other() -> None:
    start, edges = met((0.1, 0.3))
    now = start[tuple(edges.head.T)]
    told = Edges.measured(tail=edges.tail, head=edges.head, z=edges.z, sigma=edges.sigma, reported_pose=now)
    summed = np.square(plain_squares(start[:, 1:].ravel(), start, edges)).sum()
    assert residual_error(start, told).sum() == pytest.approx(summed)


def test_weights_that_are_alike_give_one_answer() -> None:
    """Where all measurements have one sigma in m and rad, its size moves nothing."""
    start, edges = met((0.2, 0.2))
    alike = Edges.measured(
        tail=edges.tail,
        head=edges.head,
        z=edges.z,
        sigma=(0.2, 0.2),
        reported_pose=edges.reported_pose,
    )
    one, other = (solved(start, alike, weights) for weights in ("information", "unit"))
    np.testing.assert_allclose(one.poses, other.poses, atol=1e-4)


def test_covariances_are_those_of_the_true_noise_at_the_poses_found() -> None:
    start, edges = met((0.05, 0.6))
    found = solved(start, edges, "unit")
    expected = last_pose_covariances(found.poses, edges, robots=(0, 1), third_party="ignore")
    assert found.covariances is not None
    np.testing.assert_allclose(found.covariances, expected)


@pytest.mark.parametrize(
    "other",
    [{"estimator": "every_step"}, {"outliers": "huber"}, {"outliers": "bearing"}, {"outliers": "pcm"}],
)
def test_what_weighs_by_sigma_itself_is_refused(other: dict[str, str]) -> None:
    with pytest.raises(
        BadInputError, match=r"GraphConfig\.solve_weights must be 'information' with .*, got 'unit'"
    ):
        GraphConfig(solve_weights="unit", **other)  # type: ignore[arg-type]
    GraphConfig(solve_weights="unit", outliers="paper")
