"""What each robot's smoother has still to learn: a value that the tick keeps, and what follows from it."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from wifipgo.graph.anchor_bearings import Pings, select_pings
from wifipgo.graph.bearings import Bearings
from wifipgo.graph.edges import Edges, select
from wifipgo.graph.solvers import NOTHING, REPORTED_SIGMA, odometry
from wifipgo.graph.solvers.incremental import Lesson, SmootherResult, SmootherUpdate
from wifipgo.se2 import wrap_angle

# A told pose that changed by less, in standard deviations of told poses, is not worth solving again for.
_SAME_REPORT = 0.5


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


class Known(NamedTuple):
    """What the robots believe and measured when they solve."""

    estimate: Float[np.ndarray, "robots times 3"]
    covariance: Float[np.ndarray, "robots 3 3"]
    edges: Edges
    bearings: Bearings
    pings: Pings
    sent: Int[np.ndarray, "robots robots"]


def after(
    before: Smoothing, known: Known, news: list[SmootherUpdate], results: list[SmootherResult]
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


def _held(known: Known) -> Int[np.ndarray, "robots robots"]:
    """Poses of robot j that robot i has: its own all, of others what it was sent."""
    held = known.sent.copy()
    np.fill_diagonal(held, known.estimate.shape[1])
    return held


def updates_of(before: Smoothing, known: Known, *, uses_told: bool) -> list[SmootherUpdate]:
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


def _stale(told: _Told, known: Known) -> Bool[np.ndarray, " told"]:
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
    known: Known,
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
