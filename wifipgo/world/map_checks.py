"""Obstacle maps: polygons and starts given by hand, checked before anything is built on them.

The rules: every obstacle is a simple polygon, has an area and lies in the room; no two overlap, though they
may touch, which is how to close a ring. The floor on which a robot fits may fall into parts; then all
starts lie in one of them.
"""

import functools
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Int
from scipy import ndimage

from wifipgo import segments
from wifipgo.errors import require
from wifipgo.world.polygons import (
    TINY_M,
    area_m2,
    convex_parts,
    inside_polygon,
    is_simple,
    squares_about,
    without_repeats,
)

Corners = tuple[tuple[float, float], ...]
# What messages call them.
OBSTACLES, STARTS = "ArenaConfig.obstacles_m", "ArenaConfig.starts"
# Cells of the floor are half a robot's radius wide, but there are at most this many along a side.
_MOST_CELLS = 400
# Each corner is tried against each edge; the outline of a country has fewer.
_MOST_CORNERS, _MOST_CORNERS_IN_ALL = 1_000, 100_000
# What is nearer by more than this is nearer, however distances are rounded.
SURELY_M = 1e-6


class Outlines:
    """Polygons by the rectangles around them along the axes, to find those that may be near."""

    def __init__(self, polygons_m: Sequence[Float[np.ndarray, "_ 2"]] = ()) -> None:
        """Hold polygons; more can be added."""
        self._polygons_m: list[np.ndarray] = []
        self._low_m, self._high_m = np.zeros((2, 16, 2))
        for polygon_m in polygons_m:
            self.add(polygon_m)

    def add(self, polygon_m: Float[np.ndarray, "_ 2"]) -> None:
        """One more."""
        n = len(self._polygons_m)
        if n == len(self._low_m):
            self._low_m, self._high_m = (np.concatenate([old, old]) for old in (self._low_m, self._high_m))
        self._low_m[n], self._high_m[n] = polygon_m.min(axis=0), polygon_m.max(axis=0)
        self._polygons_m.append(polygon_m)

    def nearer(
        self, low_m: Float[np.ndarray, "2"], high_m: Float[np.ndarray, "2"], gap_m: float
    ) -> dict[int, Float[np.ndarray, "_ 2"]]:
        """Those whose rectangles come nearer to a rectangle than a gap along both axes, by their numbers."""
        n = len(self._polygons_m)
        near = (low_m - self._high_m[:n] < gap_m) & (self._low_m[:n] - high_m < gap_m)
        return {k: self._polygons_m[k] for k in (near[:, 0] & near[:, 1]).nonzero()[0].tolist()}


def gap_to_obstacles(
    p_m: Float[np.ndarray, "points 2"], obstacles_m: Sequence[Float[np.ndarray, "_ 2"]]
) -> Float[np.ndarray, " points"]:
    """Distance of points from the nearest obstacle, 0 inside one."""
    gap = np.full(len(p_m), np.inf)
    for corners in obstacles_m:
        away = segments.distance_to_segments(p_m, segments.polygon_edges(corners)).min(axis=1)
        gap = np.minimum(gap, np.where(inside_polygon(p_m, corners), 0.0, away))
    return gap


def counter_clockwise(obstacles_m: Sequence[Corners], *, size_m: float) -> tuple[Corners, ...]:
    """Check each obstacle by itself and turn it counter-clockwise; a corner that is repeated counts once.

    Raises:
        ValueError: One that has fewer than three corners, crosses or touches itself, has no area or is
            not in the room; names its index.
    """
    total = sum(map(len, obstacles_m))
    require(total <= _MOST_CORNERS_IN_ALL, OBSTACLES, f"at most {_MOST_CORNERS_IN_ALL} corners", total)
    out = []
    for k, corners in enumerate(obstacles_m):
        name = f"{OBSTACLES}[{k}]"
        points = without_repeats(np.array(corners).reshape(-1, 2)) if corners else np.zeros((0, 2))
        require(len(points) >= 3, name, "at least 3 corners", corners)
        require(len(points) <= _MOST_CORNERS, name, f"at most {_MOST_CORNERS} corners", len(points))
        points = points if area_m2(points) > 0.0 else points[::-1]
        inside = points.min() >= -TINY_M and points.max() <= size_m + TINY_M
        require(inside, name, f"in the room, 0..{size_m:g} m", corners)
        proper = is_simple(points) and area_m2(points) > TINY_M
        require(proper, name, "of some area, with no edge that crosses or touches another", corners)
        out.append(tuple((float(x), float(y)) for x, y in points))
    return tuple(out)


def check_apart(obstacles_m: Sequence[Corners]) -> None:
    """Refuse obstacles that overlap; touching is allowed.

    Raises:
        ValueError: Two that overlap; names both indices.
    """
    polygons = [np.array(corners) for corners in obstacles_m]
    low_m = np.array([polygon.min(axis=0) for polygon in polygons])
    high_m = np.array([polygon.max(axis=0) for polygon in polygons])
    parts = [convex_parts(polygon) for polygon in polygons]
    for later, own in enumerate(parts):
        boxes_meet = ((low_m[:later] < high_m[later]) & (low_m[later] < high_m[:later])).all(axis=-1)
        for earlier in np.flatnonzero(boxes_meet).tolist():
            apart = all(_separated(a, b) for a in parts[earlier] for b in own)
            require(apart, f"{OBSTACLES}[{later}]", f"clear of {OBSTACLES}[{earlier}]", obstacles_m[later])


