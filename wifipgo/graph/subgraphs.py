"""Parts of a pose graph with any keys: grown, of some robots, connected."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from wifipgo.errors import require
from wifipgo.graph.edges import Edges
from wifipgo.graph.posegraph import PoseGraph, keys_of, pose_graph


def appended(graph: PoseGraph, more: PoseGraph) -> PoseGraph:
    """Let a graph grow: by the new poses and all measurements of ``more``.

    A pose that both have keeps its value in ``graph``, so an increment may carry the
    old poses that its measurements start from.
    """
    old, new = keys_of(graph), keys_of(more)
    known = {tuple(key) for key in old.tolist()}
    fresh = np.array([tuple(key) not in known for key in new.tolist()], dtype=bool)
    return pose_graph(
        robot=np.concatenate([graph.robot, more.robot[fresh]]),
        index=np.concatenate([graph.index, more.index[fresh]]),
        poses=np.concatenate([graph.poses, more.poses[fresh]]),
        tail=np.concatenate([old[graph.tail], new[more.tail]]),
        head=np.concatenate([old[graph.head], new[more.head]]),
        z=np.concatenate([graph.z, more.z]),
        information=np.concatenate([graph.information, more.information]),
        weight=np.concatenate([graph.weight, more.weight]),
    )


def of_robots(graph: PoseGraph, robots: Iterable[int]) -> PoseGraph:
    """The graph of one robot, a pair or more: their poses, and the measurements among these."""
    return of_poses(graph, np.isin(graph.robot, list(robots)))


def of_poses(graph: PoseGraph, kept: Bool[np.ndarray, " poses"]) -> PoseGraph:
    """Some of the poses, and the measurements among these."""
    row = np.cumsum(kept) - 1
    inside = kept[graph.tail] & kept[graph.head]
    return PoseGraph(
        robot=graph.robot[kept],
        index=graph.index[kept],
        poses=graph.poses[kept],
        tail=row[graph.tail[inside]],
        head=row[graph.head[inside]],
        z=graph.z[inside],
        information=graph.information[inside],
        weight=graph.weight[inside],
    )


def so_far(graph: PoseGraph, share: float) -> Bool[np.ndarray, " poses"]:
    """Which poses robots have when they have driven a share of theirs: the first of each at least."""
    _, first, count = np.unique(graph.robot, return_index=True, return_counts=True)
    rank = np.arange(len(graph.poses)) - np.repeat(first, count)
    return rank < np.maximum(np.ceil(share * np.repeat(count, count)), 1.0)


def cut_into_robots(graph: PoseGraph, n_robots: int) -> PoseGraph:
    """One robot's graph as that of a team: stretches of its trajectory, as long as each other, are robots.

    Poses keep their rows and numbers. The step from the last pose of a stretch to the first of the next is
    then between two robots, as loops may be.

    Raises:
        ValueError: There are several robots already, or fewer poses than robots.
    """
    require(len(graph.robots) == 1, "robots", "one, to be cut into several", len(graph.robots))
    n = len(graph.poses)
    require(1 <= n_robots <= n, "robots", f"in 1..{n}, the number of poses", n_robots)
    return replace(graph, robot=np.arange(n) * n_robots // n)


def of_edges(graph: PoseGraph, rows: Bool[np.ndarray, " edges"]) -> PoseGraph:
    """All poses, and some of the measurements."""
    columns = {name: getattr(graph, name)[rows] for name in ("tail", "head", "z", "information", "weight")}
    return replace(graph, **columns)


def components(graph: PoseGraph) -> Int[np.ndarray, " poses"]:
    """Number of the connected part that each pose is in, by measurements of positive weight.

    Parts are numbered by their first pose: part 0 holds pose 0.
    """
    n, used = len(graph.poses), graph.weight > 0.0
    ends = (graph.tail[used], graph.head[used])
    _, label = connected_components(coo_array((np.ones(used.sum()), ends), shape=(n, n)), directed=False)
    _, first, inverse = np.unique(label, return_index=True, return_inverse=True)
    return np.argsort(np.argsort(first))[inverse]


def anchors(graph: PoseGraph) -> Int[np.ndarray, " components"]:
    """First pose of each connected part: no measurement says where a part is, so these stay."""
    return np.unique(components(graph), return_index=True)[1]


def held(graph: PoseGraph, fixed: Int[np.ndarray, " fixed"] | None) -> Int[np.ndarray, " held"]:
    """Rows of poses that stay: those that are known, and first poses of parts where none is."""
    first = anchors(graph)
    if fixed is None:
        return first
    part = components(graph)
    return np.union1d(first[~np.isin(part[first], part[fixed])], fixed)


def from_team(poses: Float[np.ndarray, "robots times 3"], edges: Edges) -> PoseGraph:
    """The graph of a simulated team: pose ``times`` of every robot, and all measurements."""
    n_robots, times = poses.shape[:2]
    robot, index = np.indices((n_robots, times)).reshape(2, -1)
    precision = 1.0 / edges.sigma[:, [0, 0, 1]] ** 2
    return pose_graph(
        robot=robot,
        index=index,
        poses=poses.reshape(-1, 3),
        tail=edges.tail,
        head=edges.head,
        z=edges.z,
        information=precision[:, :, None] * np.eye(3),
        weight=edges.weight,
    )
