"""What each robot of a graph knows, and the order of their turns."""

import numpy as np
from jaxtyping import Int

from wifipgo.graph.chordal import Links, Poses, chosen, links
from wifipgo.graph.distributed.robot import Knowledge, Robot
from wifipgo.graph.posegraph import PoseGraph
from wifipgo.graph.subgraphs import held


def make_robots(
    graph: PoseGraph, start: Poses, fixed: Int[np.ndarray, " fixed"] | None = None
) -> list[Robot]:
    """Robots of a graph in the order of their turns, each with its own part of it; ``fixed`` poses stay."""
    edges, rows, order = links(graph), held(graph, fixed), turns(graph)
    return [Robot(_knowledge(graph, edges, start, rows, order[: k + 1])) for k in range(len(order))]


def turns(graph: PoseGraph) -> list[int]:
    """The first robot, then always the one that has most measurements with those before it.

    Of equals the one with the lowest number; each can so begin from what others have found.
    """
    used = graph.between_robots & (graph.weight > 0.0)
    robots = graph.robots
    ends = [np.searchsorted(robots, graph.robot[end[used]]) for end in (graph.tail, graph.head)]
    shared = np.zeros((len(robots), len(robots)), dtype=np.int64)
    np.add.at(shared, (ends[0], ends[1]), 1)
    shared += shared.T
    order = [0]
    while len(order) < len(robots):
        count = shared[order].sum(axis=0)
        count[order] = -1
        order.append(int(count.argmax()))
    return robots[order].tolist()


def _knowledge(
    graph: PoseGraph,
    edges: Links,
    start: Poses,
    fixed: Int[np.ndarray, " fixed"],
    so_far: list[int],
) -> Knowledge:
    """What is the own of the last robot so far: its poses, and the measurements that touch them."""
    *before, number = so_far
    own = np.flatnonzero(graph.robot == number)
    touching = chosen(edges, (graph.robot[edges.tail] == number) | (graph.robot[edges.head] == number))
    ends = np.concatenate([touching.tail, touching.head])
    separators = np.setdiff1d(ends, own)  # sorted, so grouped by robot
    rows = np.concatenate([own, separators])
    order = np.argsort(rows)
    local = [order[np.searchsorted(rows, end, sorter=order)] for end in (touching.tail, touching.head)]
    return Knowledge(
        number=number,
        start=Poses(start.R[own], start.t_m[own]),
        fixed=np.flatnonzero(np.isin(own, fixed)),
        links=touching._replace(tail=local[0], head=local[1]),
        separator_of=graph.robot[separators],
        told_to=_told_to(graph, touching, own, number),
        before=frozenset(before),
    )


def _told_to(
    graph: PoseGraph, touching: Links, own: Int[np.ndarray, " own"], number: int
) -> dict[int, Int[np.ndarray, " told"]]:
    """Own poses that each neighbour's measurements touch, in the order in which it expects them."""
    tail, head = graph.robot[touching.tail], graph.robot[touching.head]
    mine = np.where(tail == number, touching.tail, touching.head)
    other = np.where(tail == number, head, tail)
    neighbours = np.setdiff1d(other, [number])
    return {int(r): np.searchsorted(own, np.unique(mine[other == r])) for r in neighbours}
