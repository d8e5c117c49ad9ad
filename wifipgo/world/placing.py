"""Boxes and starts at random places: tried one after the other, each kept if it fits beside those before.

Rejection takes many tries where a room is nearly full, so boxes are drawn and measured by the hundred, and
again beside each that is kept. What is drawn and kept is as if each were tried by itself.
"""

from collections.abc import Iterator, Sequence

import numpy as np
from jaxtyping import Float, Int
from scipy.spatial import cKDTree

from wifipgo import segments
from wifipgo.errors import BadInputError, require
from wifipgo.world import map_checks
from wifipgo.world.layout import ArenaConfig, Layout, room_walls
from wifipgo.world.map_checks import SURELY_M, Outlines, gap_to_obstacles
from wifipgo.world.polygons import area_m2

# So many boxes or starts in a row that do not fit, and the room is taken to be full.
_TRIES = 2_000
# Boxes that are drawn at a time.
_BATCH = 512
_CORNERS = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


def random_layout(n_robots: int, cfg: ArenaConfig, *, rng: np.random.Generator) -> Layout:
    """A square room with what was placed by hand, and random boxes and starts where nothing was.

    Raises:
        ValueError: If the room does not hold it, or there are starts for another number of robots.
    """
    by_hand = [np.array(corners) for corners in cfg.obstacles_m]
    obstacles_m = [*by_hand, *random_obstacles(cfg, rng=rng)]
    if cfg.starts:
        require(len(cfg.starts) == n_robots, "ArenaConfig.starts", f"empty or {n_robots} long", cfg.starts)
        starts = np.array(cfg.starts)
    else:
        starts = random_starts(n_robots, obstacles_m, cfg, rng=rng)
    return Layout(walls_m=room_walls(cfg.size_m), obstacles_m=obstacles_m, starts=starts)


def random_obstacles(cfg: ArenaConfig, *, rng: np.random.Generator) -> list[Float[np.ndarray, "4 2"]]:
    """Boxes at random, each with a passage around it: so many, or so much of the floor.

    By share, boxes are placed until they cover enough, then all shrunk by one factor so that
    they cover no more; passages only grow by that.

    Raises:
        ValueError: If the room does not hold them beside the obstacles placed by hand.
    """
    goal_m2, covered_m2, last = cfg.obstacle_density * cfg.size_m**2, 0.0, 0
    boxes: list[np.ndarray] = []
    if not cfg.n_obstacles and not goal_m2:
        return boxes
    by_hand, tries = Outlines([np.array(corners) for corners in cfg.obstacles_m]), _Tries(cfg, rng)
    for number, box in tries.beside(boxes):
        if number - last > _TRIES:
            _refuse_boxes(cfg, len(boxes), covered_m2)
        if box is None or not _fits(box, by_hand, cfg):
            continue
        boxes.append(box)
        covered_m2, last = covered_m2 + area_m2(box), number
        if len(boxes) >= cfg.n_obstacles and covered_m2 >= goal_m2:
            break
    tries.stop_after(last)
    return [_shrunk(box, np.sqrt(goal_m2 / covered_m2)) for box in boxes] if goal_m2 else boxes


class _Tries:
    """Boxes with random sides, places and directions, in batches from one stream."""

    def __init__(self, cfg: ArenaConfig, rng: np.random.Generator) -> None:
        """Draw from ``rng``."""
        self._cfg, self._rng, self._n_before = cfg, rng, 0
        self._state = rng.bit_generator.state

    def _drawn(self, count: int) -> Float[np.ndarray, "boxes 5"]:
        """Sides, direction and middle of the next boxes, in the order in which one would draw them."""
        cfg = self._cfg
        low = [cfg.obstacle_min_m, cfg.obstacle_min_m, 0.0, 0.0, 0.0]
        high = [cfg.obstacle_max_m, cfg.obstacle_max_m, 0.5 * np.pi, cfg.size_m, cfg.size_m]
        return self._rng.uniform(low, high, (count, 5))

    def beside(self, placed: Sequence[np.ndarray]) -> Iterator[tuple[int, np.ndarray | None]]:
        """Number, from 1 on, and corners of each box beside those placed; after a batch its last and None.

        Args:
            placed: Boxes so far; it may grow meanwhile.
        """
        while True:
            self._state = self._rng.bit_generator.state
            drawn = self._drawn(_BATCH)
            left, corners_m = _beside(drawn, placed, self._cfg)
            while len(left):
                known = len(placed)
                yield self._n_before + int(left[0]) + 1, _corners_of(drawn[left[0]])
                left = left[1:]
                for box_m in placed[known:]:
                    near = _within(drawn[left, 3:], box_m, _reach_m(self._cfg))
                    gap_m = _box_gaps(corners_m[left[near]], box_m[None])
                    left = np.delete(left, near[gap_m < self._cfg.clearance_m])
            self._n_before += _BATCH
            yield self._n_before, None

    def stop_after(self, number: int) -> None:
        """Leave the stream as if no box after this one had been drawn; it is of the last batch."""
        self._rng.bit_generator.state = self._state
        self._drawn(number - self._n_before)


