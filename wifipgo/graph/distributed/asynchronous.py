"""Robots that solve each at its own pace, with what has arrived by then: asynchronous block descent.

Tian, Koppel, Bedi, How: Asynchronous and Parallel Distributed Pose Graph Optimization, RA-L 2020; here with
steps of Gauss-Newton on each block. Nobody waits, there is no hub, and late or lost values do no harm but to
speed. What blocks leave, slow bends of the whole team, takes long: see `wifipgo.graph.distributed.two_level`.
"""

import heapq
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from wifipgo.arithmetic import harmless_underflow
from wifipgo.errors import require
from wifipgo.graph.distributed.channel import Channel, Message
from wifipgo.graph.distributed.parts import Part, Share, shares
from wifipgo.graph.posegraph import PoseGraph, normalised
from wifipgo.graph.residuals import chi_squares
from wifipgo.graph.solvers.linear_blocks import linear_blocks, stepped
from wifipgo.graph.solvers.starts import of_robots
from wifipgo.graph.subgraphs import held
from wifipgo.threads import one_thread

Rows = Float[np.ndarray, "poses dims"]
Rate = Callable[[int, int], float]
HALVINGS = 6  # of a step that does not lower a robot's own cost


@dataclass(frozen=True, slots=True, kw_only=True)
class AsynchronousConfig:
    """How long robots go on.

    Attributes:
        period_s: From one step of a robot to its next, the fastest; the slowest takes half as long again.
        horizon_s: When all stop.
    """

    period_s: float = 0.1
    horizon_s: float = 10.0

    def __post_init__(self) -> None:
        """Reject values that cannot mean anything."""
        for name in ("period_s", "horizon_s"):
            require(getattr(self, name) > 0.0, f"AsynchronousConfig.{name}", "> 0", getattr(self, name))


class AsynchronousReport(NamedTuple):
    """What the robots did.

    Attributes:
        steps: Of all robots together.
        bytes_sent: In all messages, those lost among them.
        n_lost: Messages that did not arrive.
        moved_m: How far anybody moved in its last step.
    """

    steps: int
    bytes_sent: int
    n_lost: int
    moved_m: float


@one_thread
@harmless_underflow
def solve_asynchronously(
    graph: PoseGraph,
    start: Rows | None = None,
    *,
    rate_mbit_s: Rate,
    fixed: Int[np.ndarray, " fixed"] | None = None,
    config: AsynchronousConfig | None = None,
    channel: Channel | None = None,
) -> tuple[Rows, AsynchronousReport]:
    """Poses after some time of robots that step and tell without waiting for each other.

    Args:
        graph: Poses and measurements.
        start: Where the search starts, see `wifipgo.graph.distributed.solve_two_level`.
        rate_mbit_s: Of the link from one robot to another: a message takes its bytes over it, and over none
            it does not arrive.
        fixed: Rows of poses that are known and stay, as does the first of each part without any.
        config: How long.
        channel: Counts what is sent, and may lose it.
    """
    config, channel = config or AsynchronousConfig(), channel or Channel()
    begin = of_robots(graph, fixed) if start is None else normalised(start)
    robots = [_Robot(graph, share, begin) for share in shares(graph, held(graph, fixed))]
    steps = _run(robots, rate_mbit_s, config, channel)
    rows = begin.copy()
    for robot in robots:
        rows[robot.share.own] = robot.own
    moved_m = max(robot.moved_m for robot in robots)
    return rows, AsynchronousReport(steps, channel.bytes_sent, channel.n_lost, moved_m)


def _run(robots: "list[_Robot]", rate: Rate, config: AsynchronousConfig, channel: Channel) -> int:
    """Let robots wake in the order of their clocks; how many steps they took."""
    of = {robot.share.number: robot for robot in robots}
    wakes = [(config.period_s * (k + 1) / len(robots), robot.share.number) for k, robot in enumerate(robots)]
    period_s = {
        number: config.period_s * (1.0 + 0.5 * k / len(robots)) for k, (_, number) in enumerate(wakes)
    }
    heapq.heapify(wakes)
    steps = 0
    while wakes[0][0] <= config.horizon_s:
        now_s, number = wakes[0]
        of[number].hear(now_s)
        of[number].step()
        for receiver, places in of[number].share.told_to.items():
            message = Message(number, "poses", steps, of[number].own[places][..., None])
            mbit_s = rate(number, receiver)
            if channel.send(receiver, message) and mbit_s > 0.0:
                of[receiver].inbox.append((now_s + 8e-6 * message.values.nbytes / mbit_s, message))
            channel.collect(receiver)
        steps += 1
        heapq.heapreplace(wakes, (now_s + period_s[number], number))
    return steps


class _Robot:
    """Its own poses, those of neighbours as it heard them last, and what is on its way to it."""

    def __init__(self, graph: PoseGraph, share: Share, begin: Rows) -> None:
        """Begin with the neighbours' starts, which everybody tells once."""
        near = np.concatenate([share.own, share.separators])
        order = np.argsort(near)
        rows, links = near[order], np.flatnonzero(share.links)
        self.share, self._near, self._order = share, near, order
        self._graph = PoseGraph(
            robot=graph.robot[rows],
            index=graph.index[rows],
            poses=begin[rows],
            tail=np.searchsorted(rows, graph.tail[links]),
            head=np.searchsorted(rows, graph.head[links]),
            z=graph.z[links],
            information=graph.information[links],
            weight=graph.weight[links],
        )
        self.own, self._told = begin[share.own].copy(), begin[share.separators].copy()
        self.inbox: list[tuple[float, Message]] = []
        self.moved_m = 0.0

    def hear(self, now_s: float) -> None:
        """Take what has arrived, the latest of each neighbour."""
        for due_s, message in self.inbox:
            if due_s <= now_s:
                self._told[self.share.heard_from[message.sender]] = message.values[..., 0]
        self.inbox = [(due_s, message) for due_s, message in self.inbox if due_s > now_s]

    def step(self) -> None:
        """One step on its own block, shorter while its own cost does not fall."""
        poses = np.concatenate([self.own, self._told])
        blocks = linear_blocks(self._graph, poses[self._order])
        rows = self._near[self._order]
        blocks = blocks._replace(tail=rows[blocks.tail], head=rows[blocks.head])
        part = Part(self.share, blocks, poses, (np.zeros(len(poses), dtype=np.int64), 1))
        twist = part.smoothed(part.g).reshape(len(self.own), -1)
        before, self.moved_m = self._cost(self.own), 0.0
        for share in 0.5 ** np.arange(HALVINGS):
            tried = stepped(self.own, share * twist)
            if self._cost(tried) < before:
                self.moved_m = float(np.linalg.norm(tried[:, :2] - self.own[:, :2], axis=1).max())
                self.own = tried
                return

    def _cost(self, own: Rows) -> float:
        """Chi-square of its own measurements."""
        poses = np.concatenate([own, self._told])
        return float(chi_squares(self._graph, poses[self._order]).sum())
