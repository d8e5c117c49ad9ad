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
from wifipgo.graph.solvers import REPORTED_SIGMA, THIRD_PARTY, odometry
from wifipgo.graph.solvers._problem import NOTHING
from wifipgo.graph.solvers.incremental import (
    IncrementalSmoothers,
    Lesson,
    SmootherResult,
    SmootherUpdate,
    lesson_of,
)
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


class Smoothing(NamedTuple):
    """What the robots' solvers know, as a value: the solvers themselves are made of it.

    Attributes:
        n_times: Poses of each robot when they last solved; -1 if they have to begin anew.
        n_edges, n_pings: Measurements and pings there were then.
        told: What the graphs rest on that others told.
        sent: How many poses of robot j robot i had been sent.
        since: Measurements there were when each robot last solved.
        held: Poses of each robot that are part of each robot's graph.
        use_qr: Whether they eliminate by QR.
        journal: What they learned, iteration by iteration.
    """

    n_times: int
    n_edges: int
    n_pings: int
    told: _Told
    sent: Int[np.ndarray, "robots robots"]
    since: Int[np.ndarray, " robots"]
    held: Int[np.ndarray, "robots robots"]
    use_qr: bool
    journal: tuple[Lesson, ...]


def no_smoothing(n_robots: int, *, use_qr: bool = False) -> Smoothing:
    """Nothing is known yet."""
    none = np.zeros((n_robots, n_robots), dtype=np.int64)
    return Smoothing(-1, 0, 0, _NOTHING_TOLD, none, none[0], none, use_qr, ())


class _Known(NamedTuple):
    """What the robots believe and measured when they solve."""

    estimate: Float[np.ndarray, "robots times 3"]
    covariance: Float[np.ndarray, "robots 3 3"]
    edges: Edges
    bearings: Bearings
    pings: Pings
    sent: Int[np.ndarray, "robots robots"]


class PerRobotSmoothers:
    """The robots' solvers, kept warm from one iteration to the next: a cache of a `Smoothing`.

    Where they are not at the one that they are asked to go on from, they are made anew of its journal,
    and are then equal to the bit. A robot with nothing new but its own motion does not solve: what it
    dead-reckons from the optimum is the optimum.
    """

    def __init__(self, cfg: GraphConfig) -> None:
        """Know nothing yet."""
        self._cfg = cfg
        self._robust, self._uses_told = (
            OUTLIER_METHODS[cfg.outliers].loss == "huber",
            THIRD_PARTY[cfg.third_party],
        )
        self._at: Smoothing | None = None
        self._smoothers = IncrementalSmoothers(0, robust=self._robust)

    def __reduce__(self) -> tuple[type["PerRobotSmoothers"], tuple[GraphConfig]]:
        """Travel between processes without the solvers, which are made anew where they are needed."""
        return PerRobotSmoothers, (self._cfg,)

    @harmless_underflow
    def smoothed(
        self,
        smoothing: Smoothing,
        estimate: Float[np.ndarray, "robots times 3"],
        covariance: Float[np.ndarray, "robots 3 3"],
        *,
        edges: Edges,
        bearings: Bearings,
        sent: Int[np.ndarray, "robots robots"],
        pings: Pings = NO_PINGS,
    ) -> tuple[Smoothed, Smoothing]:
        """Let every robot solve for its own poses from all that it knows.

        Where not even QR has digits enough, they stay where they believe they are, as well as they know it.

        Args:
            smoothing: What the solvers know. If the estimate is not one pose longer, they begin anew.
            estimate: Poses as the robots believe them, the last one by odometry.
            covariance: Of the last poses, in world axes, by dead reckoning.
            edges: All measurements; each is known to the robot at its tail. Rows keep their places from
                call to call; new ones come last.
            bearings: All directions of arrival, in the same way.
            sent: How many poses of robot j, with what was measured there, robot i was sent.
            pings: Directions of robots far away, and where these said they were; new ones come last.

        Returns:
            The poses, and what the solvers know then.
        """
        known, n_robots = _Known(estimate, covariance, edges, bearings, pings, sent), len(estimate)
        for use_qr in dict.fromkeys((smoothing.use_qr, True)):
            follows = use_qr == smoothing.use_qr and estimate.shape[1] == smoothing.n_times + 1
            try:
                return self._solved(smoothing if follows else no_smoothing(n_robots, use_qr=use_qr), known)
            except RuntimeError:  # singular to working precision: one kind of noise far below the other
                self._at = None
        return Smoothed(estimate.copy(), covariance.copy()), no_smoothing(n_robots, use_qr=True)

    def _solved(self, before: Smoothing, known: _Known) -> tuple[Smoothed, Smoothing]:
        """Solve where something is new."""
        news = _news(before, known, uses_told=self._uses_told)
        lesson = lesson_of(news, known.estimate, known.edges, known.bearings, before.held)
        smoothers, self._at = self._standing_at(before), None
        results, covariances = smoothers.learn(lesson)
        robots = np.array([new.robot for new in news], dtype=np.int64)
        solved, covariance = known.estimate.copy(), known.covariance.copy()
        for new, one in zip(news, results, strict=True):
            solved[new.robot] = one.poses
        covariance[robots] = covariances
        self._at = _after(before, known, news, results)._replace(journal=(*before.journal, lesson))
        return Smoothed(solved, covariance), self._at

    def _standing_at(self, smoothing: Smoothing) -> IncrementalSmoothers:
        """The solvers, taught anew unless they are where they are asked to be."""
        if smoothing is not self._at:
            self._smoothers = IncrementalSmoothers(
                len(smoothing.held), robust=self._robust, use_qr=smoothing.use_qr
            )
            for lesson in smoothing.journal:
                self._smoothers.learn(lesson)
        return self._smoothers


