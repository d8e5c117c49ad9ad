"""Each robot optimises what it knows at every iteration (estimator "every_step").

A robot knows what it measured, what it was told, and the graphs that it was sent when it
met others, as far as they went then.
"""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from wifipgo.arithmetic import harmless_underflow
from wifipgo.graph.anchor_bearings import NO_PINGS, Pings, select_pings
from wifipgo.graph.bearings import Bearings
from wifipgo.graph.config import GraphConfig
from wifipgo.graph.edges import Edges, select
from wifipgo.graph.outliers.methods import OUTLIER_METHODS
from wifipgo.graph.solvers import (
    REPORTED_SIGMA,
    THIRD_PARTY,
    IncrementalSmoothers,
    SmootherResult,
    SmootherUpdate,
    odometry,
)
from wifipgo.graph.solvers._problem import NOTHING
from wifipgo.se2 import wrap_angle

# A told pose that changed by less, in standard deviations of told poses, is not worth solving again for.
_SAME_REPORT = 0.5


class Smoothed(NamedTuple):
    """Where each robot thinks it was, and how well it knows where it is.

    Attributes:
        estimate: Poses of every robot, each by its own graph.
        covariance: Of the last poses, (x_m, y_m, yaw_rad) in world axes.
    """

    estimate: Float[np.ndarray, "robots times 3"]
    covariance: Float[np.ndarray, "robots 3 3"]


class _Told(NamedTuple):
    """What the graphs rest on that others told: whose graph, which edge, the pose, its number there."""

    robot: Int[np.ndarray, " told"]
    row: Int[np.ndarray, " told"]
    pose: Float[np.ndarray, "told 3"]
    number: Int[np.ndarray, " told"]

    def without(self, rows: Bool[np.ndarray, " told"]) -> "_Told":
        """Those that are left."""
        robot, row, pose, number = (column[~rows] for column in self)
        return _Told(robot, row, pose, number)

    def extended(self, news: list[SmootherUpdate], learned: list[SmootherResult], edges: Edges) -> "_Told":
        """Those and more."""
        robot = np.repeat(_numbers(new.robot for new in news), _numbers(len(new.told) for new in news))
        row = np.concatenate([_NONE, *(new.told for new in news)])
        number = _numbers(number for one in learned for number in one.numbers)
        both = zip(self, (robot, row, edges.reported_pose[row], number), strict=True)
        return _Told(*(np.concatenate(pair) for pair in both))


def _numbers(each: Iterable[int]) -> Int[np.ndarray, " each"]:
    return np.array(list(each), dtype=np.int64)


_NONE = np.zeros(0, dtype=np.int64)
_NOTHING_TOLD = _Told(_NONE, _NONE, np.zeros((0, 3)), _NONE)


