"""Each robot optimises what it knows at every iteration (estimator "every_step").

A robot knows what it measured, what it was told, and the graphs that it was sent when it
met others, as far as they went then.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from wifipgo.graph import GUARDS, Bearings, Edges, Knowledge, Smoother
from wifipgo.rendezvous import RendezvousConfig


class Smoothed(NamedTuple):
    """Where each robot thinks it was, and how well it knows where it is.

    Attributes:
        estimate: Poses of every robot, each by its own graph.
        covariance: Of the last poses, in world axes.
    """

    estimate: Float[np.ndarray, "robots times 3"]
    covariance: Float[np.ndarray, "robots 3 3"]


class Memory:
    """The robots' solvers, kept warm from one iteration to the next.

    Nothing is known here that the arguments do not say: where they do not follow the last ones, the
    solvers begin anew.
    """

    def __init__(self, cfg: RendezvousConfig) -> None:
        """Know nothing yet."""
        self._cfg, self._n_times = cfg, 0
        self._smoothers: list[Smoother] = []

    def smoothed(
        self,
        estimate: Float[np.ndarray, "robots times 3"],
        edges: Edges,
        bearings: Bearings,
        sent: Int[np.ndarray, "robots robots"],
    ) -> Smoothed:
        """Let every robot solve for its own poses from all that it knows.

        Args:
            estimate: Poses as the robots believe them, the last one by odometry.
            edges: All measurements; each is known to the robot at its tail.
            bearings: All directions of arrival.
            sent: How many poses of robot j, with what was measured there, robot i was sent.
        """
        n, n_times = estimate.shape[:2]
        if n_times != self._n_times + 1 or n_times == 1:
            self._begin(n)
        self._n_times = n_times
        held = sent.copy()
        np.fill_diagonal(held, n_times)
        rows = _new_rows(edges, self._held, held, self._n_edges)
        solved, covariance = estimate.copy(), np.empty((n, 3, 3))
        for robot, smoother in enumerate(self._smoothers):
            heard = _new_bearings(bearings, self._held[robot], held[robot])
            knowledge = Knowledge(held[robot], rows[robot], heard)
            solved[robot] = smoother.learn(estimate, edges, bearings, knowledge)
            covariance[robot] = smoother.covariance()
        self._held, self._n_edges = held, len(edges)
        return Smoothed(solved, covariance)

    def _begin(self, n_robots: int) -> None:
        huber = GUARDS[self._cfg.outliers].loss == "huber"
        self._smoothers = [
            Smoother(robot, huber=huber, third_party=self._cfg.third_party) for robot in range(n_robots)
        ]
        self._held, self._n_edges = np.zeros((n_robots, n_robots), dtype=np.int64), 0


def _new_rows(
    edges: Edges,
    before: Int[np.ndarray, "robots robots"],
    now: Int[np.ndarray, "robots robots"],
    n_known: int,
) -> list[Int[np.ndarray, " rows"]]:
    """Rows of the edges that are new to each robot.

    Who was sent nothing looks only at the edges that came since, of which its own are new.
    """
    tail = edges.tail[n_known:, 0]
    order = np.argsort(tail, kind="stable")
    ends = np.searchsorted(tail[order], np.arange(len(now) + 1)).tolist()
    rows = [n_known + order[i:j] for i, j in zip(ends, ends[1:], strict=False)]
    for robot in np.flatnonzero(_was_sent(before, now)).tolist():
        of, at = edges.tail[:, 0], edges.measured_at
        rows[robot] = np.flatnonzero((at >= before[robot][of]) & (at < now[robot][of]))
    return rows


def _was_sent(
    before: Int[np.ndarray, "robots robots"], now: Int[np.ndarray, "robots robots"]
) -> Bool[np.ndarray, " robots"]:
    """Who has more of another robot's graph than before."""
    more = now > before
    np.fill_diagonal(more, val=False)
    sent: np.ndarray = more.any(axis=1)
    return sent


def _new_bearings(
    bearings: Bearings, before: Int[np.ndarray, " robots"], now: Int[np.ndarray, " robots"]
) -> Int[np.ndarray, " heard"]:
    """Rows of the bearings that are new to a robot: both ends are part of its graph, and were not."""
    ends = (bearings.observer, bearings.target)
    known = [np.logical_and(*(end[:, 1] < held[end[:, 0]] for end in ends)) for held in (before, now)]
    return np.flatnonzero(known[1] & ~known[0])