def _after(
    before: Smoothing, known: _Known, news: list[SmootherUpdate], results: list[SmootherResult]
) -> Smoothing:
    """What the solvers know after they learned; the journal is that of before."""
    since, held = before.since.copy(), before.held.copy()
    for new in news:
        since[new.robot], held[new.robot] = len(known.edges), new.held
    stale = _stale(before.told, known)
    return before._replace(
        n_times=known.estimate.shape[1],
        n_edges=len(known.edges),
        n_pings=len(known.pings.observer),
        told=before.told.without(stale).extended(news, results, known.edges),
        sent=known.sent,
        since=since,
        held=held,
    )


def _held(known: _Known) -> Int[np.ndarray, "robots robots"]:
    """Poses of robot j that robot i has: its own all, of others what it was sent."""
    held = known.sent.copy()
    np.fill_diagonal(held, known.estimate.shape[1])
    return held


def _news(before: Smoothing, known: _Known, *, uses_told: bool) -> list[SmootherUpdate]:
    """What each robot learned since it last solved; nothing of one that only moved."""
    stale = _stale(before.told, known)
    recent = select(known.edges, np.arange(before.n_edges, len(known.edges)))
    pings = select_pings(known.pings, np.arange(before.n_pings, len(known.pings.observer)))
    dirty = (known.sent != before.sent).any(axis=1)
    dirty[recent.tail[~odometry(recent), 0]] = True
    dirty[before.told.robot[stale]] = True
    dirty[pings.observer[:, 0]] = True
    held = _held(known)
    return [
        _news_of(
            robot, before, known._replace(pings=pings), held=held[robot], stale=stale, uses_told=uses_told
        )
        for robot in np.flatnonzero(dirty).tolist()
    ]


def _stale(told: _Told, known: _Known) -> Bool[np.ndarray, " told"]:
    """What was told otherwise since, or is part of the graph by now."""
    apart = known.edges.reported_pose[told.row] - told.pose
    apart[:, 2] = wrap_angle(apart[:, 2])
    changed = (np.abs(apart) > _SAME_REPORT * np.array([REPORTED_SIGMA[0], *REPORTED_SIGMA])).any(axis=1)
    head = known.edges.head[told.row]
    inside: np.ndarray = head[:, 1] < _held(known)[told.robot, head[:, 0]]
    return changed | inside


def _news_of(
    robot: int,
    before: Smoothing,
    known: _Known,
    *,
    held: Int[np.ndarray, " robots"],
    stale: Bool[np.ndarray, " told"],
    uses_told: bool,
) -> SmootherUpdate:
    """What one robot learned since it last solved."""
    edges, pings, had = known.edges, known.pings, before.held[robot]
    inner, outer = _new_rows(edges, had, held, own=robot, since=int(before.since[robot]))
    gone = np.flatnonzero(stale & (before.told.robot == robot))
    changed = before.told.row[gone]
    outer = np.append(outer, changed[~_is_held(edges, changed, held)])[: None if uses_told else 0]
    inner, outer = (rows[edges.weight[rows] > NOTHING] for rows in (inner, outer))
    return SmootherUpdate(
        robot=robot,
        held=held,
        between=inner,
        told=outer,
        removed=before.told.number[gone].tolist(),
        heard=_new_bearings(known.bearings, had, held),
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
