"""Which boxes along the axes meet, world by world: the few pairs of things that are worth measuring."""

import numpy as np
from jaxtyping import Float, Int

# Worlds of at most so many things look at all pairs, which costs less there than sorting.
_FEW = 100
# Boxes are looked for this much further, so that no rounding decides which are tried.
_SLACK_M = 1e-6

Pairs = tuple[Int[np.ndarray, " pairs"], Int[np.ndarray, " pairs"]]


def bounds(
    segments_m: Float[np.ndarray, "*n segments 2 2"],
) -> tuple[Float[np.ndarray, "*n segments 2"], Float[np.ndarray, "*n segments 2"]]:
    """Lower and upper corner of the box about each segment."""
    a_m, b_m = segments_m[..., 0, :], segments_m[..., 1, :]
    return np.minimum(a_m, b_m), np.maximum(a_m, b_m)


def meeting(
    low_m: Float[np.ndarray, "rows 2"],
    high_m: Float[np.ndarray, "rows 2"],
    boxes_m: tuple[Float[np.ndarray, "worlds boxes 2"], Float[np.ndarray, "worlds boxes 2"]],
    world: Int[np.ndarray, " rows"],
) -> Pairs:
    """Pairs of a row's box and a box of its world that overlap or touch, by row.

    Args:
        low_m: Lower corner of each row's box.
        high_m: Upper corner.
        boxes_m: Lower and upper corners of each world's boxes.
        world: World of each row.
    """
    if boxes_m[0].shape[1] <= _FEW:
        return _among_all(low_m, high_m, boxes_m, world)
    return _by_sweep(low_m, high_m, boxes_m, world)


def _among_all(
    low_m: np.ndarray, high_m: np.ndarray, boxes_m: tuple[np.ndarray, np.ndarray], world: np.ndarray
) -> Pairs:
    """Compare all pairs."""
    own_low_m, own_high_m = (x[0] if len(x) == 1 else x[world] for x in boxes_m)
    meet = (low_m[:, None] <= own_high_m) & (high_m[:, None] >= own_low_m)
    row, box = (meet[..., 0] & meet[..., 1]).nonzero()
    return row, box


def _by_sweep(
    low_m: np.ndarray, high_m: np.ndarray, boxes_m: tuple[np.ndarray, np.ndarray], world: np.ndarray
) -> Pairs:
    """Compare with those whose left side is in the stretch in which that of a box that meets must be.

    The stretch is as long as the widest box, so boxes of very different widths, as walls, go separately.
    """
    own_low_m, own_high_m = (x.reshape(-1, 2) for x in boxes_m)
    if not len(low_m):
        return world[:0], world[:0]
    n, width_m = boxes_m[0].shape[1], own_high_m[:, 0] - own_low_m[:, 0]
    usual_m = np.median(width_m) + _SLACK_M
    kind = np.ceil(np.log(np.maximum(width_m / usual_m, 1.0)) / np.log(4.0))
    rows, boxes = [], []
    for each in np.unique(kind):
        some = (kind == each).nonzero()[0]
        sides_m = low_m[:, 0], high_m[:, 0], own_low_m[some, 0], own_high_m[some, 0]
        row, place = _candidates(*sides_m, (world, some // n))
        box = some[place]
        meet = (low_m[row] <= own_high_m[box]) & (high_m[row] >= own_low_m[box])
        kept = (meet[:, 0] & meet[:, 1] & (box // n == world[row])).nonzero()[0]
        rows.append(row[kept])
        boxes.append(box[kept] % n)
    row, box = np.concatenate(rows), np.concatenate(boxes)
    order = np.argsort(row, kind="stable")
    return row[order], box[order]


def _candidates(
    low_m: Float[np.ndarray, " rows"],
    high_m: Float[np.ndarray, " rows"],
    left_m: Float[np.ndarray, " boxes"],
    right_m: Float[np.ndarray, " boxes"],
    worlds: tuple[Int[np.ndarray, " rows"], Int[np.ndarray, " boxes"]],
) -> Pairs:
    """Pairs whose stretches along one axis may meet; worlds are laid out one behind the other."""
    widest_m = float((right_m - left_m).max()) + _SLACK_M
    least_m, most_m = low_m.min() - 2.0 * widest_m, high_m.max() + widest_m  # beyond, all are alike
    left_m, room_m = np.minimum(np.maximum(left_m, least_m), most_m), most_m - least_m + 2.0 * widest_m
    at_m = left_m + room_m * worlds[1]
    order = np.argsort(at_m)
    first = np.searchsorted(at_m[order], low_m + room_m * worlds[0] - widest_m)
    count = np.searchsorted(at_m[order], high_m + room_m * worlds[0] + _SLACK_M) - first
    row = np.repeat(np.arange(len(low_m)), count)
    return row, order[np.arange(len(row)) + np.repeat(first - (np.cumsum(count) - count), count)]
