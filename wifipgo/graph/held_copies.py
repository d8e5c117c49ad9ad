"""What each robot makes of the poses that others sent it: copies, flat, of as many as it holds."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from wifipgo.graph.solvers.own_graphs import OwnGraphs


class Copies(NamedTuple):
    """Copies of others' poses, robot by robot and peer by peer.

    Attributes:
        held: How many of the first poses of each peer of its world each robot holds; none of its own.
        poses: The copies.
    """

    held: Int[np.ndarray, "rows peers"]
    poses: Float[np.ndarray, "copies 3"]


def no_copies(n_rows: int, n_peers: int) -> Copies:
    """Nobody was sent anything."""
    return Copies(np.zeros((n_rows, n_peers), dtype=np.int32), np.zeros((0, 3)))


def grown(
    copies: Copies, held: Int[np.ndarray, "rows peers"], estimate: Float[np.ndarray, "rows times 3"]
) -> Copies:
    """Copies of more poses, the new ones as their robots have them; or of fewer."""
    if np.array_equal(held, copies.held):
        return copies
    now, before, n_peers = held.ravel(), copies.held.ravel(), held.shape[1]
    of, k = np.arange(len(now)).repeat(now), _counted(now)
    peer = of // n_peers // n_peers * n_peers + of % n_peers
    poses, old = estimate[peer, k], k < before[of]
    poses[old] = copies.poses[(before.cumsum() - before)[of[old]] + k[old]]
    return Copies(held.astype(np.int32), poses)


def graphs_of(
    copies: Copies, robots: Int[np.ndarray, " graphs"], estimate: Float[np.ndarray, "rows times 3"]
) -> OwnGraphs:
    """What some robots know, searched from where they and their copies are."""
    held = copies.held[robots].astype(np.int64)
    held[np.arange(len(robots)), robots % held.shape[1]] = estimate.shape[1]
    graphs = OwnGraphs(robots, held, np.empty((int(held.sum()), 3)))
    own = graphs.own
    graphs.start[own] = estimate[robots].reshape(-1, 3)
    if len(copies.poses):
        graphs.start[~own] = copies.poses[_places(copies, robots)]
    return graphs


def put_back(
    copies: Copies, graphs: OwnGraphs, poses: Float[np.ndarray, "poses 3"]
) -> tuple[Copies, Float[np.ndarray, "graphs times 3"]]:
    """Copies, and robots' own poses, as they were solved for."""
    own, solved = graphs.own, copies.poses
    if len(solved):
        solved = solved.copy()
        solved[_places(copies, graphs.robot)] = poses[~own]
    return copies._replace(poses=solved), poses[own].reshape(len(graphs.robot), -1, 3)


def _places(copies: Copies, robots: Int[np.ndarray, " graphs"]) -> Int[np.ndarray, " some"]:
    """Where the copies of some robots are."""
    n_each = copies.held.sum(axis=1, dtype=np.int64)
    begin = (n_each.cumsum() - n_each)[robots]
    return begin.repeat(n_each[robots]) + _counted(n_each[robots])


def _counted(n_each: Int[np.ndarray, " runs"]) -> Int[np.ndarray, " all"]:
    """0, 1, 2, ... of each run."""
    ends = n_each.cumsum()
    return np.arange(int(n_each.sum())) - (ends - n_each).repeat(n_each)
