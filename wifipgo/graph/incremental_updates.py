"""What robots with an incremental solver learned since they last solved."""

import numpy as np
from jaxtyping import Bool, Int

from wifipgo.graph.anchor_bearings import select_pings
from wifipgo.graph.bearings import Bearings
from wifipgo.graph.edges import Edges
from wifipgo.graph.smoother_updates import CAREFUL, Known, Smoothing
from wifipgo.graph.solvers import NOTHING
from wifipgo.graph.solvers.incremental import SmootherUpdate


def updates_of(
    before: Smoothing,
    known: Known,
    robots: Int[np.ndarray, " robots"],
    stale: Bool[np.ndarray, " told"],
    *,
    uses_told: bool,
) -> list[SmootherUpdate]:
    """What some robots learned since each last solved, or all that it knows where it begins."""
    pings = select_pings(known.pings, np.arange(before.n_pings, len(known.pings.observer)))
    by_world = _rows_by_world(known.edges, known.sent.shape)
    return [
        _news_of(
            robot,
            before,
            known._replace(pings=pings),
            held=held,
            rows=by_world[robot // known.sent.shape[1]],
            gone=stale & (before.told.robot == robot),
            uses_told=uses_told,
        )
        for robot, held in zip(robots.tolist(), known.held(robots), strict=True)
    ]


def _rows_by_world(edges: Edges, shape: tuple[int, ...]) -> list[Int[np.ndarray, " rows"]]:
    """Measurements of each world, as they came."""
    world = edges.tail[:, 0] // shape[1]
    n_worlds = shape[0] // shape[1]
    order = np.arange(len(edges)) if n_worlds == 1 else world.argsort(kind="stable")
    return np.split(order, np.bincount(world, minlength=n_worlds).cumsum()[:-1])


def _news_of(
    robot: int,
    before: Smoothing,
    known: Known,
    *,
    held: Int[np.ndarray, " peers"],
    rows: Int[np.ndarray, " rows"],
    gone: Bool[np.ndarray, " told"],
    uses_told: bool,
) -> SmootherUpdate:
    """What one robot learned since it last solved."""
    edges, pings, had = known.edges, known.pings, before.held[robot]
    inner, outer = _new_rows(edges, rows, had, held, own=robot, since=int(before.since[robot]))
    changed = before.told.row[gone]
    outer = np.append(outer, changed[~_is_held(edges, changed, held)])[: None if uses_told else 0]
    inner, outer = (new[edges.weight[new] > NOTHING] for new in (inner, outer))
    begins = not had.any()
    return SmootherUpdate(
        robot=robot,
        held=held,
        between=inner,
        told=outer,
        removed=before.told.number[gone].tolist(),
        heard=_new_bearings(known.bearings, had, held, own=robot),
        pings=select_pings(pings, pings.observer[:, 0] == robot) if len(pings.observer) else pings,
        begin=begins,
        use_qr=bool(before.way[robot] == CAREFUL),
    )


def _is_held(
    edges: Edges, rows: Int[np.ndarray, " rows"], held: Int[np.ndarray, " peers"]
) -> Bool[np.ndarray, " rows"]:
    """Whose heads are part of a robot's graph."""
    head = edges.head[rows]
    inside: np.ndarray = head[:, 1] < held[head[:, 0] % len(held)]
    return inside


def _new_rows(
    edges: Edges,
    rows: Int[np.ndarray, " rows"],
    before: Int[np.ndarray, " peers"],
    now: Int[np.ndarray, " peers"],
    *,
    own: int,
    since: int,
) -> tuple[Int[np.ndarray, " inner"], Int[np.ndarray, " outer"]]:
    """Edges of a world that are new to a robot's graph: between its poses, and from them to poses outside.

    Its own came after the ``since`` edges of last time; if it was sent others', all are looked at.
    """
    if np.count_nonzero(now > before) <= 1:
        rows = rows[rows.searchsorted(since) :]
        rows = rows[edges.tail[rows, 0] == own]
        inside = _is_held(edges, rows, now)
        return rows[inside], rows[~inside]
    of, at = edges.tail[rows, 0] % len(now), edges.measured_at[rows]
    known, knew = at < now[of], at < before[of]
    inside = _is_held(edges, rows, now)
    was_inside = knew & _is_held(edges, rows, before)
    return rows[known & inside & ~was_inside], rows[known & ~inside & ~knew]


def _new_bearings(
    bearings: Bearings,
    before: Int[np.ndarray, " peers"],
    now: Int[np.ndarray, " peers"],
    *,
    own: int,
) -> Int[np.ndarray, " heard"]:
    """Bearings between poses that are part of a robot's graph by now, and were not before."""
    n = len(now)
    ours = np.flatnonzero(bearings.observer[:, 0] // n == own // n)
    ends = (bearings.observer[ours], bearings.target[ours])
    known, knew = (
        np.logical_and(*(end[:, 1] < held[end[:, 0] % n] for end in ends)) for held in (now, before)
    )
    return ours[known & ~knew]
