"""Which robots are near each other: by a table of all distances in small teams, by a tree in large ones."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial import cKDTree

from wifipgo.se2 import length

# Tables of at most so many distances, of all worlds, cost less than a tree.
_FEW = 3_000
# A tree's candidates reach this much further, so that no rounding of its own decides.
_SLACK = 1.0 + 1e-9


class Neighbours(NamedTuple):
    """Pairs of robots of one world within a range of each other, both ways round, by row and then by peer.

    Attributes:
        row: One robot.
        other: The other's row.
        peer: The other's number in its world: its column in a table of pairs.
        apart_m: Distance between the two.
    """

    row: Int[np.ndarray, " pairs"]
    other: Int[np.ndarray, " pairs"]
    peer: Int[np.ndarray, " pairs"]
    apart_m: Float[np.ndarray, " pairs"]


_NONE = np.zeros(0, dtype=np.int64)
_NOBODY = Neighbours(_NONE, _NONE, _NONE, np.zeros(0))


def neighbours(p_m: Float[np.ndarray, "rows 2"], n_robots: int, range_m: float) -> Neighbours:
    """Pairs within range, of worlds of ``n_robots`` each; nobody is its own neighbour.

    Args:
        p_m: Where the robots are, row by row.
        n_robots: Robots of each world.
        range_m: How far apart they may be.
    """
    if len(p_m) * n_robots <= _FEW:
        return _among_all(p_m, n_robots, range_m)
    return _by_tree(p_m, n_robots, range_m)


def _among_all(p_m: np.ndarray, n: int, range_m: float) -> Neighbours:
    """Measure every pair."""
    by_world = p_m.reshape(-1, n, 2)
    apart_m = length(by_world[:, :, None] - by_world[:, None])
    near = apart_m <= range_m
    near.reshape(len(near), -1)[:, :: n + 1] = False
    row, peer = near.reshape(-1, n).nonzero()
    if not len(row):
        return _NOBODY
    return Neighbours(row, row - row % n + peer, peer, apart_m.ravel().take(row * n + peer))


def _by_tree(p_m: np.ndarray, n: int, range_m: float) -> Neighbours:
    """Measure the pairs that a tree finds; worlds lie too far apart in height to be found together."""
    floor_m = np.repeat(np.arange(len(p_m) // n), n) * (2.0 * range_m + 1.0)
    tree = cKDTree(np.column_stack([p_m, floor_m]))
    a, b = tree.query_pairs(range_m * _SLACK, output_type="ndarray").reshape(-1, 2).T
    row, other = np.concatenate([a, b]), np.concatenate([b, a])
    order = np.argsort(row * len(p_m) + other)
    row, other = row[order], other[order]
    apart_m = length(p_m[row] - p_m[other])
    near = (apart_m <= range_m).nonzero()[0]
    row, other = row[near], other[near]
    return Neighbours(row, other, other % n, apart_m[near])


def in_turn(seen: Bool[np.ndarray, "rows peers"], t: int) -> Bool[np.ndarray, "rows peers"]:
    """Of each pair in view the robot whose turn it is: the one of lower number, then the other."""
    robot, peer = np.arange(len(seen))[:, None] % seen.shape[1], np.arange(seen.shape[1])
    return seen & ((robot < peer) == ((robot + peer + t) % 2 == 0))
