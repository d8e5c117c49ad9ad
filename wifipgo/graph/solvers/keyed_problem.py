"""A simulated team's problem as a graph with any keys, which knows more places to start from."""

import numpy as np
from jaxtyping import Float, Int

from wifipgo.graph.edges import Edges, select
from wifipgo.graph.posegraph import PoseGraph, pose_graph
from wifipgo.graph.solvers._problem import REPORTED_SIGMA, Problem
from wifipgo.graph.solvers.starts import STARTS


def keyed_problem(
    poses: Float[np.ndarray, "robots times 3"], edges: Edges, team: list[int], *, told: bool
) -> tuple[PoseGraph, Int[np.ndarray, " fixed"]]:
    """Graph of the participants, and the rows of the poses that stay.

    A told pose goes before its robot's own, so its index is negative, and no measurement of it looks like
    odometry. Noise of the measurement and of what was told both sit there.
    """
    inside = np.zeros(len(poses), dtype=bool)
    inside[team] = True
    taken = inside[edges.tail[:, 0]] & (edges.weight > 0.0)
    inner = select(edges, taken & inside[edges.head[:, 0]])
    outer = select(edges, taken & ~inside[edges.head[:, 0]] & told)
    outside = np.stack([outer.tail[:, 0], -1 - np.arange(len(outer))], axis=1)
    sigma = np.concatenate([inner.sigma, np.hypot(outer.sigma, np.array(REPORTED_SIGMA))])
    own = np.stack(np.meshgrid(team, np.arange(poses.shape[1]), indexing="ij"), axis=-1).reshape(-1, 2)
    keys = np.concatenate([own, outside])
    graph = pose_graph(
        robot=keys[:, 0],
        index=keys[:, 1],
        poses=np.concatenate([poses[team].reshape(-1, 3), outer.reported_pose]),
        tail=np.concatenate([inner.tail, outer.tail]),
        head=np.concatenate([inner.head, outside]),
        z=np.concatenate([inner.z, outer.z]),
        information=(1.0 / sigma[:, [0, 0, 1]] ** 2)[:, :, None] * np.eye(3),
        weight=np.concatenate([inner.weight, outer.weight]),
    )
    return graph, np.flatnonzero(graph.index <= 0)


def started(problem: Problem, edges: Edges, initial: str) -> Problem:
    """The problem of one group, to be searched from another start: a name in `STARTS`."""
    n_times = len(problem.start) // len(problem.team)
    poses = np.zeros((len(problem.first_key), n_times, 3))
    poses[problem.team] = problem.start.reshape(-1, n_times, 3)
    graph, known = keyed_problem(poses, select(edges, problem.rows), problem.team, told=True)
    own = np.flatnonzero(graph.index >= 0)
    found = STARTS[initial].rows(graph, np.union1d(known, own[problem.fixed]))
    return problem._replace(start=found[own])
