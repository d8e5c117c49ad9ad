"""Pairwise consistent measurements (PCM): the largest set between two robots that agrees with itself.

Mangelson, Dominic, Eustice, Vasudevan: *Pairwise Consistent Measurement Set Maximization for
Robust Multi-Robot Map Merging*, ICRA 2018. Each measurement between robots a and b, with the
odometry of both, says where b's first pose is in the frame of a's first pose. Two measurements
are consistent if what they say differs by no more than their noise and the odometry's between
them explain. One covariance of that loop serves the teams of the simulation and graphs of files,
in the plane and in space: noise of each measurement, carried by adjoints into a's first frame.
"""

from types import ModuleType
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.special import chdtri

from wifipgo import se2, se3
from wifipgo.arithmetic import harmless_underflow
from wifipgo.graph.edges import Edges
from wifipgo.graph.outliers.cliques import largest_clique
from wifipgo.graph.posegraph import PoseGraph

CONFIDENCE = 0.99  # share of pairs of good measurements that pass
_BLOCK = 64  # measurements compared with all others at once: bounds the memory
GAP_VARIANCE = 1e6  # m^2 and rad^2, of a step without odometry: nothing is inconsistent across it


class ConsistentSets(NamedTuple):
    """Which measurements to keep, and the pairs of robots for which a larger set may exist.

    Attributes:
        keep: What is trusted, and a consistent set of each pair.
        unproven: Pairs whose exact search was cut short, see `wifipgo.graph.outliers.cliques`.
    """

    keep: Bool[np.ndarray, " edges"]
    unproven: tuple[tuple[int, int], ...]


@harmless_underflow
def consistent(edges: Edges, *, n_robots: int, confidence: float = CONFIDENCE) -> Bool[np.ndarray, " edges"]:
    """Which measurements of a team to keep: for each pair of robots, a largest consistent set.

    Measurements within one robot are kept. Weights are not looked at. Of several largest sets it
    takes one that does not depend on the order of the measurements. Where a pair has so many
    that an exact search would take long, the set is a large one that a bounded search found, see
    `wifipgo.graph.outliers.cliques`.
    """
    order = np.lexsort((*edges.z.T, *edges.head.T, *edges.tail.T))
    graph = team_graph(edges, order, n_robots)
    keep = np.empty(len(edges), dtype=bool)
    keep[order] = _largest_sets(graph, graph.between_robots, confidence).keep
    return keep


def consistent_edges(graph: PoseGraph, *, confidence: float = CONFIDENCE) -> Bool[np.ndarray, " edges"]:
    """Which measurements to keep: odometry, and a largest consistent set of each pair and each robot.

    Where a pair has so many that an exact search would take long, the set is a large one that a bounded
    search found; `consistent_sets` says for which pairs that is so.
    """
    return consistent_sets(graph, confidence=confidence).keep


@harmless_underflow
def consistent_sets(graph: PoseGraph, *, confidence: float = CONFIDENCE) -> ConsistentSets:
    """Do as `consistent_edges`, and say which sets are not proven to be the largest."""
    return _largest_sets(graph, ~graph.odometry, confidence)


def _largest_sets(graph: PoseGraph, doubted: Bool[np.ndarray, " edges"], confidence: float) -> ConsistentSets:
    """Largest consistent sets of the doubted measurements, pair by pair."""
    keep, unproven = ~doubted, []
    pairs = np.sort(np.stack([graph.robot[graph.tail], graph.robot[graph.head]], axis=1), axis=1)
    chains = chain_odometry(graph)
    for pair in np.unique(pairs[doubted], axis=0):
        rows = np.flatnonzero((pairs == pair).all(axis=1) & doubted)
        agree = pair_chi2(graph, chains, rows) <= chdtri(graph.freedom, 1.0 - confidence)
        members, proven = largest_clique(agree)
        keep[rows[members]] = True
        if not proven:
            unproven.append((int(pair[0]), int(pair[1])))
    return ConsistentSets(keep, tuple(unproven))


def team_graph(edges: Edges, order: Int[np.ndarray, " edges"], n_robots: int) -> PoseGraph:
    """A team's measurements in some order, at poses that say nothing: odometry leads from one to the next."""
    times = 1 + int(max(edges.tail[:, 1].max(initial=0), edges.head[:, 1].max(initial=0)))
    robot, index = np.indices((n_robots, times)).reshape(2, -1)
    variance = edges.sigma[order][:, [0, 0, 1]] ** 2
    return PoseGraph(
        robot=robot,
        index=index,
        poses=np.zeros((n_robots * times, 3)),
        tail=edges.tail[order] @ [times, 1],
        head=edges.head[order] @ [times, 1],
        z=edges.z[order],
        information=np.eye(3) / variance[:, None, :],
        weight=np.ones(len(edges)),
    )


class Chains(NamedTuple):
    """Odometry of each robot from its first pose on.

    Attributes:
        poses: In the frame of the robot's first pose.
        covariance: Sum of the noise of the steps before, seen in that frame.
    """

    poses: Float[np.ndarray, "poses dims"]
    covariance: Float[np.ndarray, "poses freedom freedom"]


