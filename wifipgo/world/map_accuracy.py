r"""MapAccuracy share: the one score of a team.

A cell is *mapped* if the team saw it and its place in the team's map is within half a unit
of the truth.  Maps are fused as those of real robots are: every sighting puts the cell where
the pose from which it was seen is *now* believed to be, and the map has it at the mean of all
sightings of the team.  With :math:`T` a true pose, :math:`\hat T` its estimate and :math:`c`
the cell's middle, one sighting is off by :math:`\hat T T^{-1} c - c`; ranging is exact.

The mean rewards no luck: a cell that two sightings put on either side of a wide gap is not
mapped, although one of them may be right, and seeing a cell again when lost spoils it.
Robots cannot compute this, since it reads the truth; names of what is made of it end in ``_truth``.

All worlds of a batch are kept side by side; a sum over the sightings of a cell is of its own world.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from wifipgo import se2
from wifipgo.world.coverage import TOLERANCE_M, CellMap, Sightings, counted, middles

Poses = Float[np.ndarray, "rows times 3"]


class MapAccuracy(NamedTuple):
    """The team's map beside the truth, world by world.

    Attributes:
        off_m: Sum over the sightings of each cell of how far they put it off.
        n_sightings: Of each cell.
        share: MapAccuracy share S, in [0, 1].
    """

    off_m: Float[np.ndarray, "worlds squares 2"]
    n_sightings: Int[np.ndarray, "worlds squares"]
    share: Float[np.ndarray, " worlds"]


def first_map_accuracy(cells: CellMap, reference: Poses, estimate: Poses) -> MapAccuracy:
    """Map of all that was seen so far.

    Args:
        cells: Who saw what when.
        reference: True poses.
        estimate: The same as they are believed to be.
    """
    seen = _seen_from(cells.sightings, np.ones(estimate.shape[:2], dtype=bool))
    place = _places(seen.row, seen.cell, cells, len(reference))
    off_m = _summed(_offsets(cells, reference, estimate, seen), place, cells)
    return _shared(off_m, _counted(place, cells), cells)


def updated_map_accuracy(
    mapped: MapAccuracy,
    cells: CellMap,
    reference: Poses,
    before: Float[np.ndarray, "rows before 3"],
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
    (row, cell), time, n_rows = cells.sightings[-1], before.shape[1], len(reference)
    fresh, place = _Seen(row, np.full(len(row), time), cell), _places(row, cell, cells, n_rows)
    off_m = mapped.off_m + _summed(_offsets(cells, reference, after, fresh), place, cells)
    changed = before != after[:, :time]
    if changed.any():
        again = _seen_from(cells.sightings, changed[..., 0] | changed[..., 1] | changed[..., 2])
        was, is_ = (_offsets(cells, reference, poses, again) for poses in (before, after))
        off_m += _summed(is_ - was, _places(again.row, again.cell, cells, n_rows), cells)
    return _shared(off_m, mapped.n_sightings + _counted(place, cells), cells)


class _Seen(NamedTuple):
    """Sightings, one each row: who saw what from which of its poses."""

    row: Int[np.ndarray, " n"]
    time: Int[np.ndarray, " n"]
    cell: Int[np.ndarray, " n"]


def _seen_from(sightings: Sequence[Sightings], poses: Bool[np.ndarray, "rows times"]) -> _Seen:
    """All sightings from some poses."""
    times = np.flatnonzero(poses.any(axis=0)).tolist()
    none = np.zeros(0, dtype=np.int64)
    row = np.concatenate([none, *(sightings[t].row for t in times)])
    cell = np.concatenate([none, *(sightings[t].cell for t in times)])
    time = np.repeat(np.array(times, dtype=np.int64), [len(sightings[t].row) for t in times])
    kept = poses.take(row * poses.shape[1] + time).nonzero()[0]
    return _Seen(row.take(kept), time.take(kept), cell.take(kept))


def _places(
    row: Int[np.ndarray, " n"], cell: Int[np.ndarray, " n"], cells: CellMap, n_rows: int
) -> Int[np.ndarray, " n"]:
    """Number of each cell among those of all worlds."""
    n_worlds = len(cells.free)
    return row // (n_rows // n_worlds) * (cells.free.size // n_worlds) + cell


def _summed(
    each_m: Float[np.ndarray, "n 2"], place: Int[np.ndarray, " n"], cells: CellMap
) -> Float[np.ndarray, "worlds squares 2"]:
    """Sum over the sightings of each cell."""
    sums = np.empty((cells.free.size, 2))
    for axis in (0, 1):
        sums[:, axis] = np.bincount(place, each_m[:, axis], minlength=len(sums))
    return sums.reshape(len(cells.free), -1, 2)


def _counted(place: Int[np.ndarray, " n"], cells: CellMap) -> Int[np.ndarray, "worlds squares"]:
    """How often each cell was seen."""
    return np.bincount(place, minlength=cells.free.size).reshape(len(cells.free), -1)


def _offsets(
    cells: CellMap, reference: Poses, estimate: Float[np.ndarray, "rows known 3"], seen: _Seen
) -> Float[np.ndarray, "n 2"]:
    """How far each sighting puts its cell off: the estimate's motion of the true pose, at the cell."""
    middle_m = middles(cells.seen.shape[1])[seen.cell]
    true, believed = (poses[seen.row, seen.time] for poses in (reference, estimate))
    d_m = se2.rotate(believed[:, 2] - true[:, 2], middle_m - true[:, :2])
    return believed[:, :2] + d_m - middle_m


def _shared(
    off_m: Float[np.ndarray, "worlds squares 2"], count: Int[np.ndarray, "worlds squares"], cells: CellMap
) -> MapAccuracy:
    """The map with the share of the free cells that are mapped."""
    x_m, y_m, most_m = off_m[..., 0], off_m[..., 1], TOLERANCE_M * count
    close = x_m * x_m + y_m * y_m <= most_m * most_m
    return MapAccuracy(off_m, count, counted(close & (count > 0)) / cells.n_free)
