"""Two-stage distributed optimisation: rotations, then poses (paper reference [4]).

Choudhary, Carlone, Nieto, Rogers, Christensen, Dellaert: Distributed mapping with privacy and
communication constraints, IJRR 2017. Robots in turn solve for their own poses with their
neighbours' latest separators held (Gauss-Seidel), or all at once with those of the last round
(JOR, Jacobi over-relaxation).
"""

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from wifipgo.arithmetic import harmless_underflow
from wifipgo.graph.chordal import Poses, chordal_cost, links, matrices, pose_rows
from wifipgo.graph.distributed.agreement import Knows
from wifipgo.graph.distributed.channel import Channel
from wifipgo.graph.distributed.robot import Robot
from wifipgo.graph.distributed.rounds import DistributedConfig, Stage, run_stage, tell_all
from wifipgo.graph.distributed.team import make_robots
from wifipgo.graph.posegraph import PoseGraph, normalised
from wifipgo.threads import one_thread

_NOBODY: Mapping[int, float] = {}  # a plain table, which can go from process to process


class DistributedReport(NamedTuple):
    """What the robots did. Costs are chordal, see `wifipgo.graph.chordal`.

    Attributes:
        converged: Whether every stage ended by its threshold and every message that had to arrive did.
        rounds: Of each stage: rotations (not after a warm start), poses, and each refinement.
        cost_before: Of the start.
        cost_after: Of the result.
        bytes_sent: In all messages.
        n_messages: Messages sent, those lost among them.
        n_lost: Messages that did not arrive.
        order: Robots in the order of their turns.
        seconds: That each robot computed, by its number.
        held: What each robot knows at the end.
    """

    converged: bool
    rounds: tuple[int, ...]
    cost_before: float
    cost_after: float
    bytes_sent: int
    n_messages: int
    n_lost: int
    order: tuple[int, ...]
    seconds: Mapping[int, float] = _NOBODY
    held: tuple[Knows, ...] = ()


@one_thread
@harmless_underflow
def solve_distributed(
    graph: PoseGraph,
    start: Float[np.ndarray, "poses dims"] | None = None,
    *,
    fixed: Int[np.ndarray, " fixed"] | None = None,
    config: DistributedConfig | None = None,
    channel: Channel | None = None,
) -> tuple[Float[np.ndarray, "poses dims"], DistributedReport]:
    """Poses of nearly least chordal cost, by robots that each solve for their own.

    The first pose of each connected part stays. Whether a stage has ended is judged over all
    robots at once, as a base station would that hears one number from each; that is not counted.

    Args:
        graph: Poses and measurements; those of weight zero are dropped.
        start: Where the search starts; the graph's own poses if left out.
        fixed: Rows of poses that are known and stay, as does the first of each part without any.
        config: How to iterate.
        channel: Carries the messages; lossless and without delay if left out.

    Returns:
        Pose rows, and what the robots did. Where the report says that they have not
        converged, the rows are where they stopped, and no optimum.
    """
    config, channel = config or DistributedConfig(), channel or Channel()
    begin = matrices(graph.poses if start is None else normalised(start))
    robots = make_robots(graph, begin, fixed)
    stages = list(_stages(robots, channel, config))
    by_number = sorted(robots, key=lambda robot: robot.number)
    found = Poses(*(np.concatenate(part) for part in zip(*(r.estimate for r in by_number), strict=True)))
    edges = links(graph)
    report = DistributedReport(
        converged=all(stage.converged for stage in stages),
        rounds=tuple(stage.rounds for stage in stages),
        cost_before=chordal_cost(begin, edges),
        cost_after=chordal_cost(found, edges),
        bytes_sent=channel.bytes_sent,
        n_messages=channel.n_sent,
        n_lost=channel.n_lost,
        order=tuple(robot.number for robot in robots),
        seconds={robot.number: robot.record.seconds for robot in by_number},
        held=tuple(Knows(robot.knowledge, robot.estimate, robot.record.others) for robot in by_number),
    )
    return pose_rows(found), report


def _stages(robots: list[Robot], channel: Channel, config: DistributedConfig) -> Iterator[Stage]:
    """Rotations, then poses, then poses again; ends with the first stage whose robots cannot go on."""
    if not config.warm:
        for robot in robots:
            robot.begin_rotations()
        yield run_stage(robots, channel, config, first_round=2, most=1.0)
        for robot in robots:
            robot.end_rotations()
    for number in range(1 + config.refinements):
        for robot in robots:
            robot.offer_rotations(f"rotations for poses {number}")
        if not tell_all(robots, channel, config.max_rounds):
            yield Stage(0, converged=False)
            return
        warm = config.warm or number > 0
        for robot in robots:
            robot.begin_poses(f"poses {number}", warm=warm)
        heard = not warm or tell_all(robots, channel, config.max_rounds)
        most = 1.0 if number > 0 else 2.0
        stage = run_stage(robots, channel, config, first_round=1 if warm else 2, most=most)
        for robot in robots:
            robot.end_poses()
        yield stage._replace(converged=stage.converged and heard)
