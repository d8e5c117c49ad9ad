"""Who may touch something on a straight way: walls, obstacles, each other. Whoever may not needs no physics.

All worlds at once. What surely keeps away is put aside by boxes and neighbourhoods; for the rest the
distance between bodies is worked out as they move, so few are taken to touch that do not.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float, Int

from wifipgo import segments
from wifipgo.se2 import length
from wifipgo.world.boxes import meeting
from wifipgo.world.layout import FAR_FACE_M, Layout
from wifipgo.world.neighbours import Neighbours, neighbours

# Bodies that keep further apart than this do not touch, however positions are rounded.
_CLEAR_M = 1e-6
# Pushed robots may be taken this much further from where they started than their step.
_PUSHED_M = 0.02
_TINY_M2 = 1e-300


class Contacts:
    """What stands in the way in each world."""

    def __init__(self, layouts: Sequence[Layout], *, radius_m: float, longest_m: float) -> None:
        """Take down outlines.

        Args:
            layouts: Walls, obstacles and number of robots of each world.
            radius_m: Of every robot.
            longest_m: No robot drives further at a time.
        """
        self._n = len(layouts[0].starts)
        self._radius_m, self._longest_m = radius_m, longest_m
        bounds_m = [(one.walls_m.min(axis=(0, 1)), one.walls_m.max(axis=(0, 1))) for one in layouts]
        self._room_m = np.repeat(np.array(bounds_m), self._n, axis=0)
        self._obstacles = _Outlines([one.obstacles_m for one in layouts])

    def may_touch(
        self, start_m: Float[np.ndarray, "rows 2"], target_m: Float[np.ndarray, "rows 2"]
    ) -> Bool[np.ndarray, " rows"]:
        """Robots that touch something on their way, and those whose way one of these may get into.

        A robot that touches something may leave its way, as far as a step.

        Args:
            start_m: Where robots are, world after world.
            target_m: Where they head for; all take as long.
        """
        reach_m = self._radius_m + _CLEAR_M
        low_m, high_m = np.minimum(start_m, target_m) - reach_m, np.maximum(start_m, target_m) + reach_m
        outside = (low_m < self._room_m[:, 0]) | (high_m > self._room_m[:, 1])
        touch: np.ndarray = outside[:, 0] | outside[:, 1]
        row, face_m, inside = self._obstacles.near(low_m, high_m, start_m, self._n)
        touch[inside] = True
        if len(row):
            touch[row[_gap_m(start_m[row], target_m[row], face_m) < reach_m]] = True
        far_m = self._longest_m + 2.0 * self._radius_m + _PUSHED_M
        pairs = neighbours(start_m, self._n, self._longest_m + far_m)
        if len(pairs.row):
            meet = _closest_m(start_m, target_m - start_m, pairs) < 2.0 * self._radius_m + _CLEAR_M
            touch[pairs.row[meet]] = True
            _join_in_reach(touch, start_m, target_m, pairs, far_m)
        return touch


class _Outlines:
    """Edges of all obstacles of all worlds in one list, and the boxes about the obstacles."""

    def __init__(self, worlds: Sequence[Sequence[np.ndarray]]) -> None:
        """Take the corners of the obstacles of each world."""
        most, every = max(map(len, worlds)), [corners for world in worlds for corners in world]
        self._edges_m = np.concatenate([np.zeros((0, 2, 2)), *map(segments.polygon_edges, every)])
        self._low_m, self._high_m = np.full((2, len(worlds), most, 2), FAR_FACE_M[0])
        self._first, self._count = np.zeros((2, len(worlds), most), dtype=np.int64)
        n_before = 0
        for k, world in enumerate(worlds):
            for j, corners in enumerate(world):
                self._low_m[k, j], self._high_m[k, j] = corners.min(axis=0), corners.max(axis=0)
                self._first[k, j], self._count[k, j] = n_before, len(corners)
                n_before += len(corners)

    def near(
        self,
        low_m: Float[np.ndarray, "rows 2"],
        high_m: Float[np.ndarray, "rows 2"],
        start_m: Float[np.ndarray, "rows 2"],
        n_robots: int,
    ) -> tuple[Int[np.ndarray, " pairs"], Float[np.ndarray, "pairs 2 2"], Int[np.ndarray, " inside"]]:
        """Rows and edges of obstacles whose box meets a robot's box, and rows that start in an obstacle."""
        none = np.zeros(0, dtype=np.int64)
        if not len(self._edges_m):
            return none, self._edges_m, none
        world = np.arange(len(low_m)) // n_robots
        row, obstacle = meeting(low_m, high_m, (self._low_m, self._high_m), world)
        if not len(row):
            return none, self._edges_m[:0], none
        count, first = (table[world[row], obstacle] for table in (self._count, self._first))
        begin = np.cumsum(count) - count
        edge_m = self._edges_m[np.arange(count.sum()) + np.repeat(first - begin, count)]
        each = np.repeat(row, count)
        odd = np.add.reduceat(_left_of(start_m[each], edge_m), begin) % 2 == 1
        return each, edge_m, row[odd]


