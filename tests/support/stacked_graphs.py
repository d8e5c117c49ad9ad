"""Pose graphs of several worlds, alone and on one axis of rows, for tests."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from wifipgo import se2
from wifipgo.graph.bearings import Bearings, extended_bearings
from wifipgo.graph.edges import Edges, extended, select


class TeamGraph(NamedTuple):
    """What a team believes and measured."""

    poses: np.ndarray
    edges: Edges
    bearings: Bearings


def team_graph(seed: int, *, n_robots: int = 3, n_times: int = 9, n_met: int = 9) -> TeamGraph:
    """Robots that walk, see places again and each other, and hear whom they see."""
    rng = np.random.default_rng(seed)
    truth = np.cumsum(rng.uniform(-1.0, 1.0, (n_robots, n_times, 3)), axis=1)
    robot, t = np.indices((n_robots, n_times - 1)).reshape(2, -1)
    steps = np.stack([robot, t], axis=1), np.stack([robot, t + 1], axis=1)
    robot, t = rng.integers(0, n_robots, 5), rng.integers(3, n_times, 5)
    again = np.stack([robot, t], axis=1), np.stack([robot, rng.integers(0, t - 1)], axis=1)
    robot, other = rng.integers(0, n_robots, n_met), rng.integers(1, n_robots, n_met)
    t = rng.integers(1, n_times, n_met)
    met = np.stack([robot, t], axis=1), np.stack([(robot + other) % n_robots, t], axis=1)
    tail, head = (np.concatenate(ends) for ends in zip(steps, again, met, strict=True))
    seen = truth[tuple(head.T)]
    z = se2.between(truth[tuple(tail.T)], seen) + rng.normal(size=seen.shape) * [0.1, 0.1, 0.05]
    start, odometry = truth.copy(), z[: n_robots * (n_times - 1)].reshape(n_robots, -1, 3)
    for k in range(n_times - 1):
        start[:, k + 1] = se2.compose(start[:, k], odometry[:, k])
    edges = Edges.measured(
        tail=tail,
        head=head,
        z=z,
        sigma=(0.1, 0.05),
        weight=rng.uniform(0.3, 1.0, len(z)),
        reported_pose=seen + rng.normal(size=seen.shape) * [0.5, 0.5, 0.1],
    )
    azimuth_rad = np.arctan2(z[-n_met:, 1], z[-n_met:, 0]) + rng.normal(size=n_met) * 0.05
    bearings = Bearings.measured(
        observer=met[0], target=met[1], azimuth_rad=azimuth_rad[:, None], sigma_rad=0.05
    )
    return TeamGraph(start, edges, bearings)


def stacked(teams: list[TeamGraph]) -> TeamGraph:
    """All on one axis of rows, with measurements in the order of time, as a log of a batch has them."""
    edges, bearings = Edges.empty(), Bearings.empty()
    for k, (_, own, heard) in enumerate(teams):
        shift = np.array([k * len(teams[0].poses), 0])
        edges = extended(edges, replace(own, tail=own.tail + shift, head=own.head + shift))
        there = replace(heard, observer=heard.observer + shift, target=heard.target + shift)
        bearings = extended_bearings(bearings, there)
    in_time = np.argsort(edges.measured_at, kind="stable")
    return TeamGraph(np.concatenate([team.poses for team in teams]), select(edges, in_time), bearings)
