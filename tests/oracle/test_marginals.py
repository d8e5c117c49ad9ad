"""Covariances of last poses against a hand-solved chain and the dense inverse of the information."""

import numpy as np
import pytest

from wifipgo import se2
from wifipgo.errors import UnknownNameError
from wifipgo.graph import Edges, extended, last_pose_covariances, solve
from wifipgo.graph.bearings import Bearings
from wifipgo.graph.edges import select

SIGMA = (0.1, 0.05)


def chain(robot: int, z: np.ndarray, sigma: tuple[float, float] = SIGMA) -> Edges:
    """Odometry of one robot."""
    ends = np.stack([np.full(len(z) + 1, robot), np.arange(len(z) + 1)], axis=-1)
    return Edges.measured(tail=ends[:-1], head=ends[1:], z=z, sigma=sigma)


def reckoned(start: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Poses of a chain of steps."""
    rows = [start]
    for step in z:
        rows.append(se2.compose(rows[-1][None], step[None])[0])
    return np.array(rows)


@pytest.mark.parametrize("yaw_rad", [0.0, 0.7, -2.5])
def test_an_open_straight_chain_by_hand(yaw_rad: float) -> None:
    """Along the way each step adds its variance; across it, an early turn is a long lever.

    n steps of length L: across n sigma_t^2 + sigma_r^2 L^2 sum_k (n - k)^2, with the heading n sigma_r^2.
    """
    n, length_m = 6, 1.5
    z = np.tile([length_m, 0.0, 0.0], (n, 1))
    poses = reckoned(np.array([1.0, -2.0, yaw_rad]), z)[None]
    lever_m = length_m * np.arange(n)  # of the turn of step k on the end, k from the last
    var_t, var_r = SIGMA[0] ** 2, SIGMA[1] ** 2
    along = np.diag([n * var_t, n * var_t + var_r * (lever_m**2).sum(), n * var_r])
    along[1, 2] = along[2, 1] = var_r * lever_m.sum()
    turn = np.eye(3)
    turn[:2, :2] = [[np.cos(yaw_rad), -np.sin(yaw_rad)], [np.sin(yaw_rad), np.cos(yaw_rad)]]
    (found,) = last_pose_covariances(poses, chain(0, z), robots=[0])
    np.testing.assert_allclose(found, turn @ along @ turn.T, rtol=1e-5, atol=1e-9)


def test_two_robots_that_meet_share_their_knowledge() -> None:
    """On a line a meeting of variance m puts a's and b's variances in parallel: a (b + m) / (a + b + m)."""
    steps = np.array([[2.0, 0.0, 0.0]])
    a, b, m = 0.1**2, 0.3**2, 0.2**2
    rigid = 1e-4  # headings all but known, so that the line is one-dimensional
    edges = extended(chain(0, steps, (0.1, rigid)), chain(1, steps, (0.3, rigid)))
    poses = np.array([[[0.0, 0.0, 0.0], [2.0, 0.0, 0.0]], [[1.0, 0.0, 0.0], [3.0, 0.0, 0.0]]])
    seen = Edges.measured(
        tail=np.array([[0, 1]]),
        head=np.array([[1, 1]]),
        z=np.array([[1.0, 0.0, 0.0]]),
        sigma=(0.2, rigid),
        reported_pose=poses[1:, 1],
    )
    second, first = last_pose_covariances(poses, extended(edges, seen), robots=[1, 0])
    np.testing.assert_allclose(first[0, 0], a * (b + m) / (a + b + m), rtol=1e-3)
    np.testing.assert_allclose(second[0, 0], b * (a + m) / (a + b + m), rtol=1e-3)


def loops(seed: int) -> tuple[np.ndarray, Edges]:
    """Three robots with random poses, loops, meetings and weights.

    Without noise: only then do all forms of the residual have one linearisation.
    """
    rng = np.random.default_rng(seed)
    truth = rng.uniform(-2.0, 2.0, (3, 6, 3))
    own = [((r, t), (r, t + 1)) for r in range(3) for t in range(5)] + [((0, 0), (0, 4)), ((1, 1), (1, 5))]
    met = [((0, 2), (1, 3)), ((1, 5), (0, 5)), ((0, 3), (2, 3)), ((1, 4), (2, 2))]
    tail, head = np.array(own + met).transpose(1, 0, 2)
    seen = truth[head[:, 0], head[:, 1]]
    z = se2.between(truth[tail[:, 0], tail[:, 1]], seen)
    weight = rng.uniform(0.3, 1.0, len(tail))
    return truth, Edges.measured(tail=tail, head=head, z=z, sigma=SIGMA, weight=weight, reported_pose=seen)


def whitened(
    flat: np.ndarray, shape: tuple[int, ...], edges: Edges, told_sigma: tuple[float, float]
) -> np.ndarray:
    """Residuals over sigma in coordinates of the world, robots 0 and 1 free; for finite differences.

    To an outsider, z and the told pose are both uncertain at the head; written at the head, the
    noise of both is in the same axes, so their variances add.
    """
    poses = flat.reshape(shape)
    rows = []
    for tail, head, z, sigma, weight, told in zip(
        edges.tail, edges.head, edges.z, edges.sigma, edges.weight, edges.reported_pose, strict=True
    ):
        if tail[0] == 2:
            continue
        outside = head[0] == 2
        T_world_head = told if outside else poses[head[0], head[1]]
        error = se2.between(z[None], se2.between(poses[tail[0], tail[1]][None], T_world_head[None]))[0]
        variance = sigma**2 / weight + (np.square(told_sigma) if outside else 0.0)
        rows.append(error / np.sqrt(variance)[[0, 0, 1]])
    return np.concatenate(rows)


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("third_party", ["fixed_told", "ignore"])
def test_against_the_dense_inverse_of_the_information(seed: int, third_party: str) -> None:
    """J^T J by finite differences in world coordinates, first poses fixed, inverted as a whole."""
    truth, edges = loops(seed)
    told_sigma = (0.3, 0.1)
    used = edges if third_party == "fixed_told" else select(edges, edges.head[:, 0] < 2)
    solved, report = solve(
        truth, edges, robots=[0, 1], third_party=third_party, told_sigma=told_sigma, covariances=True
    )
    flat, shape = solved[:2].ravel(), (2, 6, 3)
    columns = [
        whitened(flat + h, shape, used, told_sigma) - whitened(flat - h, shape, used, told_sigma)
        for h in 1e-6 * np.eye(len(flat))
    ]
    jacobian = np.stack(columns, axis=1) / 2e-6
    free = np.ones(shape, dtype=bool)
    free[:, 0] = False
    jacobian = jacobian[:, free.ravel()]
    covariance = np.linalg.inv(jacobian.T @ jacobian)
    ends = [covariance[k - 3 : k, k - 3 : k] for k in (15, 30)]
    found = last_pose_covariances(
        solved, edges, robots=[0, 1], third_party=third_party, told_sigma=told_sigma
    )
    np.testing.assert_allclose(found, ends, rtol=1e-4, atol=1e-7)
    assert report.last_pose_covariances is not None
    np.testing.assert_allclose(report.last_pose_covariances, found, rtol=1e-9)


def test_what_helps_shows_and_what_is_refused() -> None:
    """A bearing can only add knowledge; nobody asked, nothing told; a typo lists what exists."""
    truth, edges = loops(3)
    assert solve(truth, edges, robots=[0, 1])[1].last_pose_covariances is None
    heard = Bearings(
        observer=np.array([[0, 5]]),
        target=np.array([[1, 5]]),
        azimuth_rad=np.array([[0.0]]),
        sigma_rad=np.array([0.05]),
    )
    relative = se2.between(truth[:1, 5], truth[1:2, 5])[0]
    heard.azimuth_rad[0, 0] = np.arctan2(relative[1], relative[0])
    _, deaf = solve(truth, edges, robots=[0, 1], covariances=True)
    _, hearing = solve(truth, edges, robots=[0, 1], bearings=heard, covariances=True)
    assert deaf.last_pose_covariances is not None
    assert hearing.last_pose_covariances is not None
    gain = deaf.last_pose_covariances - hearing.last_pose_covariances
    assert (np.trace(gain[:, :2, :2], axis1=1, axis2=2) > 0.0).all()
    with pytest.raises(UnknownNameError, match="fixed_told"):
        last_pose_covariances(truth, edges, robots=[0], third_party="fixed")
    with pytest.raises(ValueError, match="without any measurement"):
        last_pose_covariances(truth, select(edges, np.array([0])), robots=[0])
