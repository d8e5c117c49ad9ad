"""What each robot has still to learn: a value that the tick keeps, and what follows from it."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from wifipgo.graph.anchor_bearings import Pings
from wifipgo.graph.bearings import Bearings
from wifipgo.graph.edges import Edges
from wifipgo.graph.held_copies import Copies, no_copies
from wifipgo.graph.solvers import REPORTED_SIGMA
from wifipgo.graph.solvers.incremental import Lesson, SmootherResult, SmootherUpdate
from wifipgo.se2 import wrap_angle

# A told pose that changed by less, in standard deviations of told poses, is not worth solving again for.
_SAME_REPORT = 0.5
# How a robot solves: all that it knows at once, in a band, beside everybody else who does; by iSAM2; and by
# iSAM2 with QR, where digits are short.
BANDED, INCREMENTAL, CAREFUL = range(3)


class Told(NamedTuple):
    """What graphs rest on that others told: whose graph, which edge, the pose, its number in iSAM2."""

    robot: Int[np.ndarray, " told"]
    row: Int[np.ndarray, " told"]
    pose: Float[np.ndarray, "told 3"]
    number: Int[np.ndarray, " told"]

    def without(self, rows: Bool[np.ndarray, " told"]) -> "Told":
        """Those that are left."""
        return Told(*(column[~rows] for column in self))

    def extended(
        self,
        robot: Int[np.ndarray, " more"],
        row: Int[np.ndarray, " more"],
        number: Int[np.ndarray, " more"],
        edges: Edges,
    ) -> "Told":
        """Those and more, as they were told now."""
        both = zip(self, (robot, row, edges.reported_pose[row], number), strict=True)
        return Told(*(np.concatenate(pair) for pair in both))


_NONE = np.zeros(0, dtype=np.int64)
_NOTHING_TOLD = Told(_NONE, _NONE, np.zeros((0, 3)), _NONE)


class Smoothing(NamedTuple):
    """What the robots' solvers know, as a value: solvers that are kept warm are made of it.

    Attributes:
        n_times: Poses of each robot when they last solved; -1 if they have to begin anew.
        n_edges, n_pings: Measurements and pings there were then.
        told: What the graphs rest on that others told.
        sent: How many poses of each peer each robot had been sent.
        way: How each robot solves: `BANDED`, `INCREMENTAL` or `CAREFUL`. None goes back.
        copies: What robots that solve in a band make of others' poses.
        since: Measurements there were when each robot with an incremental solver last solved.
        held: Poses of each peer that are part of each incremental solver.
        journal: What the incremental solvers learned, iteration by iteration.
    """

    n_times: int
    n_edges: int
    n_pings: int
    told: Told
    sent: Int[np.ndarray, "rows peers"]
    way: Int[np.ndarray, " rows"]
    copies: Copies
    since: Int[np.ndarray, " rows"]
    held: Int[np.ndarray, "rows peers"]
    journal: tuple[Lesson, ...]

    def restarted(self, robots: Sequence[int] | Int[np.ndarray, " some"], way: int) -> "Smoothing":
        """What is known once some robots begin anew, each in another way."""
        ways, since, held = self.way.copy(), self.since.copy(), self.held.copy()
        ways[robots], since[robots], held[robots] = way, 0, 0
        told = self.told.without(np.isin(self.told.robot, robots))
        return self._replace(told=told, way=ways, since=since, held=held)


def no_smoothing(n_rows: int, n_peers: int | None = None) -> Smoothing:
    """Nothing is known yet; one world has as many peers as rows."""
    shape = (n_rows, n_peers or n_rows)
    none, nobody = np.zeros(shape, dtype=np.int32), np.zeros(n_rows, dtype=np.int64)
    way = np.full(n_rows, BANDED, dtype=np.int8)
    return Smoothing(-1, 0, 0, _NOTHING_TOLD, none, way, no_copies(*shape), nobody, none, ())


class Known(NamedTuple):
    """What the robots believe and measured when they solve."""

    estimate: Float[np.ndarray, "rows times 3"]
    covariance: Float[np.ndarray, "rows 3 3"]
    edges: Edges
    bearings: Bearings
    pings: Pings
    sent: Int[np.ndarray, "rows peers"]

    def held(self, robots: Int[np.ndarray, " some"]) -> Int[np.ndarray, "some peers"]:
        """Poses of each peer that robots have: their own all, of others what they were sent."""
        held = self.sent[robots].astype(np.int64)
        held[np.arange(len(robots)), robots % held.shape[1]] = self.estimate.shape[1]
        return held

    def n_others(self) -> Int[np.ndarray, "rows peers"]:
        """Poses of each other peer that each robot was sent."""
        n_rows, n_peers = self.sent.shape
        others = self.sent.copy()
        others[np.arange(n_rows), np.arange(n_rows) % n_peers] = 0
        return others


def learners(before: Smoothing, known: Known) -> Int[np.ndarray, " learners"]:
    """Robots to whom something is new but their own motion."""
    tail, head = known.edges.tail[before.n_edges :], known.edges.head[before.n_edges :]
    dirty = np.zeros(len(known.sent), dtype=bool)
    if known.sent is not before.sent:
        dirty = (known.sent != before.sent).any(axis=1)
    dirty[tail[(tail[:, 0] != head[:, 0]) | (head[:, 1] != tail[:, 1] + 1), 0]] = True
    dirty[before.told.robot[stale_told(before.told, known)]] = True
    dirty[known.pings.observer[before.n_pings :, 0]] = True
    return np.flatnonzero(dirty)


def stale_told(told: Told, known: Known) -> Bool[np.ndarray, " told"]:
    """What was told otherwise since, or is part of the graph by now."""
    apart = known.edges.reported_pose[told.row] - told.pose
    apart[:, 2] = wrap_angle(apart[:, 2])
    changed = (np.abs(apart) > _SAME_REPORT * np.array([REPORTED_SIGMA[0], *REPORTED_SIGMA])).any(axis=1)
    head = known.edges.head[told.row]
    inside: np.ndarray = head[:, 1] < known.sent[told.robot, head[:, 0] % known.sent.shape[1]]
    return changed | inside


def after(
    before: Smoothing,
    known: Known,
    learned: Sequence[tuple[SmootherUpdate, SmootherResult | None]],
    stale: Bool[np.ndarray, " told"],
) -> Smoothing:
    """What incremental solvers know after they learned; the journal is that of before."""
    since, held = before.since.copy(), before.held.copy()
    robots, rows, numbers = [_NONE], [_NONE], [_NONE]
    for new, one in learned:
        if one is not None:
            since[new.robot], held[new.robot] = len(known.edges), new.held
            robots.append(np.full(len(new.told), new.robot))
            rows.append(new.told)
            numbers.append(np.array(one.numbers, dtype=np.int64))
    gone = stale & np.isin(before.told.robot, [new.robot for new, _ in learned])
    robot, row, number = (np.concatenate(each) for each in (robots, rows, numbers))
    told = before.told.without(gone).extended(robot, row, number, known.edges)
    return before._replace(told=told, since=since, held=held)