def _left_of(
    p_m: Float[np.ndarray, "pairs 2"], edge_m: Float[np.ndarray, "pairs 2 2"]
) -> Int[np.ndarray, " pairs"]:
    """1 where a ray in the direction of x meets the edge: an odd number of edges if from inside."""
    a_m, b_m = edge_m[:, 0], edge_m[:, 1]
    up = p_m[:, 1] < b_m[:, 1]
    met = (p_m[:, 1] < a_m[:, 1]) != up
    met &= (segments.cross(b_m - a_m, p_m - a_m) > 0.0) == up
    return met.astype(np.int64)


def _gap_m(
    start_m: Float[np.ndarray, "pairs 2"],
    target_m: Float[np.ndarray, "pairs 2"],
    edge_m: Float[np.ndarray, "pairs 2 2"],
) -> Float[np.ndarray, " pairs"]:
    """Distance between each way and its edge, 0 where they cross."""
    way_m = np.empty_like(edge_m)
    way_m[:, 0], way_m[:, 1] = start_m, target_m
    ends_m = np.concatenate([start_m, target_m, edge_m[:, 0], edge_m[:, 1]])
    other_m = np.concatenate([edge_m, edge_m, way_m, way_m])[:, None]
    gap_m: np.ndarray = segments.distance_to_segments(ends_m, other_m).reshape(4, -1).min(axis=0)
    gap_m[segments.crossings(start_m, target_m, edge_m[:, None])[:, 0]] = 0.0
    return gap_m


def _closest_m(
    start_m: Float[np.ndarray, "rows 2"], way_m: Float[np.ndarray, "rows 2"], pairs: Neighbours
) -> Float[np.ndarray, " pairs"]:
    """Least distance between the middles of two robots that drive at the same time, each at its own speed."""
    d_m, closing_m = start_m[pairs.other] - start_m[pairs.row], way_m[pairs.other] - way_m[pairs.row]
    along_m2, square_m2 = (d_m * closing_m).sum(axis=-1), (closing_m * closing_m).sum(axis=-1)
    when = np.minimum(np.maximum(-along_m2 / np.maximum(square_m2, _TINY_M2), 0.0), 1.0)
    return length(d_m + when[:, None] * closing_m)


def _join_in_reach(
    touch: Bool[np.ndarray, " rows"],
    start_m: Float[np.ndarray, "rows 2"],
    target_m: Float[np.ndarray, "rows 2"],
    pairs: Neighbours,
    far_m: float,
) -> None:
    """Add, in place, robots whose way comes within reach of one that touches something, again and again."""
    while True:
        asked = (touch[pairs.row] & ~touch[pairs.other]).nonzero()[0]
        if not len(asked):
            return
        other = pairs.other[asked]
        way_m = np.stack([start_m[other], target_m[other]], axis=1)[:, None]
        near = segments.distance_to_segments(start_m[pairs.row[asked]], way_m)[:, 0] <= far_m
        if not near.any():
            return
        touch[other[near]] = True
