"""Pieces of a recorded run: some robots from one time to another, as a run of its own."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float, Int

from wifipgo import se2
from wifipgo.datasets.team_run import Landmarks, TeamRun
from wifipgo.errors import require
from wifipgo.graph.bearings import Bearings
from wifipgo.graph.edges import Edges
from wifipgo.graph.ranges import Ranges


def cut_run(run: TeamRun, first: int, last: int, *, robots: Sequence[int] | None = None) -> TeamRun:
    """Cut a piece out of a run, which begins at the true poses (at zero where these are not known).

    Args:
        run: The whole.
        first: Index of its first pose in the piece.
        last: Index of its last pose in the piece.
        robots: Rows of the robots to keep, ascending; all if left out. Sightings of others are left out.

    Returns:
        The piece, with poses from 0 and robots from row 0 on; noise and counts are those of the whole.

    Raises:
        BadInputError: There are no such poses or robots.
    """
    n_robots, times = run.start.shape[:2]
    require(0 <= first < last < times, "first and last", f"ascending, in 0..{times - 1}", (first, last))
    rows = list(range(n_robots)) if robots is None else list(robots)
    known = len(rows) > 0 and rows == sorted(set(rows)) and rows[0] >= 0 and rows[-1] < n_robots
    require(known, "robots", f"rows in 0..{n_robots - 1}, ascending", robots)
    piece = _Piece(rows, n_robots, first, last)
    odometry = piece.edges(run.odometry)
    truth = run.truth[rows, first : last + 1]
    return run._replace(
        robots=tuple(run.robots[row] for row in rows),
        time_s=run.time_s[first : last + 1],
        truth=truth,
        start=_moved(run.start[rows, first : last + 1], truth[:, 0]),
        odometry=odometry,
        bearings=piece.bearings(run.bearings),
        ranges=piece.ranges(run.ranges),
        landmarks=piece.landmarks(run.landmarks),
    )


def _moved(
    start: Float[np.ndarray, "robots times 3"], first: Float[np.ndarray, "robots 3"]
) -> Float[np.ndarray, "robots times 3"]:
    """Dead reckoning from other first poses."""
    begin = np.where(np.isfinite(first), first, 0.0)[:, None]
    moved: np.ndarray = se2.compose(np.broadcast_to(begin, start.shape), se2.between(start[:, :1], start))
    return moved


class _Piece:
    """Which ends of measurements are in a piece, and what they are called there."""

    def __init__(self, rows: list[int], n_robots: int, first: int, last: int) -> None:
        """Keep the new row of each robot, -1 of those left out."""
        self.row = np.full(n_robots, -1)
        self.row[rows] = np.arange(len(rows))
        self.first, self.last = first, last

    def has(self, *ends: Int[np.ndarray, "n 2"]) -> Bool[np.ndarray, " n"]:
        """Whether all ends are in it."""
        inside = [
            (self.row[end[:, 0]] >= 0) & (end[:, 1] >= self.first) & (end[:, 1] <= self.last) for end in ends
        ]
        return np.logical_and.reduce(inside)

    def of(self, end: Int[np.ndarray, "n 2"]) -> Int[np.ndarray, "n 2"]:
        """Ends as they are called in it."""
        return np.stack([self.row[end[:, 0]], end[:, 1] - self.first], axis=1)

    def edges(self, whole: Edges) -> Edges:
        """Steps in it."""
        at = self.has(whole.tail, whole.head)
        return Edges.measured(
            tail=self.of(whole.tail[at]),
            head=self.of(whole.head[at]),
            z=whole.z[at],
            sigma=whole.sigma[at],
        )

    def bearings(self, whole: Bearings) -> Bearings:
        """Directions in it."""
        at = self.has(whole.observer, whole.target)
        return Bearings.measured(
            observer=self.of(whole.observer[at]),
            target=self.of(whole.target[at]),
            azimuth_rad=whole.azimuth_rad[at],
            sigma_rad=whole.sigma_rad[at],
        )

    def ranges(self, whole: Ranges) -> Ranges:
        """Distances in it."""
        at = self.has(whole.observer, whole.target)
        return Ranges.measured(
            observer=self.of(whole.observer[at]),
            target=self.of(whole.target[at]),
            range_m=whole.range_m[at],
            sigma_m=whole.sigma_m[at],
        )

    def landmarks(self, whole: Landmarks) -> Landmarks:
        """Landmarks, and the sightings of them in it."""
        at = self.has(whole.observer)
        return whole._replace(
            observer=self.of(whole.observer[at]),
            seen=whole.seen[at],
            range_m=whole.range_m[at],
            azimuth_rad=whole.azimuth_rad[at],
        )
