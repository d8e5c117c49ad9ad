"""Which cells of the room the team has seen, and who saw them when."""

import functools
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from wifipgo import segments
from wifipgo.errors import require
from wifipgo.se2 import length
from wifipgo.world.layout import Layout
from wifipgo.world.polygons import inside_polygon, squares_about

CELL_M = 1.0
# A place counts as mapped if the map has it this close to the truth.
TOLERANCE_M = 0.5


class Sightings(NamedTuple):
    """Cells seen in one iteration: row k is that ``robot[k]`` saw the middle of ``cell[k]``."""

    robot: Int[np.ndarray, " sightings"]
    cell: Int[np.ndarray, " sightings"]


class CellMap(NamedTuple):
    """Square cells over the room.

    Attributes:
        free: Whether nothing stands on a cell's middle.
        seen: Whether somebody saw it; cells are numbered as ``seen.ravel()`` lies.
        sightings: Who saw what, one entry for each iteration.
    """

    free: Bool[np.ndarray, "cells cells"]
    seen: Bool[np.ndarray, "cells cells"]
    sightings: tuple[Sightings, ...] = ()

    @property
    def share(self) -> float:
        """Share of the free cells that were seen, in [0, 1]."""
        return np.count_nonzero(self.free & self.seen) / np.count_nonzero(self.free)


@functools.lru_cache(maxsize=8)
def middles(n_cells: int) -> Float[np.ndarray, "squares 2"]:
    """Middle of every cell of a room that is ``n_cells`` wide, by number, m."""
    steps = CELL_M * (np.arange(n_cells) + 0.5)
    middle_m = np.stack(np.meshgrid(steps, steps, indexing="ij"), -1).reshape(-1, 2)
    middle_m.setflags(write=False)
    return middle_m


def empty_map(layout: Layout, size_m: float) -> CellMap:
    """Cells of a room in which nothing was seen yet.

    Raises:
        ValueError: No cell is free, so that there is no share of them to see.
    """
    n = int(np.ceil(size_m / CELL_M))
    blocked, middle_m = np.zeros((n, n), dtype=bool), middles(n).reshape(n, n, 2)
    for corners in layout.obstacles_m:
        about = squares_about(corners, CELL_M, n)
        near_m = middle_m[about]
        blocked[about] |= inside_polygon(near_m.reshape(-1, 2), corners).reshape(near_m.shape[:2])
    rule = f"such that the middle of a cell of {CELL_M:g} m is free"
    require(not blocked.all(), "ArenaConfig.obstacles_m", rule, len(layout.obstacles_m))
    return CellMap(~blocked, np.zeros((n, n), dtype=bool))


@functools.cache
def window(reach: int) -> Int[np.ndarray, "cells 2"]:
    """Offsets of the cells around one, which is in their middle."""
    steps = np.arange(-reach, reach + 1)
    return np.stack(np.meshgrid(steps, steps, indexing="ij"), -1).reshape(-1, 2)


def inside(index: Int[np.ndarray, "... 2"], n_cells: int) -> Bool[np.ndarray, "..."]:
    """Which cells are in a room of so many each way."""
    within = index.view(np.uint64) < n_cells  # less than 0 is a large number then
    return within[..., 0] & within[..., 1]


def reveal(
    cells: CellMap,
    p_m: Float[np.ndarray, "robots 2"],
    faces_m: Float[np.ndarray, "faces 2 2"],
    *,
    range_m: float,
) -> CellMap:
    """See the free cells whose middle is within range of a robot, with nothing in between."""
    n = len(cells.seen)
    reach = int(min(np.ceil(range_m / CELL_M), n))  # further there are no cells
    index = np.floor(p_m / CELL_M).astype(np.int64)[:, None] + window(reach)
    near = length(CELL_M * (index + 0.5) - p_m[:, None]) <= range_m
    robot, place = np.nonzero(near & inside(index, n))
    x, y = index[robot, place].T
    cell = x * n + y
    clear = cells.free.ravel()[cell].nonzero()[0]
    robot, cell = robot[clear], cell[clear]
    if len(faces_m):
        clear = _in_sight(p_m, robot, middles(n)[cell], faces_m, range_m)
        robot, cell = robot[clear], cell[clear]
    seen = cells.seen.copy()
    seen.reshape(-1)[cell] = True
    return CellMap(cells.free, seen, (*cells.sightings, Sightings(robot, cell)))


def _in_sight(
    p_m: Float[np.ndarray, "robots 2"],
    robot: Int[np.ndarray, " sightings"],
    goal_m: Float[np.ndarray, "sightings 2"],
    faces_m: Float[np.ndarray, "faces 2 2"],
    range_m: float,
) -> Bool[np.ndarray, " sightings"]:
    """Whether nothing hides a point from its robot; only faces within range of a robot are tried."""
    clear = np.ones(len(robot), dtype=bool)
    near = segments.distance_to_segments(p_m, faces_m) <= range_m
    tried = np.flatnonzero(np.any(near, axis=1)[robot])
    faces_m = faces_m[np.any(near, axis=0)]
    clear[tried] = segments.in_sight(p_m[robot[tried]], goal_m[tried], faces_m)
    return clear
