r"""Mapped share: the one score of a team.

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

from wifipgo.state import Tick
from wifipgo.world.coverage import TOLERANCE_M, Sightings, middles


class Mapped(NamedTuple):
    """The team's map beside the truth.

    Attributes:
        off_m: Sum over the sightings of each cell of how far they put it off.
        n_sightings: Of each cell.
        share: Mapped share S, in [0, 1].
    """

    off_m: Float[np.ndarray, "squares 2"]
    n_sightings: Int[np.ndarray, " squares"]
    share: float


def first_map(tick: Tick) -> Mapped:
    """Map of all that was seen so far."""
    n = tick.truth.cells.seen.size
    everything = np.ones(tick.belief.estimate.shape[:2], dtype=bool)
    return _shared(*_added(np.zeros((n, 2)), np.zeros(n, dtype=np.int64), tick, everything), tick)


def updated_map(mapped: Mapped, before: Tick, after: Tick) -> Mapped:
    """Map after an iteration: cells newly seen, and those seen from poses that moved in the estimate."""
    old, new = before.belief.estimate, after.belief.estimate
    fresh = np.ones(new.shape[:2], dtype=bool)
    moved = (old != new[:, : old.shape[1]]).any(axis=-1)
    fresh[:, : old.shape[1]] = moved
    off_m, count = mapped.off_m, mapped.n_sightings
    if moved.any():
        off_m, count = _added(off_m, count, before, moved, sign=-1)
    return _shared(*_added(off_m, count, after, fresh), after)


def _added(
    off_m: Float[np.ndarray, "squares 2"],
    count: Int[np.ndarray, " squares"],
    tick: Tick,
    poses: Bool[np.ndarray, "robots times"],
    *,
    sign: int = 1,
) -> tuple[Float[np.ndarray, "squares 2"], Int[np.ndarray, " squares"]]:
    """Add to the sums, or take away, what was seen from some poses."""
    cells = tick.truth.cells
    robot, time, cell = _seen_from(cells.sightings, poses)
    each_m = _offsets(tick, robot, time, middles(len(cells.seen))[cell])
    sums = np.empty_like(off_m)
    for axis in (0, 1):
        sums[:, axis] = np.bincount(cell, each_m[:, axis], minlength=len(sums))
    return off_m + sign * sums, count + sign * np.bincount(cell, minlength=len(sums))


def _seen_from(
    sightings: Sequence[Sightings], poses: Bool[np.ndarray, "robots times"]
) -> tuple[Int[np.ndarray, " n"], Int[np.ndarray, " n"], Int[np.ndarray, " n"]]:
    """Robot, time and cell of all sightings from some poses."""
    times = np.flatnonzero(poses.any(axis=0)).tolist()
    none = np.zeros(0, dtype=np.int64)
    robot = np.concatenate([none, *(sightings[t].robot for t in times)])
    cell = np.concatenate([none, *(sightings[t].cell for t in times)])
    time = np.repeat(times, [len(sightings[t].robot) for t in times]).astype(np.int64)
    kept = poses[robot, time]
    return robot[kept], time[kept], cell[kept]


def _offsets(
    tick: Tick,
    robot: Int[np.ndarray, " n"],
    time: Int[np.ndarray, " n"],
    middle_m: Float[np.ndarray, "n 2"],
) -> Float[np.ndarray, "n 2"]:
    """How far each sighting puts its cell off: the estimate's motion of the true pose, at the cell."""
    true, believed = tick.truth.poses[robot, time], tick.belief.estimate[robot, time]
    turn_rad = believed[:, 2] - true[:, 2]
    c, s = np.cos(turn_rad), np.sin(turn_rad)
    x_m, y_m = (middle_m - true[:, :2]).T
    return believed[:, :2] + np.stack([c * x_m - s * y_m, s * x_m + c * y_m], axis=1) - middle_m


def _shared(off_m: Float[np.ndarray, "squares 2"], count: Int[np.ndarray, " squares"], tick: Tick) -> Mapped:
    """The map with the share of the free cells that are mapped."""
    close = off_m[:, 0] ** 2 + off_m[:, 1] ** 2 <= (TOLERANCE_M * count) ** 2
    share = (close & (count > 0)).sum() / tick.truth.cells.free.sum()
    return Mapped(off_m, count, float(share))
