"""Which cells of the room the team has seen, and who saw them when."""

import functools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from wifipgo.errors import require
from wifipgo.se2 import length
from wifipgo.world.layout import Layout
from wifipgo.world.line_of_sight import in_sight_from
from wifipgo.world.polygons import inside_polygon, squares_about

CELL_M = 1.0
# A place counts as mapped if the map has it this close to the truth.
TOLERANCE_M = 0.5


class Sightings(NamedTuple):
    """Cells seen in one iteration: the robot of ``row[k]`` saw the middle of ``cell[k]`` of its world."""

    row: Int[np.ndarray, " sightings"]
    cell: Int[np.ndarray, " sightings"]


class CellMap(NamedTuple):
    """Square cells over the rooms of several worlds.

    Attributes:
        free: Whether nothing stands on a cell's middle.
        seen: Whether somebody saw it; the cells of a world are numbered as they lie.
        sightings: Who saw what, one entry for each iteration.
    """

    free: Bool[np.ndarray, "worlds cells cells"]
    seen: Bool[np.ndarray, "worlds cells cells"]
    sightings: tuple[Sightings, ...] = ()

    @property
    def n_free(self) -> Int[np.ndarray, " worlds"]:
        """Free cells."""
        return counted(self.free)

    @property
    def share(self) -> Float[np.ndarray, " worlds"]:
        """Share of the free cells that were seen, in [0, 1]."""
        return counted(self.free & self.seen) / self.n_free


def counted(which: Bool[np.ndarray, "worlds ..."]) -> Int[np.ndarray, " worlds"]:
    """How many of each world, several times faster than `np.count_nonzero` along axes."""
    n: np.ndarray = which.reshape(len(which), -1).sum(axis=1)
    return n


@functools.lru_cache(maxsize=8)
def middles(n_cells: int) -> Float[np.ndarray, "squares 2"]:
    """Middle of every cell of a room that is ``n_cells`` wide, by number, m."""
    steps = CELL_M * (np.arange(n_cells) + 0.5)
    middle_m = np.stack(np.meshgrid(steps, steps, indexing="ij"), -1).reshape(-1, 2)
    middle_m.setflags(write=False)
    return middle_m


def empty_map(layouts: Sequence[Layout], size_m: float) -> CellMap:
    """Cells of rooms, one a world, in which nothing was seen yet.

    Raises:
        ValueError: No cell is free, so that there is no share of them to see.
    """
    free = np.array([_free(layout, int(np.ceil(size_m / CELL_M))) for layout in layouts])
    return CellMap(free, np.zeros_like(free))


def _free(layout: Layout, n: int) -> Bool[np.ndarray, "cells cells"]:
    """Cells on whose middle nothing stands."""
    blocked, middle_m = np.zeros((n, n), dtype=bool), middles(n).reshape(n, n, 2)
    for corners in layout.obstacles_m:
        about = squares_about(corners, CELL_M, n)
        near_m = middle_m[about]
        blocked[about] |= inside_polygon(near_m.reshape(-1, 2), corners).reshape(near_m.shape[:2])
    rule = f"such that the middle of a cell of {CELL_M:g} m is free"
    require(not blocked.all(), "ArenaConfig.obstacles_m", rule, len(layout.obstacles_m))
    return ~blocked


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
    p_m: Float[np.ndarray, "rows 2"],
    faces_m: Float[np.ndarray, "*worlds faces 2 2"],
    *,
    range_m: float,
) -> CellMap:
    """See the free cells whose middle is within range of a robot of the world, with nothing in between.

    Args:
        cells: What was seen so far.
        p_m: Where the robots are, world after world.
        faces_m: Edges of obstacles; of each world, if there are several.
        range_m: How far robots see.
    """
    n_worlds, n = cells.free.shape[:2]
    reach = int(min(np.ceil(range_m / CELL_M), n))  # further there are no cells
    index = np.floor(p_m / CELL_M).astype(np.int64)[:, None] + window(reach)
    near = length(CELL_M * (index + 0.5) - p_m[:, None]) <= range_m
    row, place = np.nonzero(near & inside(index, n))
    x, y = index[row, place].T
    cell, first = x * n + y, row // (len(p_m) // n_worlds) * (n * n)  # of the cells of its world
    clear = cells.free.ravel()[first + cell].nonzero()[0]
    row, cell, first = row[clear], cell[clear], first[clear]
    if faces_m.size:
        faces_m = faces_m if faces_m.ndim == 4 else faces_m[None]
        clear = in_sight_from(p_m, row, middles(n)[cell], faces_m, range_m)
        row, cell, first = row[clear], cell[clear], first[clear]
    seen = cells.seen.copy()
    seen.reshape(-1)[first + cell] = True
    return CellMap(cells.free, seen, (*cells.sightings, Sightings(row, cell)))
