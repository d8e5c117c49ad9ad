"""Poses from directions and distances: exact ones place robots to each other, gross ones are let go."""

import numpy as np
import pytest

from wifipgo import se2
from wifipgo.errors import BadInputError
from wifipgo.graph.bearings import Bearings
from wifipgo.graph.edges import Edges
from wifipgo.graph.ranges import Ranges, range_residuals, select_ranges
from wifipgo.graph.solvers.sightings import solve_sightings

TRUTH = np.array(
    [
        [[0.0, 0.0, 0.1], [1.0, 0.2, 0.6], [1.8, 1.1, 1.2], [2.0, 2.0, 0.4]],
        [[4.0, 0.0, 2.0], [3.5, 1.0, 2.6], [2.5, 1.8, -2.9], [1.5, 3.0, 1.9]],
        [[0.0, 4.0, -0.7], [1.0, 3.3, -0.5], [2.2, 3.5, 0.8], [3.0, 4.4, 0.2]],
    ]
)
ROBOTS = range(3)


def odometry(error: np.ndarray) -> Edges:
    """Steps of all robots with an error."""
    robot, index = np.indices((3, 3)).reshape(2, -1)
    tail, head = np.stack([robot, index], axis=1), np.stack([robot, index + 1], axis=1)
    z = se2.between(TRUTH[tuple(tail.T)], TRUTH[tuple(head.T)]) + error
    return Edges.measured(tail=tail, head=head, z=z, sigma=(0.3, 0.3))


def ends() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Everybody sees everybody at every time: both ends, and where the target is in the observer's frame."""
    pairs = [(a, b, t) for t in range(1, 4) for a in ROBOTS for b in ROBOTS if a != b]
    a, b, t = np.array(pairs).T
    observer, target = np.stack([a, t], axis=1), np.stack([b, t], axis=1)
    return observer, target, se2.between(TRUTH[a, t], TRUTH[b, t])


def bearings(error_rad: float = 0.0) -> Bearings:
    """Exact directions, but for one."""
    observer, target, z = ends()
    azimuth = np.arctan2(z[:, 1], z[:, 0])[:, None]
    azimuth[5] += error_rad
    return Bearings.measured(observer=observer, target=target, azimuth_rad=azimuth, sigma_rad=1e-3)


def ranges() -> Ranges:
    """Exact distances."""
    observer, target, z = ends()
    return Ranges.measured(observer=observer, target=target, range_m=np.hypot(z[:, 0], z[:, 1]), sigma_m=1e-3)


def start(edges: Edges) -> np.ndarray:
    """Odometry from the true first poses."""
    poses = TRUTH.copy()
    for t in range(3):
        poses[:, t + 1] = se2.compose(poses[:, t], edges.z.reshape(3, 3, 3)[:, t])
    return poses


def test_exact_directions_and_distances_place_robots_to_each_other() -> None:
    """Where all of them are, they only share what odometry says."""
    edges = odometry(np.random.default_rng(0).normal(0.0, 0.1, (9, 3)))
    begin = start(edges)
    assert np.abs(begin - TRUTH).max() > 0.1
    solved, report = solve_sightings(begin, edges, bearings=bearings(), ranges=ranges(), robots=ROBOTS)
    observer, target, z = ends()
    found = se2.between(solved[tuple(observer.T)], solved[tuple(target.T)])
    np.testing.assert_allclose(found, z, atol=1e-3)
    assert report.converged
    assert (report.n_used, report.n_dropped) == (9 + 18 + 18, 0)


def test_directions_of_a_gross_error_are_let_go() -> None:
    """By squares the error pulls the poses away, by Huber's loss less, and by Geman-McClure's not at all."""
    edges = odometry(np.zeros((9, 3)))
    off = {}
    for loss in ("none", "huber", "geman_mcclure"):
        solved, _ = solve_sightings(start(edges), edges, bearings=bearings(0.5), robots=ROBOTS, loss=loss)
        off[loss] = float(np.abs(solved - TRUTH).max())
    assert off["none"] > 5.0 * off["huber"]
    assert off["geman_mcclure"] < 1e-5


def test_a_robot_that_does_not_take_part_is_left_alone() -> None:
    edges = odometry(np.full((9, 3), 0.05))
    solved, report = solve_sightings(start(edges), edges, bearings=bearings(), robots=(0, 2))
    np.testing.assert_array_equal(solved[1], start(edges)[1])
    assert (report.n_used, report.n_dropped) == (6 + 6, 3 + 12)


def test_the_order_of_sightings_changes_no_bit() -> None:
    edges, heard, far = odometry(np.full((9, 3), 0.02)), bearings(0.3), ranges()
    shuffled = np.random.default_rng(1).permutation(len(far))
    turned = Bearings.measured(
        observer=heard.observer[shuffled],
        target=heard.target[shuffled],
        azimuth_rad=heard.azimuth_rad[shuffled],
        sigma_rad=heard.sigma_rad[shuffled],
    )
    one, _ = solve_sightings(start(edges), edges, bearings=heard, ranges=far, robots=ROBOTS)
    other, _ = solve_sightings(
        start(edges), edges, bearings=turned, ranges=select_ranges(far, shuffled), robots=ROBOTS
    )
    np.testing.assert_array_equal(one, other)
    np.testing.assert_allclose(range_residuals(TRUTH, far), 0.0, atol=1e-12)


def test_what_cannot_be_is_refused() -> None:
    observer, target, _ = ends()
    distance = np.ones(len(observer))
    for change, message in (
        ({"range_m": -distance}, "Ranges.range_m must be > 0 and finite"),
        ({"sigma_m": 0.0}, "Ranges.sigma_m must be > 0 and finite"),
        ({"target": observer}, "Ranges.target must be another robot"),
    ):
        given = {"observer": observer, "target": target, "range_m": distance, "sigma_m": 0.1} | change
        with pytest.raises(BadInputError, match=message):
            Ranges.measured(**given)  # type: ignore[arg-type]
    with pytest.raises(BadInputError, match="unknown loss of sightings 'hubert'"):
        solve_sightings(TRUTH, odometry(np.zeros((9, 3))), robots=ROBOTS, loss="hubert")