def _corners_of(drawn: Float[np.ndarray, "5"]) -> Float[np.ndarray, "4 2"]:
    """Corners of a box, counter-clockwise."""
    half, yaw = 0.5 * drawn[:2], drawn[2]
    turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
    return drawn[3:] + (_CORNERS * half) @ turn.T


def _beside(
    drawn: Float[np.ndarray, "boxes 5"], placed: Sequence[np.ndarray], cfg: ArenaConfig
) -> tuple[Int[np.ndarray, " left"], Float[np.ndarray, "boxes 4 2"]]:
    """Boxes not surely too near to a wall, nor too near to a box that is placed, and the corners of all."""
    corners_m = _all_corners(drawn)
    wall_m = np.minimum(corners_m, cfg.size_m - corners_m).min(axis=(1, 2))
    left = np.flatnonzero(wall_m >= cfg.clearance_m - SURELY_M)
    if placed and len(left):
        others_m, may = np.array(placed), np.ones(len(left), dtype=bool)
        trees = (cKDTree(points_m) for points_m in (drawn[left, 3:], others_m.mean(axis=1)))
        pairs = next(trees).sparse_distance_matrix(next(trees), _reach_m(cfg), output_type="ndarray")
        gap_m = _box_gaps(corners_m[left[pairs["i"]]], others_m[pairs["j"]])
        may[pairs["i"][gap_m < cfg.clearance_m]] = False
        left = left[may]
    return left, corners_m


def _reach_m(cfg: ArenaConfig) -> float:
    """From middle to middle: boxes farther apart leave a passage."""
    return cfg.clearance_m + float(np.sqrt(2.0)) * cfg.obstacle_max_m


def _within(
    middle_m: Float[np.ndarray, "boxes 2"], box_m: Float[np.ndarray, "4 2"], reach_m: float
) -> Int[np.ndarray, " near"]:
    """Which boxes have their middle within reach of that of another."""
    x_m, y_m = (middle_m - box_m.mean(axis=0)).T
    return np.flatnonzero(x_m * x_m + y_m * y_m <= reach_m * reach_m)


def _all_corners(drawn: Float[np.ndarray, "boxes 5"]) -> Float[np.ndarray, "boxes 4 2"]:
    """Corners of many boxes, to rounding those of `_corners_of`."""
    cos, sin = np.cos(drawn[:, 2, None]), np.sin(drawn[:, 2, None])
    x, y = (_CORNERS * 0.5 * drawn[:, None, :2]).transpose(2, 0, 1)
    return drawn[:, None, 3:] + np.stack([cos * x - sin * y, sin * x + cos * y], axis=-1)


def _along_sides(
    corners_m: Float[np.ndarray, "#pairs 4 2"], box_m: Float[np.ndarray, "#pairs 4 2"]
) -> tuple[Float[np.ndarray, "pairs 4 2"], Float[np.ndarray, "#pairs 2"]]:
    """Corners in the frame of a box, from its middle along its sides, and half of its sides."""
    side = box_m[:, 1:3] - box_m[:, :2]
    length_m = np.hypot(side[..., 0], side[..., 1])
    along_m = (corners_m - box_m.mean(axis=1)[:, None]) @ (side / length_m[..., None]).swapaxes(1, 2)
    return along_m, 0.5 * length_m


def _nearest(
    along_m: Float[np.ndarray, "pairs 4 2"], half_m: Float[np.ndarray, "#pairs 2"]
) -> Float[np.ndarray, " pairs"]:
    """Distance of the nearest of such corners from the box."""
    out_m = np.maximum(np.abs(along_m) - half_m[:, None], 0.0)
    distance_m: np.ndarray = np.hypot(out_m[..., 0], out_m[..., 1]).min(axis=1)
    return distance_m


