"""What each robot solves for at every iteration, against one search over the same measurements."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from wifipgo import se2
from wifipgo.graph import Edges, extended, last_pose_covariances, solve
from wifipgo.graph.anchor_bearings import NO_PINGS, Pings
from wifipgo.graph.bearings import Bearings
from wifipgo.graph.config import GraphConfig
from wifipgo.graph.edges import select
from wifipgo.graph.per_robot_smoothing import PerRobotSmoothers
from wifipgo.graph.smoother_updates import no_smoothing

SIGMA = (0.1, 0.05)
N_TIMES = 12
ATOL = 0.02  # m, rad: a pose is linearised anew once it moved by 0.05


def walked(seed: int, n_robots: int = 3) -> tuple[np.ndarray, np.ndarray, list[Edges]]:
    """Truth, dead reckoning, and what was measured at each iteration: odometry, own places, each other."""
    rng = np.random.default_rng(seed)
    truth = np.cumsum(rng.uniform(-1.0, 1.0, (n_robots, N_TIMES, 3)), axis=1)
    start, measured = truth.copy(), [Edges.empty()]
    for t in range(1, N_TIMES):
        ends = [((r, t - 1), (r, t)) for r in range(n_robots)]
        if t >= 4:
            ends += [
                ((r, t), (r, int(rng.integers(0, t - 2)))) for r in range(n_robots) if rng.random() < 0.6
            ]
        if t % 3 == 0:
            ends += [((0, t), (1, t)), ((1, t), (0, t)), ((2, t), (0, t))]
        tail, head = np.array(ends).transpose(1, 0, 2)
        T_world_head = truth[head[:, 0], head[:, 1]]
        z = se2.between(truth[tail[:, 0], tail[:, 1]], T_world_head)
        z = z + rng.normal(size=z.shape) * [SIGMA[0], SIGMA[0], SIGMA[1]]
        start[:, t] = se2.compose(start[:, t - 1], z[:n_robots])
        measured.append(Edges.measured(tail=tail, head=head, z=z, sigma=SIGMA, reported_pose=T_world_head))
    return truth, start, measured


def run(
    measured: list[Edges],
    start: np.ndarray,
    memory: PerRobotSmoothers,
    *,
    sent_at: int | None = None,
    begin: int = 0,
) -> tuple[np.ndarray, np.ndarray, Edges, np.ndarray]:
    """Feed a memory iteration by iteration; robots 0 and 1 exchange graphs once."""
    n = len(start)
    sent, cov, edges, estimate = np.zeros((n, n), int), np.zeros((n, 3, 3)), Edges.empty(), start[:, :1]
    smoothing = no_smoothing(n)
    for t, new in enumerate(measured):
        edges = extended(edges, new)
        if t:
            step = se2.between(start[:, t - 1], start[:, t])
            estimate = np.concatenate([estimate, se2.compose(estimate[:, -1], step)[:, None]], axis=1)
        if t == sent_at:
            sent = sent.copy()
            sent[:2, :2] = t + 1
        if t >= begin:
            (estimate, cov), smoothing = memory.smoothed(
                smoothing, estimate, cov, edges=edges, bearings=Bearings.empty(), sent=sent
            )
    return estimate, cov, edges, sent


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("third_party", ["fixed_told", "ignore"])
def test_a_robot_alone_has_the_optimum_of_what_it_measured(seed: int, third_party: str) -> None:
    _, start, measured = walked(seed)
    memory = PerRobotSmoothers(GraphConfig(estimator="every_step", third_party=third_party))
    estimate, _, edges, _ = run(measured, start, memory)
    for robot in range(len(start)):
        best, _ = solve(start, edges, robots=[robot], third_party=third_party)
        np.testing.assert_allclose(estimate[robot], best[robot], atol=ATOL)
    moved = np.abs(estimate - start).max()
    assert moved > 0.05  # else this compares dead reckoning with itself


def test_next_to_no_weight_is_none() -> None:
    """A weight that underflowed, as Eq. 11's do, leaves no information, and no variance that overflows."""
    _, start, measured = walked(0)
    found = []
    for least in (0.0, 5e-324):
        weights = [np.where(new.tail[:, 0] != new.head[:, 0], least, new.weight) for new in measured]
        less = [replace(new, weight=weight) for new, weight in zip(measured, weights, strict=True)]
        found.append(run(less, start, PerRobotSmoothers(GraphConfig(estimator="every_step")), sent_at=6)[0])
    np.testing.assert_array_equal(found[0], found[1])


