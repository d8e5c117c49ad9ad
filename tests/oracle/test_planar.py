"""Solutions against graphs that can be solved by hand (paper Eq. 3)."""

import numpy as np
import pytest

from wifipgo import se2
from wifipgo.errors import UnknownNameError
from wifipgo.graph.edges import Edges, extended, select
from wifipgo.graph.metrics import ate_rot, ate_trans, residual_error
from wifipgo.graph.solvers import solve, solve_team

SIGMA = (0.1, 0.05)


def straight(steps_m: list[float], robot: int = 0, sigma: tuple[float, float] = SIGMA) -> Edges:
    """Odometry of a robot that drives along x."""
    n = len(steps_m)
    ends = np.stack([np.full(n + 1, robot), np.arange(n + 1)], axis=-1)
    z = np.stack([np.array(steps_m), np.zeros(n), np.zeros(n)], axis=-1)
    return Edges.measured(tail=ends[:-1], head=ends[1:], z=z, sigma=sigma)


def one(
    tail: tuple[int, int],
    head: tuple[int, int],
    x_m: float,
    sigma: tuple[float, float],
    *,
    weight: float = 1.0,
    told_x_m: float = 0.0,
) -> Edges:
    """One measurement of something straight ahead."""
    return Edges.measured(
        tail=np.array([tail]),
        head=np.array([head]),
        z=np.array([[x_m, 0.0, 0.0]]),
        sigma=sigma,
        weight=weight,
        reported_pose=np.array([[told_x_m, 0.0, 0.0]]),
    )


def simulated(noise: float, seed: int = 0) -> tuple[np.ndarray, np.ndarray, Edges]:
    """Truth, dead reckoning and edges of three robots that meet and come back to places."""
    rng = np.random.default_rng(seed)
    truth = rng.uniform(-3.0, 3.0, (3, 8, 3))
    own = [((r, t), (r, t + 1)) for r in range(3) for t in range(7)] + [((r, 0), (r, 6)) for r in range(3)]
    met = [((0, t), (1, t)) for t in (2, 4, 7)] + [((1, 7), (0, 7)), ((1, 3), (2, 3)), ((2, 6), (0, 6))]
    tail, head = np.array(own + met).transpose(1, 0, 2)
    T_world_head = truth[head[:, 0], head[:, 1]]
    z = se2.between(truth[tail[:, 0], tail[:, 1]], T_world_head)
    z = z + noise * rng.normal(size=z.shape) * [SIGMA[0], SIGMA[0], SIGMA[1]]
    start = truth.copy()
    for t in range(7):
        start[:, t + 1] = se2.compose(start[:, t], z[:21].reshape(3, 7, 3)[:, t])
    return truth, start, Edges.measured(tail=tail, head=head, z=z, sigma=SIGMA, reported_pose=T_world_head)


def test_a_closed_loop_is_the_weighted_mean() -> None:
    """On a line the gap of a loop is shared out in proportion to the variances."""
    steps, sigmas, seen_m, sigma_seen = [1.0, 2.0, 1.5], [0.1, 0.2, 0.3], 5.0, 0.15
    edges = one((0, 0), (0, 3), seen_m, (sigma_seen, 0.05))
    for t, (step, sigma) in enumerate(zip(steps, sigmas, strict=True)):
        edges = extended(edges, one((0, t), (0, t + 1), step, (sigma, 0.05)))
    poses = np.zeros((1, 4, 3))
    poses[0, 1:, 0] = np.cumsum(steps)
    solved, report = solve(poses, edges, robots=[0])
    variance = np.square(sigmas)
    share = (seen_m - sum(steps)) * variance / (variance.sum() + sigma_seen**2)
    np.testing.assert_allclose(solved[0, 1:, 0], np.cumsum(steps + share), atol=1e-6)
    np.testing.assert_allclose(solved[0, :, 1:], 0.0, atol=1e-9)
    chi2 = (seen_m - sum(steps)) ** 2 / (variance.sum() + sigma_seen**2)
    np.testing.assert_allclose(report.chi2_after, chi2, rtol=1e-6)
    assert (report.n_used, report.n_dropped) == (4, 0)


@pytest.mark.parametrize("weight", [1.0, 0.25])
def test_two_robots_share_the_gap_of_their_meeting(weight: float) -> None:
    """Robot 1 starts at 10 m and drives towards robot 0; a weight divides the variance."""
    poses = np.zeros((2, 2, 3))
    poses[:, :, 0] = [[0.0, 4.0], [10.0, 6.0]]
    edges = extended(straight([4.0], 0, (0.1, 0.05)), straight([-4.0], 1, (0.3, 0.05)))
    edges = extended(edges, one((0, 1), (1, 1), 3.0, (0.2, 0.05), weight=weight))
    solved, _ = solve(poses, edges, robots=[1, 0])
    variance = np.array([0.1**2, 0.3**2, 0.2**2 / weight])
    np.testing.assert_allclose(solved[0, 1, 0], 4.0 - variance[0] / variance.sum(), atol=1e-6)
    np.testing.assert_allclose(solved[1, 1, 0], 6.0 + variance[1] / variance.sum(), atol=1e-6)