def _fits(box: np.ndarray, by_hand: Outlines, cfg: ArenaConfig) -> bool:
    """Whether a box leaves a passage to the walls and to what was placed by hand, and room around starts."""
    if box.min() < cfg.clearance_m or box.max() > cfg.size_m - cfg.clearance_m:
        return False
    near = by_hand.nearer(box.min(axis=0), box.max(axis=0), cfg.clearance_m)
    if any(_polygon_gap(box, other) < cfg.clearance_m for other in near.values()):
        return False
    starts_m = np.array(cfg.starts).reshape(-1, 3)[:, :2]
    return not cfg.starts or bool(gap_to_obstacles(starts_m, [box]).min() > 2.0 * cfg.robot_radius_m)


def _polygon_gap(a: np.ndarray, b: np.ndarray) -> float:
    """Distance between two polygons, 0 if they overlap."""
    if segments.crossings(a, np.roll(a, -1, axis=0), segments.polygon_edges(b)).any():
        return 0.0
    return float(min(gap_to_obstacles(a, [b]).min(), gap_to_obstacles(b, [a]).min()))


def _box_gaps(
    a_m: Float[np.ndarray, "#boxes 4 2"], b_m: Float[np.ndarray, "#boxes 4 2"]
) -> Float[np.ndarray, " boxes"]:
    """Distances between boxes, 0 where they overlap: where no side of either parts them."""
    gap_m, apart = np.inf, np.False_
    for corners_m, box_m in ((a_m, b_m), (b_m, a_m)):
        along_m, half_m = _along_sides(corners_m, box_m)
        gap_m = np.minimum(gap_m, _nearest(along_m, half_m))
        parted = (along_m.min(axis=1) > half_m) | (along_m.max(axis=1) < -half_m)
        apart = apart | parted.any(axis=-1)
    return np.where(apart, gap_m, 0.0)


def _shrunk(box: np.ndarray, factor: float) -> np.ndarray:
    """Box about its middle."""
    middle = box.mean(axis=0)
    return middle + factor * (box - middle)


def _refuse_boxes(cfg: ArenaConfig, n_placed: int, covered_m2: float) -> None:
    """Say that the room is full, and how much of what was asked for it holds."""
    room = f"a {cfg.size_m} m room with {cfg.clearance_m} m of clearance"
    if cfg.n_obstacles:
        rule = f"at most what fits {room} (placed {n_placed})"
        raise BadInputError(f"ArenaConfig.n_obstacles must be {rule}, got {cfg.n_obstacles}")
    rule = f"at most what fits {room} (covered {covered_m2 / cfg.size_m**2:.3f})"
    raise BadInputError(f"ArenaConfig.obstacle_density must be {rule}, got {cfg.obstacle_density}")


def random_starts(
    n_robots: int, obstacles_m: Sequence[np.ndarray], cfg: ArenaConfig, *, rng: np.random.Generator
) -> Float[np.ndarray, "robots 3"]:
    """Robots' start poses: uniform over the free room, clear of obstacles and of each other.

    Where obstacles placed by hand cut the floor into parts, all starts lie in the largest.

    Raises:
        ValueError: If the room does not hold ``n_robots``.
    """
    margin, starts, misses = 2.0 * cfg.robot_radius_m, np.zeros((0, 3)), 0
    rule = f"more than four times robot_radius_m ({cfg.robot_radius_m:g}) for random starts"
    require(cfg.size_m > 2.0 * margin, "ArenaConfig.size_m", rule, cfg.size_m)
    outlines = Outlines(obstacles_m)
    while len(starts) < n_robots:
        p_m = rng.uniform(margin, cfg.size_m - margin, (1, 2))
        apart = np.linalg.norm(starts[:, :2] - p_m, axis=1).min(initial=np.inf)
        yaw = rng.uniform(-np.pi, np.pi, (1, 1))
        if apart > 2.0 * margin and _is_free(p_m, outlines, margin) and _in_largest_part(p_m, cfg):
            starts, misses = np.concatenate([starts, np.concatenate([p_m, yaw], axis=1)]), 0
        elif (misses := misses + 1) == _TRIES:
            rule = f"at most what fits the room (placed {len(starts)})"
            raise BadInputError(f"n_robots must be {rule}, got {n_robots}")
    return starts


def _is_free(p_m: Float[np.ndarray, "1 2"], obstacles: Outlines, margin_m: float) -> bool:
    """Whether a point is further than a margin from all obstacles."""
    near = obstacles.nearer(p_m[0], p_m[0], margin_m + SURELY_M)
    return bool(gap_to_obstacles(p_m, list(near.values()))[0] > margin_m)


def _in_largest_part(p_m: np.ndarray, cfg: ArenaConfig) -> bool:
    if not cfg.obstacles_m:
        return True
    floor = map_checks.floor_of(cfg.obstacles_m, cfg.size_m, cfg.robot_radius_m)
    return bool(floor.part_of(p_m)[0] == floor.largest)
