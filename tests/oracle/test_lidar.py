"""Lidar against a room measured by hand and against pymunk's own ray casts."""

import numpy as np
import pymunk
import pytest

from wifipgo.segments import polygon_edges
from wifipgo.world.layout import ArenaConfig, room_walls
from wifipgo.world.lidar import N_LIDAR_RAYS, ray_directions, scan
from wifipgo.world.placing import random_layout

HULL_M, RANGE_M = 0.15, 4.0
BOX = np.array([[4.0, 4.0], [6.0, 4.0], [6.0, 6.0], [4.0, 6.0]])


def test_walls_boxes_and_robots_at_known_distances() -> None:
    poses = np.array([[2.0, 5.0, 0.0], [2.0, 7.0, 0.0]])
    edges = np.concatenate([room_walls(10.0), polygon_edges(BOX)])
    free_m = scan(poses, edges, robot_radius_m=HULL_M, range_m=RANGE_M)
    ahead, left, back, right = free_m[0, :: N_LIDAR_RAYS // 4]
    assert ahead == pytest.approx(2.0 - HULL_M, abs=2e-3)  # box
    assert left == pytest.approx(2.0 - 2.0 * HULL_M, abs=2e-3)  # other robot
    assert back == pytest.approx(2.0 - HULL_M, abs=2e-3)  # wall
    assert right == RANGE_M  # wall too far


@pytest.mark.parametrize(("n_robots", "n_boxes", "size_m"), [(2, 4, 20.0), (30, 0, 12.0), (30, 20, 40.0)])
def test_agrees_with_pymunk(n_robots: int, n_boxes: int, size_m: float) -> None:
    cfg = ArenaConfig(size_m=size_m, n_obstacles=n_boxes)
    layout = random_layout(n_robots, cfg, rng=np.random.default_rng(n_boxes))
    edges = np.concatenate([layout.walls_m, layout.faces_m])
    free_m = scan(layout.starts, edges, robot_radius_m=HULL_M, range_m=RANGE_M)
    rays = ray_directions(layout.starts[:, 2])
    start = layout.starts[:, None, :2] + (HULL_M + 1e-3) * rays
    np.testing.assert_allclose(free_m, _cast(start, start + RANGE_M * rays, layout, edges), atol=1e-9)


def _cast(start: np.ndarray, end: np.ndarray, layout: object, edges: np.ndarray) -> np.ndarray:
    space = pymunk.Space()
    for a, b in edges.tolist():
        space.add(pymunk.Segment(space.static_body, tuple(a), tuple(b), 0.0))
    for x, y, _ in layout.starts.tolist():  # type: ignore[attr-defined]
        space.add(pymunk.Circle(space.static_body, HULL_M, (x, y)))
    pairs = zip(start.reshape(-1, 2).tolist(), end.reshape(-1, 2).tolist(), strict=True)
    hits = [space.segment_query_first(tuple(a), tuple(b), 0.0, pymunk.ShapeFilter()) for a, b in pairs]
    alpha = [1.0 if hit is None else hit.alpha for hit in hits]
    return RANGE_M * np.array(alpha).reshape(start.shape[:2])
