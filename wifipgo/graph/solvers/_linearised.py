"""Measurements of planar poses as arrays, for squares without gtsam's objects.

The plane is that of complex numbers: positions are x + iy, rotations are unit numbers.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float, Int

from wifipgo.graph.edges import Edges, select
from wifipgo.graph.solvers._factors import told_tails
from wifipgo.graph.solvers._problem import Problem

_N_DIRECTIONS = 8
# Directions to order poses along: of those tried, the one counts along which measurements reach least far.
_DIRECTIONS = np.exp(1j * np.pi / _N_DIRECTIONS * np.arange(_N_DIRECTIONS))
# Rows and columns of x, y, yaw (0, 1, 2): of the lower half of a pose's block, and of the block that has a
# head's in its rows and a tail's in its columns. The rest of both is zero.
_OWN = np.array([[0, 1, 2, 2, 2], [0, 1, 0, 1, 2]])
_CROSS = np.array([[0, 1, 0, 1, 2, 2, 2], [0, 1, 2, 2, 0, 1, 2]])


class Poses(NamedTuple):
    """Positions and headings in elimination order; those that stay where they are come last."""

    p_m: Complex[np.ndarray, " all"]
    yaw_rad: Float[np.ndarray, " all"]


class Blocks(NamedTuple):
    """Groups whose systems share nothing: blocks of one system, each a band of its own width.

    Attributes:
        begin: First pose of each group, and the end of the last.
        below: Diagonals below the main one in which a group's normal equations are not zero.
        cells: First entry of each group's band where bands lie one behind another, and the end of the last.
        of_row: Group of each measurement.
    """

    begin: Int[np.ndarray, " groups+1"]
    below: Int[np.ndarray, " groups"]
    cells: Int[np.ndarray, " groups+1"]
    of_row: Int[np.ndarray, " rows"]

    def __len__(self) -> int:
        """How many groups."""
        return len(self.below)

    def poses(self, group: int) -> slice:
        """A group's poses."""
        return slice(int(self.begin[group]), int(self.begin[group + 1]))


class Squares(NamedTuple):
    """Measurements, one row each; those of poses that stay where they are come last.

    Attributes:
        tail: Pose in whose frame the measurement is, by its place in the elimination order.
        head: Measured pose.
        z_m: Its measured position, in its own measured axes.
        turn: From axes of the tail into measured axes of the head.
        z_rad: Its measured heading.
        shift_m: What comes off the position with an error of one rad of the heading.
        information: Of position, 1 / m^2, and heading, 1 / rad^2.
        order: Rows of the problem's poses, in elimination order, group by group.
        blocks: Bands of the groups.
        place: Of entries of the normal equations in these bands, column by column.
        slope_place: Of the entries of their right side.
    """

    tail: Int[np.ndarray, " rows"]
    head: Int[np.ndarray, " rows"]
    z_m: Complex[np.ndarray, " rows"]
    turn: Complex[np.ndarray, " rows"]
    z_rad: Float[np.ndarray, " rows"]
    shift_m: Complex[np.ndarray, " rows"]
    information: Float[np.ndarray, "2 rows"]
    order: Int[np.ndarray, " poses"]
    blocks: Blocks
    place: Int[np.ndarray, " entries"]
    slope_place: Int[np.ndarray, " slopes"]