class PerRobotSmoothers:
    """The robots' solvers, kept warm from one iteration to the next.

    Nothing is known here that the arguments do not say: where they do not follow the last ones, the
    solvers begin anew. A robot with nothing new but its own motion does not solve: what it dead-reckons
    from the optimum is the optimum.
    """

    def __init__(self, cfg: GraphConfig) -> None:
        """Know nothing yet."""
        self._robust, self._use_qr = OUTLIER_METHODS[cfg.outliers].loss == "huber", False
        self._uses_told = THIRD_PARTY[cfg.third_party]
        self._n_times, self._n_edges, self._n_pings, self._told = 0, 0, 0, _NOTHING_TOLD
        self._sent, self._since = np.zeros((0, 0), dtype=np.int64), np.zeros(0, dtype=np.int64)
        self._smoothers = IncrementalSmoothers(0, robust=self._robust)

    @harmless_underflow
    def smoothed(
        self,
        estimate: Float[np.ndarray, "robots times 3"],
        covariance: Float[np.ndarray, "robots 3 3"],
        *,
        edges: Edges,
        bearings: Bearings,
        sent: Int[np.ndarray, "robots robots"],
        pings: Pings = NO_PINGS,
    ) -> Smoothed:
        """Let every robot solve for its own poses from all that it knows.

        Where not even QR has digits enough, they stay where they believe they are, as well as they know it.

        Args:
            estimate: Poses as the robots believe them, the last one by odometry.
            covariance: Of the last poses, in world axes, by dead reckoning.
            edges: All measurements; each is known to the robot at its tail. Rows keep their places from
                call to call; new ones come last.
            bearings: All directions of arrival, in the same way.
            sent: How many poses of robot j, with what was measured there, robot i was sent.
            pings: Directions of robots far away, and where these said they were; new ones come last.
        """
        measured = (edges, bearings, pings)
        for use_qr in dict.fromkeys((self._use_qr, True)):
            self._use_qr = use_qr
            try:
                return self._solved(estimate, covariance, measured, sent)
            except RuntimeError:  # singular to working precision: one kind of noise far below the other
                self._n_times = -1
        return Smoothed(estimate.copy(), covariance.copy())

    def _solved(
        self,
        estimate: Float[np.ndarray, "robots times 3"],
        covariance: Float[np.ndarray, "robots 3 3"],
        measured: tuple[Edges, Bearings, Pings],
        sent: Int[np.ndarray, "robots robots"],
    ) -> Smoothed:
        """Solve, anew if what is known does not follow what was."""
        edges, bearings, pings = measured
        n, n_times = estimate.shape[:2]
        if n_times != self._n_times + 1 or n_times == 1:
            self._begin(n)
        held = sent.copy()
        np.fill_diagonal(held, n_times)
        stale = self._stale(edges, held)
        dirty = (sent != self._sent).any(axis=1)
        recent = select(edges, np.arange(self._n_edges, len(edges)))
        dirty[recent.tail[~odometry(recent), 0]] = True
        dirty[self._told.robot[stale]] = True
        new_pings = select_pings(pings, np.arange(self._n_pings, len(pings.observer)))
        dirty[new_pings.observer[:, 0]] = True
        robots = np.flatnonzero(dirty)
        news = [
            self._news(robot, (edges, bearings, new_pings), held=held[robot], stale=stale)
            for robot in robots.tolist()
        ]
        learned, known = self._smoothers.learn(estimate, edges, bearings, news)
        solved, covariance = estimate.copy(), covariance.copy()
        for new, one in zip(news, learned, strict=True):
            solved[new.robot] = one.poses
        covariance[robots] = known
        self._told = self._told.without(stale).extended(news, learned, edges)
        self._since[robots] = len(edges)
        self._n_times, self._n_edges, self._sent = n_times, len(edges), sent
        self._n_pings = len(pings.observer)
        return Smoothed(solved, covariance)

    def _begin(self, n_robots: int) -> None:
        self._smoothers = IncrementalSmoothers(n_robots, robust=self._robust, use_qr=self._use_qr)
        self._sent = np.zeros((n_robots, n_robots), dtype=np.int64)
        self._n_pings = 0
        self._n_edges, self._since = 0, np.zeros(n_robots, dtype=np.int64)
        self._told = _NOTHING_TOLD

    def _stale(self, edges: Edges, held: Int[np.ndarray, "robots robots"]) -> Bool[np.ndarray, " told"]:
        """What was told otherwise since, or is part of the graph by now."""
        apart = edges.reported_pose[self._told.row] - self._told.pose
        apart[:, 2] = wrap_angle(apart[:, 2])
        changed = (np.abs(apart) > _SAME_REPORT * np.array([REPORTED_SIGMA[0], *REPORTED_SIGMA])).any(axis=1)
        head = edges.head[self._told.row]
        inside: np.ndarray = head[:, 1] < held[self._told.robot, head[:, 0]]
        return changed | inside

    def _news(
        self,
        robot: int,
        measured: tuple[Edges, Bearings, Pings],
        *,
        held: Int[np.ndarray, " robots"],
        stale: Bool[np.ndarray, " told"],
    ) -> SmootherUpdate:
        """What a robot learned since it last solved."""
        (edges, bearings, pings), before = measured, self._smoothers.held(robot)
        inner, outer = _new_rows(edges, before, held, own=robot, since=int(self._since[robot]))
        gone = np.flatnonzero(stale & (self._told.robot == robot))
        changed = self._told.row[gone]
        outer = np.append(outer, changed[~_is_held(edges, changed, held)])[: None if self._uses_told else 0]
        inner, outer = (rows[edges.weight[rows] > NOTHING] for rows in (inner, outer))
        return SmootherUpdate(
            robot=robot,
            held=held,
            between=inner,
            told=outer,
            removed=self._told.number[gone].tolist(),
            heard=_new_bearings(bearings, before, held),
            pings=select_pings(pings, pings.observer[:, 0] == robot) if len(pings.observer) else pings,
        )


def _is_held(
    edges: Edges, rows: Int[np.ndarray, " rows"], held: Int[np.ndarray, " robots"]
) -> Bool[np.ndarray, " rows"]:
    """Whose heads are part of a robot's graph."""
    head = edges.head[rows]
    inside: np.ndarray = head[:, 1] < held[head[:, 0]]
    return inside


def _new_rows(
    edges: Edges,
    before: Int[np.ndarray, " robots"],
    now: Int[np.ndarray, " robots"],
    *,
    own: int,
    since: int,
) -> tuple[Int[np.ndarray, " inner"], Int[np.ndarray, " outer"]]:
    """Edges that are new to a robot's graph: between its poses, and from them to poses outside.

    Its own came after the ``since`` edges of last time; if it was sent others', all are looked at.
    """
    if np.count_nonzero(now > before) <= 1:
        rows = since + np.flatnonzero(edges.tail[since:, 0] == own)
        inside = _is_held(edges, rows, now)
        return rows[inside], rows[~inside]
    rows, of, at = np.arange(len(edges)), edges.tail[:, 0], edges.measured_at
    known, knew = at < now[of], at < before[of]
    inside = _is_held(edges, rows, now)
    was_inside = knew & _is_held(edges, rows, before)
    return rows[known & inside & ~was_inside], rows[known & ~inside & ~knew]


def _new_bearings(
    bearings: Bearings, before: Int[np.ndarray, " robots"], now: Int[np.ndarray, " robots"]
) -> Int[np.ndarray, " heard"]:
    """Bearings between poses that are part of a robot's graph by now, and were not before."""
    if not len(bearings):
        return np.zeros(0, dtype=np.int64)
    ends = (bearings.observer, bearings.target)
    known, knew = (np.logical_and(*(end[:, 1] < held[end[:, 0]] for end in ends)) for held in (now, before))
    return np.flatnonzero(known & ~knew)
