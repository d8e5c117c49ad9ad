"""A simulated team's poses (paper Eq. 3) solved by its robots themselves, over a counted channel."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Int

from wifipgo.errors import pick, require
from wifipgo.graph.distributed import Channel, DistributedConfig, DistributedReport, solve_distributed
from wifipgo.graph.keyed import PoseGraph, pose_graph
from wifipgo.graph.posegraph import Edges, select
from wifipgo.graph.reweighted import solve_reweighted
from wifipgo.graph.solvers import THIRD_PARTY, TOLD_SIGMA

# Losses that robots can apply by themselves.
ROBUST_BY_ROBOTS = ("none", "huber", "gnc")


def solve_by_robots(
    poses: Float[np.ndarray, "robots times 3"],
    edges: Edges,
    *,
    robots: Sequence[int],
    loss: str = "none",
    third_party: str = "fixed_told",
    config: DistributedConfig | None = None,
    channel: Channel | None = None,
) -> tuple[Float[np.ndarray, "robots times 3"], DistributedReport]:
    """Do what `wifipgo.graph.solve` does, without a computer that knows everything.

    First poses are known and stay, as do the poses that outsiders told: such a pose is one more of
    the robot that was told it.

    Args:
        poses: Current estimates, world frame: where a warm search starts.
        edges: All measurements; used are those that the participants took.
        robots: Who takes part.
        loss: One of `ROBUST_BY_ROBOTS`, of all measurements but odometry.
        third_party: What an edge to a robot outside does, see `wifipgo.graph.solve`.
        config: How to iterate.
        channel: Carries and counts the messages.

    Returns:
        New poses, those of other robots unchanged, and the report. Poses of a search that has not
        converged are no optimum.

    Raises:
        ValueError: ``robots`` names one twice or nobody, or an option is unknown.
    """
    team = sorted(robots)
    require(len(set(team)) == len(team) > 0, "robots", "one or more, each once", robots)
    pick(dict.fromkeys(ROBUST_BY_ROBOTS), loss, "loss of the distributed method")
    graph, fixed = _graph(poses, edges, team, told=pick(THIRD_PARTY, third_party, "third-party option"))
    config, channel = config or DistributedConfig(), channel or Channel()
    if loss == "none":
        rows, report = solve_distributed(graph, fixed=fixed, config=config, channel=channel)
    else:
        rows, report, _ = solve_reweighted(graph, robust=loss, fixed=fixed, config=config, channel=channel)
    own = graph.index >= 0
    solved = poses.copy()
    solved[graph.robot[own], graph.index[own]] = rows[own]
    solved[team, 0] = poses[team, 0]
    return solved, report


def _graph(
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
    sigma = np.concatenate([inner.sigma, np.hypot(outer.sigma, np.array(TOLD_SIGMA))])
    own = np.stack(np.meshgrid(team, np.arange(poses.shape[1]), indexing="ij"), axis=-1).reshape(-1, 2)
    keys = np.concatenate([own, outside])
    graph = pose_graph(
        robot=keys[:, 0],
        index=keys[:, 1],
        poses=np.concatenate([poses[team].reshape(-1, 3), outer.told]),
        tail=np.concatenate([inner.tail, outer.tail]),
        head=np.concatenate([inner.head, outside]),
        z=np.concatenate([inner.z, outer.z]),
        information=(1.0 / sigma[:, [0, 0, 1]] ** 2)[:, :, None] * np.eye(3),
        weight=np.concatenate([inner.weight, outer.weight]),
    )
    return graph, np.flatnonzero(graph.index <= 0)
