"""What obstacles hide: rays of many worlds against the edges near them."""

import numpy as np
from jaxtyping import Bool, Float, Int

from wifipgo import segments
from wifipgo.world.boxes import bounds, meeting
from wifipgo.world.layout import FAR_FACE_M

# So far about a ray edges are tried, so that rounding has no say in which.
_ABOUT_M = 1e-6


def in_sight(
    start_m: Float[np.ndarray, "rays 2"],
    end_m: Float[np.ndarray, "rays 2"],
    faces_m: Float[np.ndarray, "worlds faces 2 2"],
    world: Int[np.ndarray, " rays"],
) -> Bool[np.ndarray, " rays"]:
    """Whether no edge of its world is between the two ends of each ray."""
    clear = np.ones(len(start_m), dtype=bool)
    low_m, high_m = np.minimum(start_m, end_m) - _ABOUT_M, np.maximum(start_m, end_m) + _ABOUT_M
    ray, face = meeting(low_m, high_m, bounds(faces_m), world)
    if len(ray):
        hit = segments.crossings(start_m[ray], end_m[ray], faces_m[world[ray], face][:, None])
        clear[ray[hit[:, 0]]] = False
    return clear


def in_sight_from(
    p_m: Float[np.ndarray, "rows 2"],
    row: Int[np.ndarray, " rays"],
    end_m: Float[np.ndarray, "rays 2"],
    faces_m: Float[np.ndarray, "worlds faces 2 2"],
    range_m: float,
) -> Bool[np.ndarray, " rays"]:
    """The same for many rays, none longer than a range, from each of a few points.

    Args:
        p_m: The points, world after world.
        row: Which of them each ray starts from.
        end_m: Where it ends.
        faces_m: Edges of obstacles of each world.
        range_m: Edges beyond it are not tried.
    """
    clear, world = np.ones(len(row), dtype=bool), np.arange(len(p_m)) // (len(p_m) // len(faces_m))
    reach_m = range_m + _ABOUT_M
    from_row, face = meeting(p_m - reach_m, p_m + reach_m, bounds(faces_m), world)
    count = np.bincount(from_row, minlength=len(p_m))
    tried = count[row].nonzero()[0]
    if len(tried):
        near_m = np.empty((len(p_m), count.max(), 2, 2))
        near_m[...] = FAR_FACE_M
        place = np.arange(len(from_row)) - (np.cumsum(count) - count)[from_row]
        near_m[from_row, place] = faces_m[world[from_row], face]
        asked = row[tried]
        clear[tried] = segments.in_sight(p_m[asked], end_m[tried], near_m[asked])
    return clear
