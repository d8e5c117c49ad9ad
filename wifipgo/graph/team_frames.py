"""First poses of a team that knows nothing of where its robots began, though many of its loops may be wrong.

Each loop between two robots, with the odometry of both, proposes where the first pose of one is in the frame
of the other's first pose. Right proposals agree with each other within their noise, wrong ones each say
something else: that with which most agree is taken, as for the pairs of Kimera-Multi and dpgo. A tree of
robots along the pairs with most support then puts all of them into one frame.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order, connected_components, minimum_spanning_tree
from scipy.special import chdtri

from wifipgo import se2, se3
from wifipgo.arithmetic import harmless_underflow
from wifipgo.graph.outliers.pcm import CONFIDENCE, Chains, chain_odometry, pair_chi2, proposals
from wifipgo.graph.posegraph import PoseGraph


class Pairs(NamedTuple):
    """What loops say about two robots each, by number of the robot among those of the graph.

    Attributes:
        ends: The two robots, the lower number first.
        support: How many loops agree with the one that most agree with, itself included.
        T_a_b: First pose of the second in the frame of the first pose of the first, as that loop has it.
    """

    ends: Int[np.ndarray, "pairs 2"]
    support: Int[np.ndarray, " pairs"]
    T_a_b: Float[np.ndarray, "pairs dims"]


@harmless_underflow
def aligned_chains(graph: PoseGraph) -> Float[np.ndarray, "poses dims"]:
    """Each robot's odometry, chained; where the chains are to each other say the loops between robots.

    Of robots that loops lead to from each other, the one with the lowest number keeps its first pose. Loops
    within a robot are not looked at; over a gap in the odometry the graph's own poses lead.
    """
    space = se2 if graph.freedom == 3 else se3
    chains = chain_odometry(graph)
    _, first, of = np.unique(graph.robot, return_index=True, return_inverse=True)
    placed = _placed(graph.poses[first], _pairs(graph, chains, of))
    aligned: np.ndarray = space.compose(placed[of], chains.poses)
    return aligned


def _placed(first: Float[np.ndarray, "robots dims"], pairs: Pairs) -> Float[np.ndarray, "robots dims"]:
    """First poses of all robots, from the lowest of each group along the pairs with most support."""
    space, n, placed = (se2 if first.shape[1] == 3 else se3), len(first), first.copy()
    tree = minimum_spanning_tree(coo_array((-pairs.support.astype(float), tuple(pairs.ends.T)), shape=(n, n)))
    T = {(a, b): T_a_b for (a, b), T_a_b in zip(pairs.ends.tolist(), pairs.T_a_b, strict=True)}
    T |= {(b, a): space.inverse(T_a_b[None])[0] for (a, b), T_a_b in T.items()}
    roots = np.unique(connected_components(tree, directed=False)[1], return_index=True)[1]
    for root in roots.tolist():
        order, before = breadth_first_order(tree, root, directed=False)
        for b in order[1:].tolist():
            a = int(before[b])
            placed[b] = space.compose(placed[a][None], T[a, b][None])[0]
    return placed


def _pairs(graph: PoseGraph, chains: Chains, of: Int[np.ndarray, " poses"]) -> Pairs:
    """Votes of the loops between each two robots that have any."""
    rows = np.flatnonzero(graph.between_robots & (graph.weight > 0.0))
    both = np.sort(np.stack([of[graph.tail[rows]], of[graph.head[rows]]], axis=1), axis=1)
    ends, pair = np.unique(both, axis=0, return_inverse=True)
    limit = chdtri(graph.freedom, 1.0 - CONFIDENCE)
    support, best = np.zeros(len(ends), dtype=np.int64), np.zeros(len(ends), dtype=np.int64)
    for k in range(len(ends)):
        loops = rows[pair.ravel() == k]
        votes = (pair_chi2(graph, chains, loops) <= limit).sum(axis=1)
        support[k], best[k] = votes.max(), loops[votes.argmax()]
    return Pairs(ends, support, proposals(graph, chains, best).T_a_b)
