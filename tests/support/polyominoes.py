"""Shapes made of unit squares: what is inside them and what overlaps is read off sets of cells."""

import math

import numpy as np

Cell = tuple[int, int]
Corners = tuple[tuple[float, float], ...]
_SIDES = (((0, 0), (1, 0)), ((1, 0), (1, 1)), ((1, 1), (0, 1)), ((0, 1), (0, 0)))
_BEYOND = ((0, -1), (1, 0), (0, 1), (-1, 0))


def grown(rng: np.random.Generator, n_cells: int, width: int) -> set[Cell]:
    """A set of cells that hangs together, is in one piece with what is around it, and nowhere touches itself.

    It grows at random, a cell at a time, inside a square that is ``width`` cells wide.
    """
    cells = {(int(rng.integers(width)), int(rng.integers(width)))}
    for _ in range(40 * n_cells):
        x, y = sorted(cells)[rng.integers(len(cells))]
        dx, dy = _BEYOND[rng.integers(4)]
        new = (x + dx, y + dy)
        if len(cells) < n_cells and min(new) >= 0 and max(new) < width and outline(cells | {new}):
            cells.add(new)
    return cells


def outline(cells: set[Cell]) -> Corners:
    """Corners of the shape, counter-clockwise; none if it has a hole or touches itself at a corner."""
    after: dict[Cell, Cell] = {}
    for x, y in sorted(cells):
        for ((ax, ay), (bx, by)), (dx, dy) in zip(_SIDES, _BEYOND, strict=True):
            if (x + dx, y + dy) not in cells:
                if (x + ax, y + ay) in after:
                    return ()
                after[x + ax, y + ay] = (x + bx, y + by)
    loop = [next(iter(after))]
    while (following := after[loop[-1]]) != loop[0]:
        loop.append(following)
    if len(loop) < len(after):
        return ()
    turns = zip(loop[-1:] + loop[:-1], loop, loop[1:] + loop[:1], strict=True)
    return tuple((float(x), float(y)) for (a, b), (x, y), (c, d) in turns if a != c and b != d)


def solid(p: np.ndarray, cells: set[Cell]) -> np.ndarray:
    """Whether points lie in the open inside of the shape: all cells that they touch belong to it."""

    def touched(x: float) -> set[int]:
        return {math.floor(x), math.ceil(x) - 1}

    return np.array([all((i, j) in cells for i in touched(x) for j in touched(y)) for x, y in p.tolist()])