@pytest.mark.parametrize("weight", [1.0, 0.25])
def test_a_told_pose_pulls_by_its_own_variance(weight: float) -> None:
    """Variances of the measurement, by its weight, and of the told pose add up."""
    poses = np.zeros((2, 2, 3))
    poses[0, 1, 0] = 4.0
    seen = one((0, 1), (1, 1), 3.0, (0.2, 0.05), weight=weight, told_x_m=8.0)
    edges = extended(straight([4.0]), seen)
    solved, report = solve(poses, edges, robots=[0], told_sigma=(0.3, 0.1))
    expected = 4.0 + (8.0 - 3.0 - 4.0) * 0.1**2 / (0.1**2 + 0.2**2 / weight + 0.3**2)
    np.testing.assert_allclose(solved[0, 1, 0], expected, atol=1e-6)
    assert report.n_used == 2
    alone, report = solve(poses, edges, robots=[0], third_party="ignore")
    np.testing.assert_allclose(alone, poses, atol=1e-9)
    assert (report.n_used, report.n_dropped) == (1, 1)


def test_a_certain_told_pose_acts_like_the_pose_itself() -> None:
    """Folding the told pose into its tail agrees with a solve in which the outsider cannot move."""
    truth, start, edges = simulated(noise=0.3)
    met = np.isin(edges.tail[:, 0], [0, 1]) & np.isin(edges.head[:, 0], [0, 1])
    mine = select(edges, met & (edges.tail[:, 0] == 0))
    told, _ = solve(start, mine, robots=[0], told_sigma=(1e-9, 1e-9))
    ends = np.stack([np.ones(7, dtype=np.int64), np.arange(8)[1:]], axis=-1)
    z = se2.between(np.repeat(truth[1, :1], 7, axis=0), truth[1, 1:])
    rigid = Edges.measured(tail=ends * [1, 0], head=ends, z=z, sigma=(1e-4, 1e-4))
    held = start.copy()
    held[1] = truth[1]
    joint, _ = solve(held, extended(mine, rigid), robots=[0, 1])
    np.testing.assert_allclose(told[0], joint[0], atol=2e-3)


def test_without_noise_the_truth_is_found() -> None:
    truth, start, edges = simulated(noise=0.0)
    solved, report = solve_team(start, edges)
    assert report.chi2_after < 1e-9
    assert ate_trans(solved, truth).max() < 1e-12
    assert ate_rot(solved, truth).max() < 1e-12
    assert residual_error(truth, edges).max() < 1e-20


def test_a_weight_of_zero_is_no_edge() -> None:
    _, start, edges = simulated(noise=1.0)
    keep = np.arange(len(edges)) % 5 != 4
    keep[:21] = True  # odometry
    zeroed = Edges.measured(
        tail=edges.tail,
        head=edges.head,
        z=edges.z,
        sigma=edges.sigma,
        weight=keep.astype(float),
        reported_pose=edges.reported_pose,
    )
    with_zeros, report = solve_team(start, zeroed)
    without, _ = solve_team(start, select(edges, keep))
    np.testing.assert_array_equal(with_zeros, without)
    assert report.n_dropped == (~keep).sum() > 0


def test_only_participants_move_and_starts_stay() -> None:
    _, start, edges = simulated(noise=1.0)
    solved, report = solve(start, edges, robots=[0, 1])
    np.testing.assert_array_equal(solved[2], start[2])
    np.testing.assert_array_equal(solved[:, 0], start[:, 0])
    assert report.chi2_after < report.chi2_before
    assert report.n_dropped == (edges.tail[:, 0] == 2).sum()


def test_the_solution_is_a_minimum() -> None:
    """Finite differences of the chi-square vanish at the solution."""
    _, start, edges = simulated(noise=1.0)
    solved, _ = solve_team(start, edges)

    def chi2(poses: np.ndarray) -> float:
        rows = [poses[e[:, 0], e[:, 1]] for e in (edges.tail, edges.head)]
        off = se2.between(*rows) - edges.z
        off[:, 2] = se2.wrap_angle(off[:, 2])
        return float(((off / edges.sigma[:, [0, 0, 1]]) ** 2).sum())

    for k in np.ndindex(3, 7, 3):
        step = np.zeros_like(solved)
        step[k[0], k[1] + 1, k[2]] = 1e-4
        slope = (chi2(solved + step) - chi2(solved - step)) / 2e-4
        bend = (chi2(solved + step) + chi2(solved - step) - 2.0 * chi2(solved)) / 1e-8
        assert abs(slope / bend) < 2e-5  # distance to the minimum along this axis, m or rad


def test_bad_requests_say_what_is_wrong() -> None:
    _, start, edges = simulated(noise=0.0)
    with pytest.raises(ValueError, match="robots must be one or more, each once"):
        solve(start, edges, robots=[1, 1])
    with pytest.raises(UnknownNameError, match="fixed_told, ignore"):
        solve(start, edges, robots=[0], third_party="fixed")
    with pytest.raises(ValueError, match="poses without any measurement must be none, got 6"):
        solve(start, select(edges, np.array([0])), robots=[0])


def test_what_is_not_finite_is_refused_and_named() -> None:
    """A measurement where it is made, a pose where a solve would start from it."""
    with pytest.raises(ValueError, match=r"Edges\.z must be finite, got .*nan"):
        one((0, 0), (0, 1), float("nan"), SIGMA)
    poses = np.zeros((1, 2, 3))
    poses[0, 1, 2] = np.inf
    with pytest.raises(ValueError, match=r"poses of those who take part must be finite, got .*inf"):
        solve(poses, straight([1.0]), robots=[0])


def test_empty_graphs_and_robots_without_an_edge() -> None:
    """A first pose is known, so alone it is solved; any other needs a measurement."""
    poses = np.zeros((2, 1, 3))
    solved, report = solve(poses, Edges.empty(), robots=[0, 1])
    np.testing.assert_array_equal(solved, poses)
    assert (report.chi2_after, report.n_used) == (0.0, 0)
    with pytest.raises(ValueError, match="poses without any measurement must be none, got 3"):
        solve(np.zeros((2, 4, 3)), straight([0.0, 0.0, 0.0]), robots=[0, 1])
