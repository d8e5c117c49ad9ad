"""Both ends of every link as the tracer takes them, or a refusal that says which is where it cannot be."""

import numpy as np
from jaxtyping import Bool, Float

from wifipgo.errors import BadInputError
from wifipgo.radio.propagation.outline import off_limits
from wifipgo.radio.propagation.surfaces import FARTHEST_M, Surfaces
from wifipgo.segments import distance_to_segments

SHORTEST_LINK_M = 1e-6
# A body that touches a face may overlap it by this much: what physics engines leave.
TOUCH_M = 1e-3
# Where such a body is put: in front of the face by more than rounding.
_CLEAR_M = 1e-9
_NAMES = ("tx_m", "rx_m")


def checked_ends(
    tx_m: Float[np.ndarray, "links 2"], rx_m: Float[np.ndarray, "links 2"], surfaces: Surfaces
) -> tuple[Float[np.ndarray, "2 3 links"], Float[np.ndarray, "2 lines links"]]:
    """Ends of every link as columns ``(x, y, 1)``, and their heights over every line of the scene, m.

    Raises:
        ValueError: If a coordinate is not finite, a link has no length, or a point is further
            than `TOUCH_M` inside an obstacle or outside the room.
    """
    ends = np.ones((2, 3, len(tx_m)))
    ends[0, :2], ends[1, :2] = tx_m.T, rx_m.T
    _check_links(ends)
    height_m = surfaces.to_height @ ends
    wrong = _misplaced(ends, height_m, surfaces)
    if wrong.any():
        _put_in_front(ends, wrong, surfaces)
        height_m = surfaces.to_height @ ends
    return ends, height_m


def _check_links(ends: Float[np.ndarray, "2 3 links"]) -> None:
    """Refuse ends that are not finite or coincide."""
    far = np.logical_not(np.abs(ends) <= FARTHEST_M)
    if far.any():
        end, index = np.argwhere(far.any(axis=1))[0]
        rule, got = f"finite and at most {FARTHEST_M:g}", ends[end, :2, index].tolist()
        raise BadInputError(f"{_NAMES[end]} must be {rule}, got {got} at link {index}")
    apart = (np.abs(ends[0] - ends[1]) > SHORTEST_LINK_M).any(axis=0)
    if not apart.all():
        index = np.argmin(apart)
        raise BadInputError(
            f"tx_m and rx_m must differ, both are {ends[0, :2, index].tolist()} at link {index}"
        )


def _misplaced(
    ends: Float[np.ndarray, "2 3 links"], height_m: Float[np.ndarray, "2 lines links"], surfaces: Surfaces
) -> Bool[np.ndarray, "2 links"]:
    """Whether each end is inside an obstacle or outside the room."""
    first = surfaces.n_walls + 1
    wrong: np.ndarray = np.less(height_m[:, 1:first], 0.0).any(axis=1)
    if first < height_m.shape[1]:
        wrong |= off_limits(ends[:, 1], height_m[:, first:], surfaces.outline)
    return wrong


def _put_in_front(
    ends: Float[np.ndarray, "2 3 links"], wrong: Bool[np.ndarray, "2 links"], surfaces: Surfaces
) -> None:
    """Move, in place, ends that barely overlap a face to its front; refuse those that are deeper."""
    side, link = np.nonzero(wrong)
    points_m = ends[side, :2, link]
    depth_m = distance_to_segments(points_m, surfaces.ends_m)
    nearest = depth_m.argmin(axis=1)
    deep = depth_m.min(axis=1) > TOUCH_M
    if deep.any():
        worst = np.argmax(deep)
        raise BadInputError(
            f"{_NAMES[side[worst]]} must be inside the room and outside obstacles, got "
            f"{points_m[worst].tolist()} at link {link[worst]}, "
            f"{depth_m[worst].min():.3g} m from the nearest face"
        )
    to_height = surfaces.to_height[nearest + 1]
    height_m = (to_height[:, :2] * points_m).sum(axis=1) + to_height[:, 2]
    ends[side, :2, link] += (_CLEAR_M - height_m)[:, None] * to_height[:, :2]
