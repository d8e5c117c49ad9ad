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
        order: Rows of the problem's poses, in elimination order.
        below: Diagonals below the main one in which the normal equations are not zero.
        place: Of their entries in that band, column by column.
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
    below: int
    place: Int[np.ndarray, " entries"]
    slope_place: Int[np.ndarray, " slopes"]


def squares(problem: Problem, edges: Edges) -> tuple[Squares, Poses]:
    """What `wifipgo.graph.solvers._problem.build` makes factors of, and where a search starts."""
    inner, outer = select(edges, problem.inner), select(edges, problem.outer)
    T_world_tail, told_variance, shift_m = told_tails(outer, problem.told_sigma)
    n, n_inner, first = len(problem.start), len(inner), problem.first_key[problem.team]
    stay = np.concatenate([problem.start[first], T_world_tail])
    tail = np.concatenate([problem.tail[:n_inner], first, problem.tail[n_inner:]])
    order, tail, inner_head, below = _elimination_order(problem.start, tail, problem.head)
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
        below=below,
        place=_places(tail, inner_head, below),
        slope_place=np.concatenate(
            [3 * tail, 3 * tail + 1, 3 * tail + 2, 3 * head, 3 * head + 1, 3 * head + 2]
        ),
    )
    ordered = np.concatenate([problem.start[order], stay])
    return sq, Poses(_complex(ordered), ordered[:, 2])


def _complex(xy: Float[np.ndarray, "rows _"]) -> Complex[np.ndarray, " rows"]:
    return xy[:, 0] + 1j * xy[:, 1]


def _elimination_order(
    start: Float[np.ndarray, "poses 3"], tail: Int[np.ndarray, " rows"], head: Int[np.ndarray, " inner"]
) -> tuple[Int[np.ndarray, " poses"], Int[np.ndarray, " rows"], Int[np.ndarray, " inner"], int]:
    """Order poses along the direction in which measurements reach least far."""
    along = (_complex(start) * _DIRECTIONS[:, None]).real
    orders = along.argsort(axis=1, kind="stable")
    places = orders.argsort(axis=1)
    reach = np.abs(places.take(tail[: len(head)], axis=1) - places.take(head, axis=1)).max(axis=1, initial=0)
    best = int(reach.argmin())
    return orders[best], places[best][tail], places[best][head], 3 * int(reach[best]) + 2


def _places(
    tail: Int[np.ndarray, " rows"], head: Int[np.ndarray, " inner"], below: int
) -> Int[np.ndarray, " entries"]:
    """Where entries go: blocks of all tails, of heads, and between the two.

    The band is in columns of one more than ``below``, so row r of column c is at ``c * below + r``.
    """
    own = (_OWN[1] * below + _OWN[0])[:, None]
    i, j = 3 * tail[: len(head)], 3 * head
    ends = i + _CROSS[1][:, None], j + _CROSS[0][:, None]
    column, row = np.minimum(*ends), np.maximum(*ends)
    blocks = ((3 * tail) * (below + 1) + own, j * (below + 1) + own, column * below + row)
    return np.concatenate([block.ravel() for block in blocks])
