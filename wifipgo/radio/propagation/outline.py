"""Corners of the obstacles, and whether a point is where a robot can be."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from wifipgo.errors import require
from wifipgo.segments import cross


class Outline(NamedTuple):
    """Faces that can stand in the way, as edges between corners that they share, world by world.

    Where worlds have fewer, the rest are edges from a corner to itself, which nothing crosses.

    Attributes:
        corners_m: Every corner once, m.
        start: Corner at which each face begins.
        end: Corner at which each face ends.
        low_m: Lower end of each face in y, m.
        high_m: Upper end of each face in y, m.
        climb: 1 where a face goes up, -1 where it goes down, 0 where it is level.
        winding: How often the outline goes round a point in the open: -1 in a room, 0 among
            obstacles only.
        closed: Whether the outline is closed, so that it has an inside.
    """

    corners_m: Float[np.ndarray, "2 corners worlds"]
    start: Int[np.ndarray, "faces worlds"]
    end: Int[np.ndarray, "faces worlds"]
    low_m: Float[np.ndarray, "faces worlds"]
    high_m: Float[np.ndarray, "faces worlds"]
    climb: Int[np.ndarray, "faces worlds"]
    winding: Int[np.ndarray, " worlds"]
    closed: Bool[np.ndarray, " worlds"]

    @classmethod
    def stacked(cls, each: Sequence["Outline"]) -> "Outline":
        """Outlines of several worlds side by side."""
        return cls(*(_side_by_side(columns) for columns in zip(*each, strict=True)))


def _side_by_side(columns: Sequence[np.ndarray]) -> np.ndarray:
    """Arrays of different lengths with worlds last, padded with zeros."""
    if columns[0].ndim == 1:
        return np.concatenate(columns)
    length = max(column.shape[-2] for column in columns)
    out = np.zeros((*columns[0].shape[:-2], length, len(columns)), dtype=columns[0].dtype)
    for world, column in enumerate(columns):
        out[..., : column.shape[-2], world] = column[..., 0]
    return out


def outline_of(faces_m: Float[np.ndarray, "faces 2 2"]) -> Outline:
    """Work out the outline of faces with their front on the right, in one world."""
    corners_m, place = np.unique(faces_m.reshape(-1, 2), axis=0, return_inverse=True)
    start, end = place.reshape(-1, 2).T
    n = len(corners_m)
    closed = (np.bincount(start, minlength=n) == np.bincount(end, minlength=n)).all()
    y_m = faces_m[:, :, 1]
    round_a_room = cross(faces_m[:, 0], faces_m[:, 1]).sum() < 0.0
    return Outline(
        corners_m=corners_m.T[:, :, None],
        start=start[:, None],
        end=end[:, None],
        low_m=y_m.min(axis=1)[:, None],
        high_m=y_m.max(axis=1)[:, None],
        climb=((y_m[:, 1] > y_m[:, 0]).astype(np.int8) - (y_m[:, 1] < y_m[:, 0]))[:, None],
        winding=np.array([-1 if round_a_room else 0]),
        closed=np.array([closed]),
    )


def off_limits(
    y_m: Float[np.ndarray, " points"], height_m: Float[np.ndarray, "faces points"], outline: Outline
) -> Bool[np.ndarray, " points"]:
    """Whether each point is inside an obstacle or outside the outline of a room, by its winding number.

    Args:
        y_m: Second coordinate of the points, m.
        height_m: Height of the points over every face of the outline, m.
        outline: The faces, of one world for all points or a world for each.

    Returns:
        False everywhere if the outline is not closed.
    """
    met = (y_m >= outline.low_m) & (y_m < outline.high_m)  # by a ray in the direction of x
    met &= (height_m < 0.0) == (outline.climb > 0)
    winding = (outline.climb * met).sum(axis=0)
    return (winding != outline.winding) & outline.closed


def is_convex(walls_m: Float[np.ndarray, "walls 2 2"]) -> bool:
    """Whether every wall has all the others on one side of its line, to a micrometre."""
    edge_m = (walls_m[:, 1] - walls_m[:, 0])[:, None]
    area_m2 = cross(edge_m, walls_m.reshape(1, -1, 2) - walls_m[:, :1])
    slack_m2 = 1e-6 * np.linalg.norm(edge_m, axis=-1)
    on_one_side = (area_m2 >= -slack_m2).all(axis=1) | (area_m2 <= slack_m2).all(axis=1)
    return bool(on_one_side.all())


def facing_inwards(walls_m: Float[np.ndarray, "walls 2 2"]) -> Float[np.ndarray, "walls 2 2"]:
    """Walls of a closed room of any shape, each turned so that the room is on its right.

    Raises:
        ValueError: If the walls do not close, so that there is no inside.
    """
    edge_m = walls_m[:, 1] - walls_m[:, 0]
    beside_m = walls_m.mean(axis=1) + 1e-6 * np.stack([edge_m[:, 1], -edge_m[:, 0]], axis=-1)
    x_m, y_m = beside_m.T[:, :, None]
    (x0_m, y0_m), (x1_m, y1_m) = walls_m[:, 0].T, walls_m[:, 1].T
    spans = (y0_m > y_m) != (y1_m > y_m)
    rise_m = np.where(y1_m == y0_m, 1.0, y1_m - y0_m)
    to_the_right = x0_m + (y_m - y0_m) * (x1_m - x0_m) / rise_m > x_m
    inside = np.count_nonzero(spans & to_the_right, axis=1) % 2 == 1
    turned_m = np.where(inside[:, None, None], walls_m, walls_m[:, ::-1])
    outline = outline_of(turned_m)
    is_room = bool(outline.closed[0]) and int(outline.winding[0]) == -1
    require(is_room, "walls_m", "a convex room or a closed outline", walls_m.tolist())
    return turned_m