def squares(problem: Problem, edges: Edges) -> tuple[Squares, Poses]:
    """What `wifipgo.graph.solvers._problem.build` makes factors of, and where a search starts."""
    inner, outer = select(edges, problem.inner), select(edges, problem.outer)
    T_world_tail, told_variance, shift_m = told_tails(outer, problem.told_sigma)
    n, n_inner, first = len(problem.start), len(inner), problem.first_key[problem.team]
    stay = np.concatenate([problem.start[first], T_world_tail])
    tail = np.concatenate([problem.tail[:n_inner], first, problem.tail[n_inner:]])
    group = problem.group.repeat(n // len(first))
    order, places, below = _elimination_order(problem.start, group, tail[:n_inner], problem.head)
    blocks = _blocks(group, below, of_row=group[tail])
    tail, inner_head = places[tail], places[problem.head]
    variance = [inner.sigma**2 / inner.weight[:, None], problem.start_sigma**2, told_variance]
    rest = np.zeros(len(stay))
    turn = np.exp(-1j * np.concatenate([inner.z[:, 2], rest]))
    head = np.concatenate([inner_head, np.arange(n, n + len(stay))])
    sq = Squares(
        tail=tail,
        head=head,
        z_m=np.concatenate([_complex(inner.z), rest]) * turn,
        turn=turn,
        z_rad=np.concatenate([inner.z[:, 2], rest]),
        shift_m=np.concatenate([np.zeros(n_inner + len(first)), _complex(shift_m)]),
        information=1.0 / np.concatenate(variance).T,
        order=order,
        blocks=blocks,
        place=_places(tail, inner_head, blocks),
        slope_place=np.concatenate(
            [3 * tail, 3 * tail + 1, 3 * tail + 2, 3 * head, 3 * head + 1, 3 * head + 2]
        ),
    )
    ordered = np.concatenate([problem.start[order], stay])
    return sq, Poses(_complex(ordered), ordered[:, 2])


def _complex(xy: Float[np.ndarray, "rows _"]) -> Complex[np.ndarray, " rows"]:
    return xy[:, 0] + 1j * xy[:, 1]


def _elimination_order(
    start: Float[np.ndarray, "poses 3"],
    group: Int[np.ndarray, " poses"],
    tail: Int[np.ndarray, " inner"],
    head: Int[np.ndarray, " inner"],
) -> tuple[Int[np.ndarray, " poses"], Int[np.ndarray, " poses"], Int[np.ndarray, " groups"]]:
    """Order each group's poses along the direction in which its measurements reach least far.

    Returns:
        Poses in order, the place of each pose, and the width of each group's band below its diagonal.
    """
    along = (_complex(start) * _DIRECTIONS[:, None]).real
    by_group = np.broadcast_to(group, along.shape)
    orders = np.lexsort((along, by_group)) if group[-1] else along.argsort(axis=1, kind="stable")
    places = orders.argsort(axis=1)
    apart = np.abs(places.take(tail, axis=1) - places.take(head, axis=1))
    reach = _most(apart, group[tail], n_groups=int(group[-1]) + 1)
    best = reach.argmin(axis=0)
    place = places[best[group], np.arange(len(group))]
    return place.argsort(), place, 3 * reach[best, np.arange(len(best))] + 2


def _most(
    x: Int[np.ndarray, "directions rows"], group: Int[np.ndarray, " rows"], n_groups: int
) -> Int[np.ndarray, "directions groups"]:
    """Largest of each group's columns, which lie side by side; 0 of a group without any."""
    if n_groups == 1:
        return x.max(axis=1, initial=0, keepdims=True)
    begin = group.searchsorted(np.arange(n_groups))
    padded = np.concatenate([x, np.zeros_like(x[:, :1])], axis=1)
    return np.where(np.bincount(group, minlength=n_groups), np.maximum.reduceat(padded, begin, axis=1), 0)


def _blocks(
    group: Int[np.ndarray, " poses"], below: Int[np.ndarray, " groups"], of_row: Int[np.ndarray, " rows"]
) -> Blocks:
    begin = group.searchsorted(np.arange(len(below) + 1))
    cells = np.zeros(len(below) + 1, dtype=np.int64)
    np.cumsum(3 * np.diff(begin) * (below + 1), out=cells[1:])
    return Blocks(begin, below, cells, of_row)


def _places(
    tail: Int[np.ndarray, " rows"], head: Int[np.ndarray, " inner"], blocks: Blocks
) -> Int[np.ndarray, " entries"]:
    """Where entries go: blocks of all tails, of heads, and between the two.

    A group's band is in columns of one more than ``below``, so row r of its column c is at ``c * below + r``.
    """
    of, n = blocks.of_row, len(head)
    below, cells, first = blocks.below[of], blocks.cells[of], blocks.begin[of]
    own = _OWN[1][:, None] * below + (_OWN[0][:, None] + cells)
    cross, i, j = cells[:n], 3 * (tail - first), 3 * (head - first[:n])
    ends = i[:n] + _CROSS[1][:, None], j + _CROSS[0][:, None]
    column, row = np.minimum(*ends), np.maximum(*ends)
    tails, heads = i * (below + 1) + own, j * (below[:n] + 1) + own[:, :n]
    return np.concatenate([part.ravel() for part in (tails, heads, column * below[:n] + (row + cross))])
