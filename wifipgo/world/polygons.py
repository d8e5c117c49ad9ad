"""Simple polygons of any shape: what lies inside, and the convex parts that they consist of.

Physics and the test for overlap need convex parts, so there is one way to cut, along diagonals, which adds
no corners: every part's corners are the polygon's own.
"""

import numpy as np
from jaxtyping import Bool, Float

from wifipgo.segments import cross, crossings, distance_to_segments, polygon_edges

# Lengths below this are rounding, in rooms of up to kilometres.
TINY_M = 1e-9
# Corners, or diagonals, that are tried against all edges at once.
_BLOCK, _FEW_DIAGONALS = 256, 16
# A corner that turns by less (sine of the angle) is straight.
_STRAIGHT = 1e-9


def inside_polygon(
    p_m: Float[np.ndarray, "points 2"], corners_m: Float[np.ndarray, "corners 2"]
) -> Bool[np.ndarray, " points"]:
    """Which points lie inside a simple polygon; its edges do not.

    A ray in the direction of x leaves the polygon through an odd number of edges from inside.
    """
    start_m, end_m = polygon_edges(corners_m).swapaxes(0, 1)
    side = cross((end_m - start_m)[None], p_m[:, None] - start_m)
    y_m = p_m[:, 1:]
    met = (y_m < start_m[:, 1]) != (y_m < end_m[:, 1])
    met &= (side > 0.0) == (end_m[:, 1] > start_m[:, 1])
    inside = np.logical_xor.reduce(met, axis=1)
    point, edge = np.nonzero(side == 0.0)  # on the line of an edge, rarely
    if len(point):
        beyond = (p_m[point] - start_m[edge]) * (p_m[point] - end_m[edge]) > 0.0
        inside[point[~beyond.any(axis=1)]] = False
    return inside


def squares_about(
    corners_m: Float[np.ndarray, "corners 2"], width_m: float, n: int, *, margin_m: float = 0.0
) -> tuple[slice, slice]:
    """Of ``n`` by ``n`` squares from the origin, those that a polygon with a margin around it may touch."""
    low = np.floor((corners_m.min(axis=0) - margin_m) / width_m) - 1.0  # one more, for rounding
    high = np.floor((corners_m.max(axis=0) + margin_m) / width_m) + 2.0
    (x0, y0), (x1, y1) = np.clip([low, high], 0, n).astype(int).tolist()
    return slice(x0, x1), slice(y0, y1)


def area_m2(corners_m: Float[np.ndarray, "corners 2"]) -> float:
    """Area of a simple polygon, positive if it is counter-clockwise."""
    return float(0.5 * cross(corners_m, np.roll(corners_m, -1, axis=0)).sum())


def is_simple(corners_m: Float[np.ndarray, "corners 2"]) -> bool:
    """Whether all edges have a length, and meet only where two in a row share a corner."""
    edges = polygon_edges(corners_m)
    if np.hypot(*(edges[:, 1] - edges[:, 0]).T).min() <= TINY_M:
        return False
    n = len(edges)
    for first in range(0, n, _BLOCK):  # pairs of corners and edges take memory
        corner = np.arange(first, min(first + _BLOCK, n))
        away_m = distance_to_segments(corners_m[corner], edges)
        away_m[corner - first, corner] = away_m[corner - first, corner - 1] = np.inf  # edges that it ends
        met = crossings(edges[corner, 0], edges[corner, 1], edges)
        if away_m.min() <= TINY_M or met.any():
            return False
    return True


def without_repeats(corners_m: Float[np.ndarray, "corners 2"]) -> Float[np.ndarray, "_ 2"]:
    """Corners that differ from the one before: a ring may be closed by its first corner, or stutter."""
    apart_m = np.hypot(*(corners_m - np.roll(corners_m, 1, axis=0)).T)
    kept = apart_m > TINY_M
    return corners_m[kept] if kept.any() else corners_m[:1]


def convex_parts(corners_m: Float[np.ndarray, "corners 2"]) -> list[Float[np.ndarray, "_ 2"]]:
    """Convex polygons that fill a simple counter-clockwise one; itself if it is convex."""
    todo, parts = [corners_m], []
    while todo:
        polygon = todo.pop()
        turns = _turns(polygon)
        sharpest = int(turns.argmin())
        if turns[sharpest] >= -_STRAIGHT:
            parts.append(polygon)
            continue
        polygon = np.roll(polygon, -sharpest, axis=0)
        end = _cut_from_first(polygon)
        todo += [polygon[: end + 1], np.concatenate([polygon[end:], polygon[:1]])]
    return parts


def _turns(corners_m: np.ndarray) -> Float[np.ndarray, " corners"]:
    """Sine of the turn at each corner, positive to the left."""
    after = np.roll(corners_m, -1, axis=0) - corners_m
    after /= np.hypot(*after.T)[:, None]
    return cross(np.roll(after, 1, axis=0), after)


def _cut_from_first(corners_m: np.ndarray) -> int:
    """Corner to cut to from corner 0, at which the polygon turns right.

    The shortest diagonal that leaves no right turn at corner 0, else the shortest; a corner that turns right
    always has one.
    """
    first, last, ends = corners_m[0], corners_m[-1], np.arange(2, len(corners_m) - 1)
    way = corners_m[ends] - first
    straightens = (cross(corners_m[1] - first, way) >= 0.0) & (cross(first - last, way) >= 0.0)
    rank = np.hypot(*way.T) + np.where(straightens, 0.0, np.ptp(corners_m, axis=0).sum())
    ends = ends[rank.argsort(kind="stable")]
    for first in range(0, len(ends), _FEW_DIAGONALS):  # nearly always among the shortest
        few = ends[first : first + _FEW_DIAGONALS]
        within = _are_diagonals(corners_m, few)
        if within.any():
            return int(few[within.argmax()])
    raise ValueError("a corner that turns right has a diagonal")


def _are_diagonals(corners_m: np.ndarray, ends: np.ndarray) -> Bool[np.ndarray, " ends"]:
    """Which straight ways from corner 0 to others run inside the polygon and meet it at their ends only."""
    ways = np.stack([np.broadcast_to(corners_m[0], (len(ends), 2)), corners_m[ends]], axis=1)
    away_m = distance_to_segments(corners_m, ways)
    away_m[0] = away_m[ends, np.arange(len(ends))] = np.inf
    free = away_m.min(axis=0) > TINY_M
    free &= ~crossings(ways[:, 0], ways[:, 1], polygon_edges(corners_m)).any(axis=1)
    return free & inside_polygon(ways.mean(axis=1), corners_m)
