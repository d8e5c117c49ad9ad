"""Pairwise consistent measurements (PCM) in graphs with any keys, in the plane and in space.

Mangelson, Dominic, Eustice, Vasudevan: *Pairwise Consistent Measurement Set Maximization for
Robust Multi-Robot Map Merging*, ICRA 2018. Each measurement between robots a and b, with the
odometry of both, says where b's first pose is in the frame of a's first pose. Two measurements
are consistent if what they say differs by no more than their noise and the odometry's between
them explain. `wifipgo.graph.consistency` does the same for the teams of the simulation.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.special import chdtri

from wifipgo import se3
from wifipgo.arithmetic import harmless_underflow
from wifipgo.graph.outliers.cliques import largest_clique
from wifipgo.graph.posegraph import PoseGraph
from wifipgo.graph.residuals import PLANAR

CONFIDENCE = 0.99  # share of pairs of good measurements that pass
_BLOCK = 64  # measurements compared with all others at once: bounds the memory
GAP_VARIANCE = 1e6  # m^2 and rad^2, of a step without odometry: nothing is inconsistent across it


class ConsistentSets(NamedTuple):
    """Which measurements to keep, and the pairs of robots for which a larger set may exist.

    Attributes:
        keep: Odometry, and a consistent set of each pair and each robot.
        unproven: Pairs whose exact search was cut short, see `wifipgo.graph.outliers.cliques`.
    """

    keep: Bool[np.ndarray, " edges"]
    unproven: tuple[tuple[int, int], ...]


def consistent_edges(graph: PoseGraph, *, confidence: float = CONFIDENCE) -> Bool[np.ndarray, " edges"]:
    """Which measurements to keep: odometry, and a largest consistent set of each pair and each robot.

    Where a pair has so many that an exact search would take long, the set is a large one that a bounded
    search found; `consistent_sets` says for which pairs that is so.
    """
    return consistent_sets(graph, confidence=confidence).keep


@harmless_underflow
def consistent_sets(graph: PoseGraph, *, confidence: float = CONFIDENCE) -> ConsistentSets:
    """Do as `consistent_edges`, and say which sets are not proven to be the largest."""
    keep, unproven = graph.odometry.copy(), []
    pairs = np.sort(np.stack([graph.robot[graph.tail], graph.robot[graph.head]], axis=1), axis=1)
    chains = _chains(graph)
    for pair in np.unique(pairs[~keep], axis=0):
        rows = np.flatnonzero((pairs == pair).all(axis=1) & ~graph.odometry)
        agree = pair_chi2(graph, chains, rows) <= chdtri(graph.freedom, 1.0 - confidence)
        members, proven = largest_clique(agree)
        keep[rows[members]] = True
        if not proven:
            unproven.append((int(pair[0]), int(pair[1])))
    return ConsistentSets(keep, tuple(unproven))


class Chains(NamedTuple):
    """Odometry of each robot from its first pose on.

    Attributes:
        poses: In the frame of the robot's first pose, as transforms in space.
        covariance: Sum of the noise of the steps before, seen in that frame.
    """

    poses: Float[np.ndarray, "poses 7"]
    covariance: Float[np.ndarray, "poses freedom freedom"]


def _chains(graph: PoseGraph) -> Chains:
    """Chain the odometry; over a gap the graph's own poses are taken, and nothing is sure."""
    n, freedom = len(graph.poses), graph.freedom
    world = se3.lift(graph.poses) if freedom == 3 else graph.poses
    step, variance = (
        se3.between(np.roll(world, 1, axis=0), world),
        np.tile(GAP_VARIANCE * np.eye(freedom), (n, 1, 1)),
    )
    rows = np.flatnonzero(graph.odometry & (graph.weight > 0.0))
    z = _in_space(graph)
    step[graph.head[rows]], variance[graph.head[rows]] = z[rows], np.linalg.inv(graph.information[rows])
    poses, covariance = np.tile(se3.IDENTITY, (n, 1)), np.zeros((n, freedom, freedom))
    for row in range(1, n):
        if graph.robot[row] == graph.robot[row - 1]:
            poses[row] = se3.compose(poses[row - 1], step[row])
            covariance[row] = covariance[row - 1] + _seen_from(poses[row], variance[row])
    return Chains(poses, covariance)


def pair_chi2(
    graph: PoseGraph, chains: Chains, rows: Int[np.ndarray, " rows"]
) -> Float[np.ndarray, "rows rows"]:
    """Squared Mahalanobis difference of what each two measurements of one pair of robots say, symmetric.

    Noise is taken to first order, that of the two stretches of odometry as independent.
    """
    z = _in_space(graph)[rows]
    forth = graph.robot[graph.tail[rows]] <= graph.robot[graph.head[rows]]
    i = np.where(forth, graph.tail[rows], graph.head[rows])
    j = np.where(forth, graph.head[rows], graph.tail[rows])
    z_a_b = np.where(forth[:, None], z, se3.inverse(z))
    T_a_head = se3.compose(chains.poses[i], z_a_b)
    acts = np.where(forth[:, None], T_a_head, chains.poses[i])
    own = _seen_from(acts, np.linalg.inv(graph.information[rows]))
    said = se3.compose(T_a_head, se3.inverse(chains.poses[j]))  # b's first pose in the frame of a's
    chi2 = np.empty((len(rows), len(rows)))
    for first in range(0, len(rows), _BLOCK):
        block = slice(first, first + _BLOCK)
        off = se3.log(se3.compose(said[block, None], se3.inverse(said)[None]))
        off = off[..., PLANAR] if graph.freedom == 3 else off
        along_a = _apart(chains.covariance[i], i, block)
        along_b = _seen_from(said[block, None], _apart(chains.covariance[j], j, block))
        covariance = own[block, None] + own[None] + along_a + along_b
        chi2[block] = (off * np.linalg.solve(covariance, off[..., None])[..., 0]).sum(axis=-1)
    return np.minimum(chi2, chi2.T)


def _apart(
    covariance: Float[np.ndarray, "rows freedom freedom"], at: Int[np.ndarray, " rows"], block: slice
) -> Float[np.ndarray, "block rows freedom freedom"]:
    """Noise of the odometry between a block of some poses of one robot and all of them."""
    sign = np.where(at[block, None] >= at[None], 1.0, -1.0)[..., None, None]
    return sign * (covariance[block, None] - covariance[None])


def _in_space(graph: PoseGraph) -> Float[np.ndarray, "edges 7"]:
    """Measurements as transforms in space."""
    return se3.lift(graph.z) if graph.freedom == 3 else graph.z


def _seen_from(
    T_a_b: Float[np.ndarray, "*n 7"], covariance: Float[np.ndarray, "*m freedom freedom"]
) -> Float[np.ndarray, "*k freedom freedom"]:
    """Covariance of a small motion in frame b as one in frame a: Ad C Ad^T."""
    R = se3.rotation_matrix(T_a_b[..., 3:])
    lever = se3.cross_matrix(T_a_b[..., :3]) @ R
    adjoint = np.concatenate(
        [np.concatenate([R, lever], axis=-1), np.concatenate([np.zeros_like(R), R], axis=-1)], axis=-2
    )
    if covariance.shape[-1] == 3:
        adjoint = adjoint[..., PLANAR, :][..., :, PLANAR]
    return adjoint @ covariance @ np.swapaxes(adjoint, -1, -2)
