"""Measurements of planar poses as arrays, for squares without gtsam's objects.

The plane is that of complex numbers: positions are x + iy, rotations are unit numbers.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float, Int

from wifipgo.graph.edges import Edges, select
from wifipgo.graph.solvers._factors import told_tails
from wifipgo.graph.solvers._problem import Chains

_N_DIRECTIONS = 8
# Directions to order poses along: of those tried, the one counts along which measurements reach least far.
_DIRECTIONS = np.exp(1j * np.pi / _N_DIRECTIONS * np.arange(_N_DIRECTIONS))
# Rows and columns of x, y, yaw (0, 1, 2): of the lower half of a pose's block, and of the block that has a
# head's in its rows and a tail's in its columns. The rest of both is zero.
_OWN = np.array([[0, 1, 2, 2, 2], [0, 1, 0, 1, 2]])
_CROSS = np.array([[0, 1, 0, 1, 2, 2, 2], [0, 1, 2, 2, 0, 1, 2]])


# Bits of a pose's number and of its place in mm.
_POSE_BITS, _PLACE_BITS = 21, 22
_FARTHEST_MM = (1 << _PLACE_BITS - 1) - 1
Sort = Callable[[np.ndarray, np.ndarray], np.ndarray]


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
        order: The poses, in elimination order, group by group.
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


def squares(chains: Chains, edges: Edges, *, sort: Sort | None = None) -> tuple[Squares, Poses]:
    """What `wifipgo.graph.solvers._problem.build` makes factors of, and where a search starts.

    Args:
        chains: Trajectories, and which measurements are among them.
        edges: All measurements.
        sort: How poses are ordered along a direction; `in_order` without.
    """
    inner, outer = select(edges, chains.inner), select(edges, chains.outer)
    T_world_tail, told_variance, shift_m = told_tails(outer, chains.told_sigma)
    n, n_inner, first = len(chains.start), len(inner), chains.first
    stay = np.concatenate([chains.start[first], T_world_tail])
    tail = np.concatenate([chains.tail[:n_inner], first, chains.tail[n_inner:]])
    orders = (sort or in_order)(chains.start, chains.group)
    order, places, below = _narrowest(orders, chains.group, tail[:n_inner], chains.head)
    blocks = _blocks(chains.group, below, of_row=chains.group[tail])
    tail, inner_head = places[tail], places[chains.head]
    variance = [inner.sigma**2 / inner.weight[:, None], chains.first_sigma**2, told_variance]
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
    ordered = np.concatenate([chains.start[order], stay])
    return sq, Poses(_complex(ordered), ordered[:, 2])


def _complex(xy: Float[np.ndarray, "rows _"]) -> Complex[np.ndarray, " rows"]:
    return xy[:, 0] + 1j * xy[:, 1]


def in_order(
    start: Float[np.ndarray, "poses 3"], group: Int[np.ndarray, " poses"]
) -> Int[np.ndarray, "directions poses"]:
    """Poses of each group in their order along each direction."""
    along = (_complex(start) * _DIRECTIONS[:, None]).real
    if not group[-1]:
        return along.argsort(axis=1, kind="stable")
    return np.lexsort((along, np.broadcast_to(group, along.shape)))


def in_order_of_millimetres(
    start: Float[np.ndarray, "poses 3"], group: Int[np.ndarray, " poses"]
) -> Int[np.ndarray, "directions poses"]:
    """The same to a millimetre, several times faster: group, place and pose are bits of one number.

    Beyond 2 km from the origin order is lost, and bands are wide.
    """
    along = (_complex(1000.0 * start) * _DIRECTIONS[:, None]).real
    place = np.clip(along, -_FARTHEST_MM, _FARTHEST_MM).astype(np.int64) + _FARTHEST_MM
    keys = np.sort(
        (group << _POSE_BITS + _PLACE_BITS) + (place << _POSE_BITS) + np.arange(len(group)), axis=1
    )
    return keys & ((1 << _POSE_BITS) - 1)


def _narrowest(
    orders: Int[np.ndarray, "directions poses"],
    group: Int[np.ndarray, " poses"],
    tail: Int[np.ndarray, " inner"],
    head: Int[np.ndarray, " inner"],
) -> tuple[Int[np.ndarray, " poses"], Int[np.ndarray, " poses"], Int[np.ndarray, " groups"]]:
    """Order in which each group's measurements reach least far.

    Returns:
        Poses in order, the place of each pose, and the width of each group's band below its diagonal.
    """
    places = np.empty_like(orders)
    np.put_along_axis(places, orders, np.arange(len(group))[None], axis=1)
    apart = np.abs(places.take(tail, axis=1) - places.take(head, axis=1))
    reach = _most(apart, group[tail], n_groups=int(group[-1]) + 1)
    best = reach.argmin(axis=0)
    place = places[best[group], np.arange(len(group))]
    return orders[best[group], np.arange(len(group))], place, 3 * reach[best, np.arange(len(best))] + 2


def _most(
    x: Int[np.ndarray, "directions rows"], group: Int[np.ndarray, " rows"], n_groups: int
) -> Int[np.ndarray, "directions groups"]:
    """Largest of each group's columns, which lie side by side; 0 of a group without any."""
    if n_groups == 1:
        return x.max(axis=1, initial=0, keepdims=True)
    begin = group.searchsorted(np.arange(n_groups))
    padded = np.concatenate([x, np.zeros((len(x), 1), dtype=x.dtype)], axis=1)
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
