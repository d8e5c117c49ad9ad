"""A simulated team's poses (paper Eq. 3) solved by its robots themselves, over a counted channel."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from wifipgo.errors import pick, require
from wifipgo.graph.distributed import Channel, DistributedConfig, DistributedReport
from wifipgo.graph.distributed.robust import solve_reweighted
from wifipgo.graph.distributed.two_level import TwoLevelConfig, solve_two_level
from wifipgo.graph.edges import Edges
from wifipgo.graph.losses import LOSSES
from wifipgo.graph.solvers import THIRD_PARTY
from wifipgo.graph.solvers.keyed_problem import keyed_problem


def solve_by_robots(
    poses: Float[np.ndarray, "robots times 3"],
    edges: Edges,
    *,
    robots: Sequence[int],
    loss: str = "none",
    third_party: str = "fixed_told",
    config: DistributedConfig | TwoLevelConfig | None = None,
    channel: Channel | None = None,
) -> tuple[Float[np.ndarray, "robots times 3"], DistributedReport]:
    """Do what `wifipgo.graph.solve` does, without a computer that knows everything.

    First poses are known and stay, as do the poses that outsiders told: such a pose is one more of
    the robot that was told it.

    Args:
        poses: Current estimates, world frame: where a warm search starts.
        edges: All measurements; used are those that the participants took.
        robots: Who takes part.
        loss: A name in `wifipgo.graph.losses.LOSSES`, of all measurements but odometry.
        third_party: What an edge to a robot outside does, see `wifipgo.graph.solve`.
        config: How to iterate, and by which method: in two stages if left out.
        channel: Carries and counts the messages.

    Returns:
        New poses, those of other robots unchanged, and the report. Poses of a search that has not
        converged are no optimum.

    Raises:
        ValueError: ``robots`` names one twice or nobody, or an option is unknown.
    """
    team = sorted(robots)
    require(len(set(team)) == len(team) > 0, "robots", "one or more, each once", robots)
    pick(LOSSES, loss, "loss")
    graph, fixed = keyed_problem(
        poses, edges, team, told=pick(THIRD_PARTY, third_party, "third-party option")
    )
    config, channel = config or DistributedConfig(), channel or Channel()
    if isinstance(config, TwoLevelConfig):
        rows, report, _ = solve_two_level(graph, fixed=fixed, loss=loss, config=config, channel=channel)
    else:
        rows, report, _ = solve_reweighted(graph, loss=loss, fixed=fixed, config=config, channel=channel)
    own = graph.index >= 0
    solved = poses.copy()
    solved[graph.robot[own], graph.index[own]] = rows[own]
    solved[team, 0] = poses[team, 0]
    return solved, report
