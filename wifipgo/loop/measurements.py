"""What robots measure in an iteration, and what they tell each other about it at once."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from wifipgo.graph.anchor_bearings import extended_pings
from wifipgo.graph.bearings import extended_bearings
from wifipgo.graph.edges import Edges, extended
from wifipgo.loop.aoa_measurements import Heard, bearings_of, pings_of, weights_of
from wifipgo.loop.exchange import BYTES_PER_PING
from wifipgo.loop.transfer import BYTES_PER_POSE
from wifipgo.rows import Chance, Rows
from wifipgo.scenarios.scenario import Scenario
from wifipgo.state import Belief, MeasurementLog, Paths, Scene, Sensed, Truth
from wifipgo.streams import Streams
from wifipgo.world.lidar import noisy, scan
from wifipgo.world.sensing import RelativePoses, measure_loop_closures, observe_robots, sight_robots


def sense(truth: Truth, scene: Scene, scenario: Scenario, *, rng: Chance) -> Sensed:
    """Lidar and camera."""
    arena, poses = scenario.arena, truth.poses[:, -1]
    range_m = arena.lidar_range_m
    free_m = scan(poses, scene.edges_m, robot_radius_m=arena.robot_radius_m, range_m=range_m)
    return Sensed(
        lidar_m=noisy(free_m, sigma_m=arena.lidar_sigma_m, range_m=range_m, rng=rng),
        sighted=sight_robots(poses, scene.faces_m, range_m=scenario.visual_range_m, rng=rng),
    )


class Measured(NamedTuple):
    """Relative poses of one iteration, of other robots and of own places."""

    others: RelativePoses
    places: RelativePoses


def measure_relative_poses(
    truth: Truth,
    seen: Bool[np.ndarray, "rows peers"],
    scene: Scene,
    scenario: Scenario,
    streams: Streams,
) -> Measured:
    """Relative poses of robots in view, and intra-robot loop closures (Eq. 2)."""
    cfg = scenario.sensing
    others = observe_robots(
        truth.poses[:, -1],
        truth.poses.shape[1] - 1,
        seen,
        cfg=cfg,
        rng=streams.sensing,
        outlier_rng=streams.outliers,
    )
    return Measured(others, measure_loop_closures(truth.poses, scene.faces_m, cfg=cfg, rng=streams.sensing))


def log_measurements(
    belief: Belief, odometry: Edges, measured: Measured, heard: Heard, scenario: Scenario
) -> tuple[MeasurementLog, Int[np.ndarray, " worlds"] | int]:
    """Append an iteration's measurements, those of robots weighted if the scenario asks for it.

    Returns:
        The longer log, and the bytes that packets of a turn took in each world.
    """
    log, (others, places) = belief.log, measured
    rows = Rows.of(len(belief.err), scenario.n_robots)
    found = [odometry]
    if len(others.z):
        found.append(_between_robots(others, belief.paths, weights_of(others, heard, scenario)))
    if len(places.z):
        found.append(Edges.measured(tail=places.tail, head=places.head, z=places.z, sigma=places.sigma))
    directions = bearings_of(others, heard, scenario)
    pings = pings_of(heard, log.pings, others, belief.paths, scenario)
    longer = MeasurementLog(
        edges=extended(log.edges, *found),
        bearings=extended_bearings(log.bearings, directions) if len(directions) else log.bearings,
        pings=extended_pings(log.pings, pings),
    )
    return longer, BYTES_PER_PING * scenario.turn.n_positions * rows.counts(pings.observer[:, 0])


def _between_robots(others: RelativePoses, paths: Paths, weight: Float[np.ndarray, " edges"]) -> Edges:
    """Measurements of other robots, with where these report that they are."""
    return Edges.measured(
        tail=others.tail,
        head=others.head,
        z=others.z,
        sigma=others.sigma,
        weight=weight,
        reported_pose=paths.estimate[others.head[:, 0], others.head[:, 1]],
    )


def refresh_reported_where_linked(
    log: MeasurementLog,
    estimate: Float[np.ndarray, "robots times 3"],
    linked: Bool[np.ndarray, "robots peers"],
) -> tuple[MeasurementLog, Int[np.ndarray, " worlds"] | int]:
    """Let robots whose link carries the desired rate report where they now think they were.

    Returns:
        The log, and the bytes that this took in each world: only what changed is sent.
    """
    edges, rows = log.edges, Rows.of(len(linked), linked.shape[1])
    others = (edges.tail[:, 0] != edges.head[:, 0]).nonzero()[0]
    tail, peer = edges.tail[:, 0].take(others), rows.peer(edges.head[:, 0].take(others))
    there = others[linked.take(tail * linked.shape[1] + peer)]
    if not len(there):
        return log, 0
    now = estimate[edges.head[there, 0], edges.head[there, 1]]
    new = (now != edges.reported_pose[there]).any(axis=1)
    if not new.any():
        return log, 0
    told, changed = edges.reported_pose.copy(), there[new]
    told[changed] = now[new]
    return log._replace(edges=replace(edges, reported_pose=told)), BYTES_PER_POSE * rows.counts(
        edges.tail[changed, 0]
    )