def _separated(a: np.ndarray, b: np.ndarray) -> bool:
    """Whether an edge of one of two convex counter-clockwise polygons has the other on its outer side."""
    return _has_outer_edge(a, b) or _has_outer_edge(b, a)


def _has_outer_edge(of: np.ndarray, other: np.ndarray) -> bool:
    edges = segments.polygon_edges(of)
    along = edges[:, 1] - edges[:, 0]
    along /= np.hypot(*along.T)[:, None]
    depth_m = segments.cross(along[:, None], other[None] - edges[:, None, 0])
    return bool((depth_m.max(axis=1) <= TINY_M).any())


def check_starts(
    starts: Sequence[Sequence[float]],
    obstacles_m: Sequence[Corners],
    *,
    size_m: float,
    radius_m: float,
) -> None:
    """Refuse starts at which a robot would stand in a wall, an obstacle or another robot.

    Raises:
        ValueError: Such a start; names its index and that of the obstacle or the other start.
    """
    poses, outlines = np.array(starts).reshape(-1, 3), Outlines([np.array(c) for c in obstacles_m])
    for k, (pose, start) in enumerate(zip(poses, starts, strict=True)):
        name, p_m = f"{STARTS}[{k}]", pose[None, :2]
        inside = pose[:2].min() >= radius_m and pose[:2].max() <= size_m - radius_m
        require(inside, name, f"a robot's radius inside the room, {radius_m:g}..{size_m - radius_m:g}", start)
        for index, corners_m in outlines.nearer(p_m[0], p_m[0], radius_m + SURELY_M).items():
            clear = gap_to_obstacles(p_m, [corners_m])[0] >= radius_m
            rule = f"a robot's radius ({radius_m:g} m) from {OBSTACLES}[{index}]"
            require(bool(clear), name, rule, start)
        for index in np.flatnonzero(np.hypot(*(poses[:k, :2] - pose[:2]).T) < 2.0 * radius_m).tolist():
            require(False, name, f"two radii ({2.0 * radius_m:g} m) from {STARTS}[{index}]", start)


class Floor:
    """Where a robot fits in a room with obstacles, by cells, and which of these places hang together.

    A passage counts if it is wider than a robot by one cell, half a robot's radius.
    """

    def __init__(self, obstacles_m: Sequence[Corners], *, size_m: float, radius_m: float) -> None:
        """Mark the cells at whose centre a robot fits, and number the parts that they make."""
        n = int(np.clip(np.ceil(2.0 * size_m / radius_m), 1, _MOST_CELLS))
        self._cell_m = size_m / n
        at_m = self._cell_m * (np.arange(n) + 0.5)
        centre_m = np.stack(np.meshgrid(at_m, at_m, indexing="ij"), -1)
        fits = np.minimum(centre_m, size_m - centre_m).min(axis=-1) >= radius_m
        for corners in map(np.array, obstacles_m):
            about = squares_about(corners, self._cell_m, n, margin_m=radius_m)
            gap_m = gap_to_obstacles(centre_m[about].reshape(-1, 2), [corners])
            fits[about] &= gap_m.reshape(fits[about].shape) >= radius_m
        self._part = ndimage.label(fits)[0]
        self._near = np.where(self._part > 0, self._part, ndimage.grey_dilation(self._part, size=(3, 3)))

    def part_of(self, p_m: Float[np.ndarray, "points 2"]) -> Int[np.ndarray, " points"]:
        """Part of the floor that each point is in or a cell away from; 0 where no robot fits."""
        cell = np.clip((p_m / self._cell_m).astype(int), 0, len(self._part) - 1)
        return self._near[cell[:, 0], cell[:, 1]].astype(np.int64)

    @functools.cached_property
    def largest(self) -> int:
        """Number of the part with most cells; 0 if no robot fits anywhere."""
        cells = np.bincount(self._part.ravel())[1:]
        return int(cells.argmax()) + 1 if len(cells) else 0


@functools.lru_cache(maxsize=32)
def floor_of(obstacles_m: tuple[Corners, ...], size_m: float, radius_m: float) -> Floor:
    """The floor of a map, worked out once."""
    return Floor(obstacles_m, size_m=size_m, radius_m=radius_m)


def check_room_left(
    obstacles_m: tuple[Corners, ...],
    starts: Sequence[Sequence[float]],
    *,
    size_m: float,
    radius_m: float,
) -> None:
    """Refuse a map without room for a robot, and starts that no robot could drive between.

    Raises:
        ValueError: Names the largest obstacle, or the first start that is cut off from start 0.
    """
    floor = floor_of(obstacles_m, size_m, radius_m)
    if not floor.largest:
        k = int(np.argmax([area_m2(np.array(corners)) for corners in obstacles_m]))
        require(
            False,
            f"{OBSTACLES}[{k}]",
            f"small enough to leave a robot room in {size_m:g} m",
            obstacles_m[k],
        )
    part = floor.part_of(np.array(starts).reshape(-1, 3)[:, :2])
    for k in np.flatnonzero((part != part[:1]) | (part == 0)).tolist():
        require(False, f"{STARTS}[{k}]", f"where a robot can drive to from {STARTS}[0]", starts[k])
