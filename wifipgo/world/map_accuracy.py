r"""MapAccuracy share: the one score of a team.

A cell is *mapped* if the team saw it and its place in the team's map is within half a unit
of the truth.  Maps are fused as those of real robots are: every sighting puts the cell where
the pose from which it was seen is *now* believed to be, and the map has it at the mean of all
sightings of the team.  With :math:`T` a true pose, :math:`\hat T` its estimate and :math:`c`
the cell's middle, one sighting is off by :math:`\hat T T^{-1} c - c`; ranging is exact.

The mean rewards no luck: a cell that two sightings put on either side of a wide gap is not
mapped, although one of them may be right, and seeing a cell again when lost spoils it.
Robots cannot compute this, since it reads the truth; names of what is made of it end in ``_truth``.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from wifipgo import se2
from wifipgo.world.coverage import TOLERANCE_M, CellMap, Sightings, middles

Poses = Float[np.ndarray, "robots times 3"]


class MapAccuracy(NamedTuple):
    """The team's map beside the truth.

    Attributes:
        off_m: Sum over the sightings of each cell of how far they put it off.
        n_sightings: Of each cell.
        share: MapAccuracy share S, in [0, 1].
    """

    off_m: Float[np.ndarray, "squares 2"]
    n_sightings: Int[np.ndarray, " squares"]
    share: float


def first_map_accuracy(cells: CellMap, reference: Poses, estimate: Poses) -> MapAccuracy:
    """Map of all that was seen so far.

    Args:
        cells: Who saw what when.
        reference: True poses.
        estimate: The same as they are believed to be.
    """
    n = cells.seen.size
    seen = _seen_from(cells.sightings, np.ones(estimate.shape[:2], dtype=bool))
    off_m = _summed(_offsets(cells, reference, estimate, seen), seen, n)
    return _shared(off_m, np.bincount(seen.cell, minlength=n), cells)


def updated_map_accuracy(
    mapped: MapAccuracy,
    cells: CellMap,
    reference: Poses,
    before: Float[np.ndarray, "robots before 3"],
    after: Poses,
) -> MapAccuracy:
    """Map after an iteration: cells newly seen, and those seen from poses that moved in the estimate.

    Args:
        mapped: The map before it.
        cells: Who saw what when, the iteration included.
        reference: True poses, the newest included.
        before: The estimate before the iteration.
        after: And after it, one pose longer.
    """
    (robot, cell), time, n = cells.sightings[-1], before.shape[1], len(mapped.off_m)
    fresh = _Seen(robot, np.full(len(robot), time), cell)
    off_m = mapped.off_m + _summed(_offsets(cells, reference, after, fresh), fresh, n)
    changed = before != after[:, :time]
    if changed.any():
        again = _seen_from(cells.sightings, changed[..., 0] | changed[..., 1] | changed[..., 2])
        was, is_ = (_offsets(cells, reference, poses, again) for poses in (before, after))
        off_m += _summed(is_ - was, again, n)
    return _shared(off_m, mapped.n_sightings + np.bincount(cell, minlength=n), cells)


class _Seen(NamedTuple):
    """Sightings, one each row: who saw what from which of its poses."""

    robot: Int[np.ndarray, " n"]
    time: Int[np.ndarray, " n"]
    cell: Int[np.ndarray, " n"]


def _seen_from(sightings: Sequence[Sightings], poses: Bool[np.ndarray, "robots times"]) -> _Seen:
    """All sightings from some poses."""
    times = np.flatnonzero(poses.any(axis=0)).tolist()
    none = np.zeros(0, dtype=np.int64)
    robot = np.concatenate([none, *(sightings[t].robot for t in times)])
    cell = np.concatenate([none, *(sightings[t].cell for t in times)])
    time = np.repeat(np.array(times, dtype=np.int64), [len(sightings[t].robot) for t in times])
    kept = poses.take(robot * poses.shape[1] + time).nonzero()[0]
    return _Seen(robot.take(kept), time.take(kept), cell.take(kept))


def _summed(each_m: Float[np.ndarray, "n 2"], seen: _Seen, n_cells: int) -> Float[np.ndarray, "squares 2"]:
    """Sum over the sightings of each cell."""
    sums = np.empty((n_cells, 2))
    for axis in (0, 1):
        sums[:, axis] = np.bincount(seen.cell, each_m[:, axis], minlength=n_cells)
    return sums


def _offsets(
    cells: CellMap, reference: Poses, estimate: Float[np.ndarray, "robots known 3"], seen: _Seen
) -> Float[np.ndarray, "n 2"]:
    """How far each sighting puts its cell off: the estimate's motion of the true pose, at the cell."""
    middle_m = middles(len(cells.seen))[seen.cell]
    true, believed = (poses[seen.robot, seen.time] for poses in (reference, estimate))
    d_m = se2.rotate(believed[:, 2] - true[:, 2], middle_m - true[:, :2])
    return believed[:, :2] + d_m - middle_m


def _shared(
    off_m: Float[np.ndarray, "squares 2"], count: Int[np.ndarray, " squares"], cells: CellMap
) -> MapAccuracy:
    """The map with the share of the free cells that are mapped."""
    close = off_m[:, 0] ** 2 + off_m[:, 1] ** 2 <= (TOLERANCE_M * count) ** 2
    share = np.count_nonzero(close & (count > 0)) / np.count_nonzero(cells.free)
    return MapAccuracy(off_m, count, share)