@pytest.mark.parametrize("seed", range(4))
def test_a_robot_that_was_sent_a_graph_has_the_optimum_of_both_as_far_as_it_knows(seed: int) -> None:
    """What the other measured since is not known: the search leaves it out."""
    _, start, measured = walked(seed)
    memory = PerRobotSmoothers(GraphConfig(estimator="every_step", third_party="ignore"))
    met = 9
    estimate, _, edges, _ = run(measured, start, memory, sent_at=met)
    for robot, other in ((0, 1), (1, 0)):
        late = (edges.measured_at > met) & (edges.tail[:, 0] == other)
        late |= (edges.head[:, 0] == other) & (edges.head[:, 1] > met) & edges.between_robots
        chain = ~edges.between_robots & (edges.head[:, 1] == edges.tail[:, 1] + 1)  # says nothing of a robot
        known = select(edges, ~late | chain)
        best, _ = solve(start, known, robots=[0, 1], third_party="ignore")
        np.testing.assert_allclose(estimate[robot], best[robot], atol=ATOL)


@pytest.mark.parametrize("seed", range(3))
def test_covariances_are_those_of_the_search(seed: int) -> None:
    """Also of a robot that only dead-reckoned since it last solved, to first order."""
    _, start, measured = walked(seed)
    memory = PerRobotSmoothers(GraphConfig(estimator="every_step", third_party="ignore"))
    estimate, cov, edges, _ = run(measured, start, memory)
    for robot in range(len(start)):
        alone = select(edges, (edges.tail[:, 0] == robot) & ~edges.between_robots)
        expected = last_pose_covariances(estimate, alone, robots=[robot])[0]
        if (alone.measured_at == N_TIMES - 1).sum() > 1:  # solved at the last iteration
            scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
            np.testing.assert_allclose(cov[robot] / scale, expected / scale, atol=0.1)
        else:
            assert np.trace(cov[robot]) > 0.0


def test_a_memory_that_missed_iterations_begins_anew() -> None:
    _, start, measured = walked(5)
    cfg = GraphConfig(estimator="every_step")
    warm, _, _, _ = run(measured, start, PerRobotSmoothers(cfg), sent_at=6)
    cold, _, _, _ = run(measured, start, PerRobotSmoothers(cfg), sent_at=6, begin=N_TIMES - 1)
    np.testing.assert_allclose(warm, cold, atol=1e-2)


def test_what_others_measured_and_did_not_send_changes_nothing() -> None:
    _, start, measured = walked(6)
    cfg = GraphConfig(estimator="every_step")
    plain, _, _, _ = run(measured, start, PerRobotSmoothers(cfg))
    shifted = [
        replace(new, z=new.z + np.where(new.tail[:, :1] == 1, [0.5, 0.0, 0.0], 0.0)) if t else new
        for t, new in enumerate(measured)
    ]
    other, _, _, _ = run(shifted, start, PerRobotSmoothers(cfg))
    np.testing.assert_array_equal(other[[0, 2]], plain[[0, 2]])
    assert np.abs(other[1] - plain[1]).max() > 0.1


def heard_a_place(off_rad: float, told_sigma_m: float) -> np.ndarray:
    """Last pose of a robot that drove 10 m and heard another, far ahead and somewhat off its axis."""
    poses = np.zeros((1, 2, 3))
    poses[0, 1, 0] = 10.0
    edges = Edges.measured(
        tail=np.array([[0, 0]]), head=np.array([[0, 1]]), z=poses[:, 1], sigma=np.array([[0.1, 0.2]])
    )
    ping = Pings(
        observer=np.array([[0, 1]]),
        sender=np.array([1]),
        azimuth_rad=np.array([off_rad]),
        sigma_rad=np.array([0.05]),
        point_m=np.array([[30.0, 0.0]]),
        covariance_m2=told_sigma_m**2 * np.eye(2)[None],
    )
    memory = PerRobotSmoothers(GraphConfig(estimator="every_step", aoa_factors=True))
    sent, cov = np.zeros((1, 1), dtype=int), np.zeros((1, 3, 3))
    none = Bearings.empty()
    nothing: dict[str, Any] = {"edges": Edges.empty(), "bearings": none, "sent": sent, "pings": NO_PINGS}
    _, smoothing = memory.smoothed(no_smoothing(1), poses[:, :1], cov, **nothing)
    (solved, _), _ = memory.smoothed(smoothing, poses, cov, edges=edges, bearings=none, sent=sent, pings=ping)
    pose: np.ndarray = solved[0, 1]
    return pose


@pytest.mark.parametrize("told_sigma_m", [0.01, 1.0])
def test_a_bearing_to_a_told_place_turns_a_robot_by_its_share(told_sigma_m: float) -> None:
    """Yaw, own place and told place share the bearing's surprise in proportion to their variances."""
    off = 0.02
    across = np.array([0.2, 0.1 / 20.0, told_sigma_m / 20.0, 0.05])  # rad at 20 m, the last is the bearing's
    share = across**2 / (across**2).sum()
    pose = heard_a_place(off, told_sigma_m)
    np.testing.assert_allclose(pose[2], -off * share[0], rtol=0.05)
    np.testing.assert_allclose(pose[1], -off * share[1] * 20.0, rtol=0.1)


def test_a_bearing_that_is_far_off_hardly_counts() -> None:
    """An echo from behind: Geman-McClure lets go of it."""
    assert abs(heard_a_place(2.0, 0.1)[2]) < 0.02
