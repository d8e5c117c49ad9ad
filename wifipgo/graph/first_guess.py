"""First poses of a graph that has measurements only: along a tree of them, odometry before all others."""

import numpy as np
from jaxtyping import Float, Int
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import breadth_first_order, minimum_spanning_tree

from wifipgo import se2, se3
from wifipgo.graph.posegraph import PoseGraph
from wifipgo.graph.subgraphs import anchors


def first_guess(
    graph: PoseGraph, known: Int[np.ndarray, " known"] | None = None
) -> Float[np.ndarray, "poses dims"]:
    """Poses that one measurement a pose leads to, from the nearest of those that are known.

    These stay where they are in ``graph``. The tree takes as few measurements as it can that are not
    odometry, and of these as few as it can between robots: what closes a loop may be wrong.

    Args:
        graph: Measurements, and where the parts begin.
        known: Rows of poses that are known, one or more in each part; the first of each if left out.
    """
    space = se2 if graph.freedom == 3 else se3
    rows, edge = graph.poses.copy(), _measurement_between(graph)
    tree = _tree(graph, edge, anchors(graph) if known is None else known)
    order, before = breadth_first_order(tree, len(rows), directed=False)
    for row in order[1:].tolist():
        last = int(before[row])
        if last < len(rows):
            ends = (last, row) if (last, row) in edge else (row, last)
            z = graph.z[[edge[ends]]]
            rows[[row]] = space.compose(rows[[last]], z if ends[0] == last else space.inverse(z))
    return rows


def _cost(graph: PoseGraph) -> Int[np.ndarray, " edges"]:
    """1 for odometry, 2 for what a robot measured of itself, 3 for the rest."""
    return np.where(graph.odometry, 1, np.where(graph.between_robots, 3, 2))


def _measurement_between(graph: PoseGraph) -> dict[tuple[int, int], int]:
    """The cheapest measurement of each pair of poses, in either direction."""
    best: dict[tuple[int, int], int] = {}
    for k in np.argsort(_cost(graph), kind="stable").tolist():
        tail, head = int(graph.tail[k]), int(graph.head[k])
        if graph.weight[k] > 0.0 and (head, tail) not in best:
            best.setdefault((tail, head), k)
    return best


def _tree(graph: PoseGraph, edge: dict[tuple[int, int], int], known: Int[np.ndarray, " known"]) -> csr_array:
    """Pairs of poses that lead everywhere at the least cost, from a root that leads to the known ones."""
    n, ends = len(graph.poses), np.array(list(edge), dtype=np.int64).reshape(-1, 2)
    ends = np.concatenate([ends, np.stack([np.full(len(known), n), known], axis=1)])
    cost = np.concatenate([_cost(graph)[list(edge.values())], np.full(len(known), 0.5)])
    return minimum_spanning_tree(coo_array((cost, (ends[:, 0], ends[:, 1])), shape=(n + 1, n + 1)))
