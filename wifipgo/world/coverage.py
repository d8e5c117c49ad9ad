"""Which cells of the room the team has seen."""

import functools
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from wifipgo.world.layout import Layout, inside_polygon

CELL_M = 1.0


class CellMap(NamedTuple):
    """Square cells over the room: which are free at their centre, and which were seen."""

    free: Bool[np.ndarray, "cells cells"]
    seen: Bool[np.ndarray, "cells cells"]

    @property
    def share(self) -> float:
        """Share of the free cells that were seen, in [0, 1]."""
        return float((self.free & self.seen).sum() / self.free.sum())


def empty_map(layout: Layout, size_m: float) -> CellMap:
    """Cells of a room in which nothing was seen yet."""
    n = int(np.ceil(size_m / CELL_M))
    centre_m = CELL_M * (np.stack(np.meshgrid(np.arange(n), np.arange(n), indexing="ij"), -1) + 0.5).reshape(
        -1, 2
    )
    blocked = np.zeros(n * n, dtype=bool)
    for corners in layout.obstacles_m:
        blocked |= inside_polygon(centre_m, corners)
    return CellMap((~blocked).reshape(n, n), np.zeros((n, n), dtype=bool))


@functools.cache
def _window(reach: int) -> Int[np.ndarray, "cells 2"]:
    """Offsets of the cells around one."""
    steps = np.arange(-reach, reach + 1)
    return np.stack(np.meshgrid(steps, steps, indexing="ij"), -1).reshape(-1, 2)


def reveal(cells: CellMap, p_m: Float[np.ndarray, "robots 2"], *, range_m: float) -> CellMap:
    """Mark the cells whose centre is within range of a robot as seen."""
    n = len(cells.seen)
    index = np.floor(p_m / CELL_M).astype(int)[:, None] + _window(int(np.ceil(range_m / CELL_M)))[None]
    gap_m = CELL_M * (index + 0.5) - p_m[:, None]
    away_m = np.hypot(gap_m[..., 0], gap_m[..., 1])
    hit = index[(away_m <= range_m) & ((index >= 0) & (index < n)).all(axis=-1)]
    seen = cells.seen.copy()
    seen[hit[:, 0], hit[:, 1]] = True
    return CellMap(cells.free, seen)