def chain_odometry(graph: PoseGraph) -> Chains:
    """Chain the odometry; over a gap the graph's own poses are taken, and nothing is sure."""
    n, freedom, space = len(graph.poses), graph.freedom, _space(graph)
    step = space.between(np.roll(graph.poses, 1, axis=0), graph.poses)
    variance = np.tile(GAP_VARIANCE * np.eye(freedom), (n, 1, 1))
    rows = np.flatnonzero(graph.odometry & (graph.weight > 0.0))
    step[graph.head[rows]], variance[graph.head[rows]] = graph.z[rows], np.linalg.inv(graph.information[rows])
    first = np.flatnonzero(np.append(True, graph.robot[1:] != graph.robot[:-1]))
    rank = np.arange(n) - np.repeat(first, np.diff(np.append(first, n)))
    start = np.zeros(3) if freedom == 3 else se3.IDENTITY
    poses, covariance = np.tile(start, (n, 1)), np.zeros((n, freedom, freedom))
    for rows in np.split(np.argsort(rank, kind="stable"), np.cumsum(np.bincount(rank)))[1:-1]:
        poses[rows] = space.compose(poses[rows - 1], step[rows])
    noise = _carried(graph, poses, variance)
    for rows in np.split(np.argsort(rank, kind="stable"), np.cumsum(np.bincount(rank)))[1:-1]:
        covariance[rows] = covariance[rows - 1] + noise[rows]
    return Chains(poses, covariance)


class Proposals(NamedTuple):
    """What measurements between two robots say of their frames; a is the robot with the lower number.

    Attributes:
        row_a, row_b: Their ends.
        T_a_own: Frame in which the measurement's noise is, in the frame of a's first pose.
        T_a_b: First pose of b in the frame of a's first pose.
    """

    row_a: Int[np.ndarray, " rows"]
    row_b: Int[np.ndarray, " rows"]
    T_a_own: Float[np.ndarray, "rows dims"]
    T_a_b: Float[np.ndarray, "rows dims"]


def proposals(graph: PoseGraph, chains: Chains, rows: Int[np.ndarray, " rows"]) -> Proposals:
    """Where measurements, with the odometry of both robots, put the frames of the two to each other."""
    space, z = _space(graph), graph.z[rows]
    forth = graph.robot[graph.tail[rows]] <= graph.robot[graph.head[rows]]
    i = np.where(forth, graph.tail[rows], graph.head[rows])
    j = np.where(forth, graph.head[rows], graph.tail[rows])
    T_a_head = space.compose(chains.poses[i], np.where(forth[:, None], z, space.inverse(z)))
    own_frame = np.where(forth[:, None], T_a_head, chains.poses[i])
    return Proposals(i, j, own_frame, space.compose(T_a_head, space.inverse(chains.poses[j])))


def pair_chi2(
    graph: PoseGraph, chains: Chains, rows: Int[np.ndarray, " rows"]
) -> Float[np.ndarray, "rows rows"]:
    """Squared Mahalanobis difference of what each two measurements of one pair of robots say, symmetric.

    Noise is taken to first order, that of the two stretches of odometry as independent.
    """
    space, (i, j, own_frame, said) = _space(graph), proposals(graph, chains, rows)
    own = _carried(graph, own_frame, np.linalg.inv(graph.information[rows]))
    back = space.inverse(said)
    chi2 = np.empty((len(rows), len(rows)))
    for first in range(0, len(rows), _BLOCK):
        block = slice(first, first + _BLOCK)
        off = space.log(space.compose(said[block, None], back[None]))
        along_a = _apart(chains.covariance[i], i, block)
        along_b = _carried(graph, said[block, None], _apart(chains.covariance[j], j, block))
        covariance = own[block, None] + own[None] + along_a + along_b
        chi2[block] = (off * np.linalg.solve(covariance, off[..., None])[..., 0]).sum(axis=-1)
    return np.minimum(chi2, chi2.T)


def _apart(
    covariance: Float[np.ndarray, "rows freedom freedom"], at: Int[np.ndarray, " rows"], block: slice
) -> Float[np.ndarray, "block rows freedom freedom"]:
    """Noise of the odometry between a block of some poses of one robot and all of them."""
    sign = np.where(at[block, None] >= at[None], 1.0, -1.0)[..., None, None]
    return sign * (covariance[block, None] - covariance[None])


def _space(graph: PoseGraph) -> ModuleType:
    """The group of the graph's transforms."""
    return se2 if graph.freedom == 3 else se3


def _carried(
    graph: PoseGraph, T_a_b: Float[np.ndarray, "*n dims"], covariance: Float[np.ndarray, "*m freedom freedom"]
) -> Float[np.ndarray, "*k freedom freedom"]:
    """Covariance of a small motion in frame b as one in frame a: Ad C Ad^T."""
    Ad = _space(graph).adjoint(T_a_b)
    carried: np.ndarray = Ad @ covariance @ np.swapaxes(Ad, -1, -2)
    return carried
