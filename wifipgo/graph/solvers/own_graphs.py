"""What each robot knows, solved for by itself: a graph a robot, all of them side by side (paper Eq. 3).

A robot's graph has its own poses and those that it was sent, so two graphs may have copies of the same
poses and measurements. They share nothing else: each is a block of one system, as in
`wifipgo.graph.solvers.groups`.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.linalg import lapack

from wifipgo.graph.covariance import in_world_axes
from wifipgo.graph.edges import Edges
from wifipgo.graph.solvers._banded_cholesky import linearised
from wifipgo.graph.solvers._banded_descent import BandedOptimum, descended
from wifipgo.graph.solvers._gauss_newton import Descent
from wifipgo.graph.solvers._linearised import in_order_of_millimetres, squares
from wifipgo.graph.solvers._problem import KNOWN_START, NOTHING, REPORTED_SIGMA, Chains

# Searches start nearby and go on in the next iteration: nine of ten end after a step, with 2e-3 of a
# chi-square left to gain (6 % of a sigma, all poses together); and they use the first factors for longer.
_PATIENT = Descent(slack=1e-3, near=100.0, by_model=1e-2)
_QUICK = replace(_PATIENT, most=3)  # for most graphs; those that need more begin anew where they are, alone
_ROW_BITS = 40  # of an integer that sorts edges by robot


class OwnGraphs(NamedTuple):
    """What some robots know, one graph each.

    Attributes:
        robot: Whose, in ascending order.
        held: Poses of each robot of its world that are part of it: the first so many.
        start: Where the search starts: the poses, graph by graph and robot by robot.
    """

    robot: Int[np.ndarray, " graphs"]
    held: Int[np.ndarray, "graphs peers"]
    start: Float[np.ndarray, "poses 3"]

    @property
    def own(self) -> Bool[np.ndarray, " poses"]:
        """Which of the poses are those of the robot itself."""
        n_peers = self.held.shape[1]
        own = (np.arange(self.held.size) - self.robot.repeat(n_peers)) % n_peers == 0
        return own.repeat(self.held.ravel())

    def chosen(self, graphs: Bool[np.ndarray, " graphs"]) -> "OwnGraphs":
        """Some of them."""
        return OwnGraphs(
            self.robot[graphs], self.held[graphs], self.start[graphs.repeat(self.held.sum(axis=1))]
        )


class OwnOptima(NamedTuple):
    """What came of it.

    Attributes:
        poses: In the order of the start.
        covariance: Of each robot's own last pose, along the axes of the world.
        settled: Whether each search ended at a bottom; else what is said of that graph means nothing.
        told: Rows of the edges that rest on what was told, graph by graph.
        told_graph: Which graph each is part of.
    """

    poses: Float[np.ndarray, "poses 3"]
    covariance: Float[np.ndarray, "graphs 3 3"]
    settled: Bool[np.ndarray, " graphs"]
    told: Int[np.ndarray, " told"]
    told_graph: Int[np.ndarray, " told"]


def solve_own_graphs(graphs: OwnGraphs, edges: Edges, *, uses_told: bool) -> OwnOptima:
    """Poses that make what each robot knows most likely, all squares; from a start nearby.

    Args:
        graphs: Who knows what.
        edges: All measurements. A robot knows those of the poses that it holds.
        uses_told: Whether edges to poses outside a graph tie their tails to what was told.
    """
    chains = _chains(graphs, edges, uses_told=uses_told)
    sq, start = squares(chains, edges, sort=in_order_of_millimetres)
    low = descended(sq, linearised(sq, start), _QUICK)
    settled = np.array([search.settled for search in low.searches])
    poses, covariance = low.poses, _last_covariances(low, graphs)
    late = np.array([search.steps == _QUICK.most for search in low.searches]) & ~settled
    if late.any():
        rows = late[chains.group]
        rest = graphs._replace(start=poses).chosen(late)
        poses[rows], covariance[late], settled[late] = _searched(rest, edges, uses_told=uses_told)
    return OwnOptima(poses, covariance, settled, chains.outer, chains.group[chains.tail[len(chains.inner) :]])


def _searched(
    graphs: OwnGraphs, edges: Edges, *, uses_told: bool
) -> tuple[Float[np.ndarray, "poses 3"], Float[np.ndarray, "graphs 3 3"], Bool[np.ndarray, " graphs"]]:
    """Poses, covariances of last own ones, and whether it is an optimum, after as many steps as it takes."""
    chains = _chains(graphs, edges, uses_told=uses_told)
    sq, start = squares(chains, edges, sort=in_order_of_millimetres)
    low = descended(sq, linearised(sq, start), _PATIENT)
    return low.poses, _last_covariances(low, graphs), np.array([search.settled for search in low.searches])


def _chains(graphs: OwnGraphs, edges: Edges, *, uses_told: bool) -> Chains:
    """Who knows which measurements of whom."""
    robot, held, start = graphs
    n_peers = held.shape[1]
    graph, peer = held.nonzero()
    ends = held.ravel().cumsum()
    first = (ends - held.ravel()).reshape(held.shape)
    base = robot - robot % n_peers
    chain, row = _rows_of(edges, base[graph] + peer)
    known = (edges.measured_at[row] < held[graph, peer][chain]) & (edges.weight[row] > NOTHING)
    chain, row = chain[known], row[known]
    tail, head, g = edges.tail[row], edges.head[row], graph[chain]
    inside = head[:, 1] < held[g, head[:, 0] - base[g]]
    at, outside = first[graph, peer][chain] + tail[:, 1], ~inside & uses_told
    g, head = g[inside], head[inside]
    outer = row[outside]
    begins = first[graph, peer]
    return Chains(
        start=start,
        group=np.arange(len(robot)).repeat(held.sum(axis=1)),
        first=begins,
        first_sigma=np.broadcast_to(KNOWN_START, (len(begins), 2)),
        inner=row[inside],
        outer=outer,
        tail=np.concatenate([at[inside], at[outside]]),
        head=first[g, head[:, 0] - base[g]] + head[:, 1],
        told_sigma=np.broadcast_to(REPORTED_SIGMA, (len(outer), 2)),
    )


def _rows_of(
    edges: Edges, robots: Int[np.ndarray, " chains"]
) -> tuple[Int[np.ndarray, " rows"], Int[np.ndarray, " rows"]]:
    """What robots measured, one after another: number in the list of robots, and row of the edge."""
    tail = edges.tail[:, 0]
    keys = np.sort((tail << _ROW_BITS) + np.arange(len(tail)))
    begin, end = (keys.searchsorted(robot << _ROW_BITS) for robot in (robots, robots + 1))
    n_rows = end - begin
    chain = np.arange(len(robots)).repeat(n_rows)
    place = np.arange(len(chain)) + (begin - n_rows.cumsum() + n_rows)[chain]
    return chain, keys[place] & ((1 << _ROW_BITS) - 1)


def _last_covariances(low: BandedOptimum, graphs: OwnGraphs) -> Float[np.ndarray, "graphs 3 3"]:
    """Covariances of robots' own last poses by the factors of the last step, which turn with the pose."""
    sq, (bands, yaw_rad) = low.squares, low.factors
    place = np.empty(len(sq.order), dtype=np.int64)
    place[sq.order] = np.arange(len(sq.order))
    own = np.arange(graphs.held.shape[1]) <= (graphs.robot % graphs.held.shape[1])[:, None]
    last = place[sq.blocks.begin[:-1] + (graphs.held * own).sum(axis=1) - 1]
    found = np.zeros((len(bands), 3, 3))
    for k, (band, here) in enumerate(zip(bands, (last - sq.blocks.begin[:-1]).tolist(), strict=True)):
        if band is not None:
            found[k] = _corner(band[:, 3 * here :])
    return in_world_axes(found, low.at.poses.yaw_rad[last] - yaw_rad[last])


def _corner(factors: Float[np.ndarray, "diagonals unknowns"]) -> Float[np.ndarray, "3 3"]:
    """Block of the inverse of the first pose of what is left to eliminate."""
    unit = np.zeros((factors.shape[1], 3), order="F")
    unit[[0, 1, 2], [0, 1, 2]] = 1.0
    half, _ = lapack.dtbtrs(factors, unit, uplo="L", overwrite_b=1)
    found: np.ndarray = half.T @ half
    return found
