"""Points of a scene as the tracer takes them, or a refusal that says which is where it cannot be."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from wifipgo.errors import BadInputError
from wifipgo.radio.propagation.outline import Outline, off_limits
from wifipgo.radio.propagation.scenes import Scenes
from wifipgo.radio.propagation.surfaces import FARTHEST_M
from wifipgo.segments import distance_to_segments

SHORTEST_LINK_M = 1e-6
# A body that touches a face may overlap it by this much: what physics engines leave.
TOUCH_M = 1e-3
# Where such a body is put: in front of the face by more than rounding.
_CLEAR_M = 1e-9

Called = Callable[[int], tuple[str, str]]


class Points(NamedTuple):
    """Places where links can end, and how they lie to every line of their scene.

    Attributes:
        at_m: Coordinates.
        along_m: Position along every line.
        height_m: Height over every line.
        world: Scene of each.
    """

    at_m: Float[np.ndarray, "2 points"]
    along_m: Float[np.ndarray, "lines points"]
    height_m: Float[np.ndarray, "lines points"]
    world: Int[np.ndarray, " points"]

    def some(self, chosen: slice | Int[np.ndarray, " some"]) -> "Points":
        """Some of the points, in this order."""
        if isinstance(chosen, slice):
            return Points(*(column[..., chosen] for column in self))
        return Points(*(column.take(chosen, axis=-1) for column in self))


def checked_points(
    p_m: Float[np.ndarray, "points 2"], world: Int[np.ndarray, " points"], scenes: Scenes, called: Called
) -> Points:
    """Points as every line of their scene sees them.

    Each number is worked out for itself, so that it does not depend on what else is asked for.

    Args:
        p_m: Places, m.
        world: Scene of each.
        scenes: What stands where.
        called: Argument and place in it of a point, for messages.

    Raises:
        ValueError: If a coordinate is not finite, or a point is further than `TOUCH_M` inside an
            obstacle or outside the room.
    """
    within = np.abs(p_m) <= FARTHEST_M
    if not within.all():
        index = int(np.argmin(within.all(axis=1)))
        name, where = called(index)
        rule = f"finite and at most {FARTHEST_M:g}"
        raise BadInputError(f"{name} must be {rule}, got {p_m[index].tolist()} at {where}")
    at_m = np.array(p_m.T, dtype=float, order="C")
    coefficients = scenes.by_world(scenes.affine, world)
    along_m, height_m = _affine(coefficients, at_m)
    wrong = _misplaced(at_m, height_m, world, scenes)
    if wrong.any():
        _put_in_front(at_m, np.flatnonzero(wrong), world, scenes, called)
        along_m, height_m = _affine(coefficients, at_m)
    return Points(at_m, along_m, height_m, world)


def points_of(
    at_m: Float[np.ndarray, "2 points"], world: Int[np.ndarray, " points"], scenes: Scenes
) -> Points:
    """Points as every line of their scene sees them, wherever they are."""
    along_m, height_m = _affine(scenes.by_world(scenes.affine, world), at_m)
    return Points(at_m, along_m, height_m, world)


def check_apart(
    gap_m: Float[np.ndarray, "2 links"], tx_m: Float[np.ndarray, "2 links"], called: Called
) -> None:
    """Refuse links whose ends coincide.

    Args:
        gap_m: From one end of each link to the other.
        tx_m: The first end.
        called: Argument and place in it of a link, for messages.
    """
    apart = (np.abs(gap_m) > SHORTEST_LINK_M).any(axis=0)
    if not apart.all():
        index = int(np.argmin(apart))
        name, where = called(index)
        raise BadInputError(f"{name} must differ, both are {tx_m[:, index].tolist()} at {where}")


def _affine(
    coefficients: Float[np.ndarray, "3 2 lines #points"], at_m: Float[np.ndarray, "2 points"]
) -> Float[np.ndarray, "2 lines points"]:
    """Affine functions of places."""
    out = coefficients[0] * at_m[0]
    out += coefficients[1] * at_m[1]
    out += coefficients[2]
    return out


def _misplaced(
    at_m: Float[np.ndarray, "2 points"],
    height_m: Float[np.ndarray, "lines points"],
    world: Int[np.ndarray, " points"],
    scenes: Scenes,
) -> Bool[np.ndarray, " points"]:
    """Whether each point is inside an obstacle or outside the room."""
    first = scenes.n_walls + 1
    wrong: np.ndarray = np.less(height_m[1:first], 0.0).any(axis=0)
    if first < len(height_m):
        outline = Outline(*(scenes.by_world(column, world) for column in scenes.outline))
        wrong |= off_limits(at_m[1], height_m[first:], outline)
    return wrong


def _put_in_front(
    at_m: Float[np.ndarray, "2 points"],
    wrong: Int[np.ndarray, " wrong"],
    world: Int[np.ndarray, " points"],
    scenes: Scenes,
    called: Called,
) -> None:
    """Move, in place, points that barely overlap a face to its front; refuse those that are deeper."""
    points_m, world = at_m[:, wrong].T, world[wrong]
    depth_m = distance_to_segments(points_m, scenes.faces_of(world))
    nearest = depth_m.argmin(axis=1)
    deep = depth_m.min(axis=1) > TOUCH_M
    if deep.any():
        worst = int(np.argmax(deep))
        name, where = called(int(wrong[worst]))
        raise BadInputError(
            f"{name} must be inside the room and outside obstacles, got {points_m[worst].tolist()} at "
            f"{where}, {depth_m[worst].min():.3g} m from the nearest face"
        )
    at = scenes.at(nearest + 1, world)
    x, y, base = scenes.to_height.reshape(3, -1)[:, at]
    height_m = x * points_m[:, 0] + y * points_m[:, 1] + base
    at_m[:, wrong] += (_CLEAR_M - height_m) * np.stack([x, y])
