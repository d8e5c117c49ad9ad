"""Edges at which waves bend: corners of obstacles, and of rooms that are not convex, that stick out.

Worked out once a scene. Faces that go on in a straight line, obstacles that touch each other or a wall with a
side, and notches have no edge there: at most half a turn is open round it.
"""

import functools
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int, Shaped
from scipy.spatial import KDTree

from wifipgo.radio.propagation.link_ends import Points, points_of
from wifipgo.radio.propagation.outline import off_limits
from wifipgo.radio.propagation.scenes import Scenes
from wifipgo.radio.propagation.surfaces import Surfaces

_SAME_M = 1e-9  # rounding in the corners of a room
_STRAIGHT_RAD = 1e-6
# How far off an edge it is asked whether there is open space.
_BESIDE_M = 1e-6


class Edges(NamedTuple):
    """Edges of several worlds, as tables by edge and world.

    Angles about an edge are counted counter-clockwise, from the face that ends there through the open to the
    face that begins there. Where worlds have fewer edges, the rest has no open, so that nothing sees it.

    Attributes:
        at_m: Where they are.
        along: Unit vector from the edge along the face that ends there.
        open_rad: Angle of the open: more than half a turn, a whole one round a screen.
        ending: Line of the scene that ends there.
        beginning: Line that begins there.
        beside: Whether each face after the walls touches the edge.
    """

    at_m: Float[np.ndarray, "2 edges worlds"]
    along: Float[np.ndarray, "2 edges worlds"]
    open_rad: Float[np.ndarray, "edges worlds"]
    ending: Int[np.ndarray, "edges worlds"]
    beginning: Int[np.ndarray, "edges worlds"]
    beside: Bool[np.ndarray, "faces edges worlds"]


@functools.lru_cache(maxsize=64)
def edges_of(scenes: Scenes) -> Edges:
    """Edges of all worlds; of those with fewer, padded."""
    each = [_edges_of(surfaces) for surfaces in scenes.each]
    n_edges, n_faces = max(len(one.open_rad) for one in each), scenes.n_lines - scenes.n_walls - 1
    lines = scenes.n_walls + 1

    def table(columns: list[Shaped[np.ndarray, "..."]], *front: int) -> np.ndarray:
        out = np.zeros((*front, n_edges, len(each)), dtype=columns[0].dtype)
        for world, column in enumerate(columns):
            place: tuple[slice | int, ...] = (*map(slice, column.shape), world)
            out[place] = column
        return out

    return Edges(
        at_m=table([one.at_m for one in each], 2),
        along=table([one.along for one in each], 2),
        open_rad=table([one.open_rad for one in each]),
        ending=table([one.ending for one in each]) + lines,
        beginning=table([one.beginning for one in each]) + lines,
        beside=table([one.beside for one in each], n_faces),
    )


@functools.lru_cache(maxsize=64)
def points_at(scenes: Scenes) -> Points:
    """All edges as points of their worlds: those of the first edge of each world, then the second."""
    at_m = edges_of(scenes).at_m
    world = np.tile(np.arange(scenes.n_worlds), at_m.shape[1])
    return points_of(np.ascontiguousarray(at_m.reshape(2, -1)), world, scenes)


class _Corners(NamedTuple):
    """Edges of one scene; faces are numbered after the walls."""

    at_m: Float[np.ndarray, "2 edges"]
    along: Float[np.ndarray, "2 edges"]
    open_rad: Float[np.ndarray, " edges"]
    ending: Int[np.ndarray, " edges"]
    beginning: Int[np.ndarray, " edges"]
    beside: Bool[np.ndarray, "faces edges"]


@functools.lru_cache(maxsize=512)
def _edges_of(surfaces: Surfaces) -> _Corners:
    """Edges of one scene."""
    faces_m = surfaces.ends_m[surfaces.n_walls :]
    ending, beginning, open_rad = _corners(faces_m)
    at_m, along_m = faces_m[ending, 1], faces_m[ending, 0] - faces_m[ending, 1]
    along = along_m / np.linalg.norm(along_m, axis=1, keepdims=True)
    found = np.flatnonzero(_sticks_out(at_m, along, open_rad, surfaces))
    at_m, along, open_rad = at_m[found], along[found], open_rad[found]
    gap_m = np.abs(faces_m[:, :, None] - at_m).max(axis=-1)
    beside = (gap_m <= _SAME_M).any(axis=1)
    return _Corners(at_m.T, along.T, open_rad, ending[found], beginning[found], beside)


def _corners(
    faces_m: Float[np.ndarray, "faces 2 2"],
) -> tuple[Int[np.ndarray, " found"], Int[np.ndarray, " found"], Float[np.ndarray, " found"]]:
    """Where a face ends and another begins: both, and the angle between them on the side of their fronts.

    Where several begin, the open ends at the first of them.
    """
    if not len(faces_m):
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64), np.zeros(0)
    starts, ends = KDTree(faces_m[:, 0]), KDTree(faces_m[:, 1])
    near = ends.sparse_distance_matrix(starts, _SAME_M, output_type="ndarray")
    ending, beginning = near["i"].astype(np.int64), near["j"].astype(np.int64)
    back_m = faces_m[ending, 0] - faces_m[ending, 1]
    on_m = faces_m[beginning, 1] - faces_m[beginning, 0]
    turn_rad = np.arctan2(back_m[:, 0] * on_m[:, 1] - back_m[:, 1] * on_m[:, 0], (back_m * on_m).sum(axis=1))
    alone = np.bincount(ending, minlength=len(faces_m))[ending] == 1
    folded = (
        np.abs(turn_rad) < _STRAIGHT_RAD
    )  # both ways along one line: a screen, or a seam of two obstacles
    open_rad = np.where(folded, np.where(alone, 2.0 * np.pi, 0.0), np.mod(turn_rad, 2.0 * np.pi))
    order = np.lexsort((open_rad, ending))
    first = order[np.diff(ending[order], prepend=-1) > 0]
    return ending[first], beginning[first], open_rad[first]


def _sticks_out(
    at_m: Float[np.ndarray, "corners 2"],
    along: Float[np.ndarray, "corners 2"],
    open_rad: Float[np.ndarray, " corners"],
    surfaces: Surfaces,
) -> Bool[np.ndarray, " corners"]:
    """Whether more than half a turn is open round each corner, and nothing else stands there."""
    cos, sin = np.cos(0.5 * open_rad), np.sin(0.5 * open_rad)
    away = np.stack([cos * along[:, 0] - sin * along[:, 1], sin * along[:, 0] + cos * along[:, 1]])
    x_m, y_m = at_m.T + _BESIDE_M * away
    by_x, by_y, base_m = surfaces.to_height[1:, :, None].swapaxes(0, 1)
    height_m = by_x * x_m + by_y * y_m + base_m
    walls = slice(surfaces.n_walls)
    within = (height_m[walls] > 0.0).all(axis=0)
    inside = off_limits(y_m, height_m[surfaces.n_walls :], surfaces.outline)
    return (open_rad > np.pi + _STRAIGHT_RAD) & within & ~inside
