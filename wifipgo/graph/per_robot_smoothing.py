"""Each robot optimises what it knows at every iteration (estimator "every_step").

A robot knows what it measured, what it was told, and the graphs that it was sent when it
met others, as far as they went then. Robots with small graphs of plain squares solve side by side,
in bands; others keep an incremental solver warm.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from wifipgo.arithmetic import harmless_underflow
from wifipgo.graph.anchor_bearings import NO_PINGS, Pings
from wifipgo.graph.bearings import Bearings
from wifipgo.graph.config import GraphConfig
from wifipgo.graph.covariance import in_world_axes
from wifipgo.graph.edges import Edges
from wifipgo.graph.held_copies import graphs_of, grown, put_back
from wifipgo.graph.incremental_updates import updates_of
from wifipgo.graph.outliers.methods import OUTLIER_METHODS
from wifipgo.graph.smoother_updates import (
    BANDED,
    CAREFUL,
    INCREMENTAL,
    Known,
    Smoothing,
    after,
    learners,
    no_smoothing,
    stale_told,
)
from wifipgo.graph.solvers import THIRD_PARTY
from wifipgo.graph.solvers.incremental import IncrementalSmoothers, Lesson, lesson_of
from wifipgo.graph.solvers.own_graphs import solve_own_graphs
from wifipgo.threads import one_thread

# Poses of a graph beyond which the part that an incremental solver touches is smaller than a band.
MOST_IN_A_BAND = 160


class Smoothed(NamedTuple):
    """Where each robot thinks it was, and how well it knows where it is.

    Attributes:
        estimate: Poses of every robot, each by its own graph.
        covariance: Of the last poses, (x_m, y_m, yaw_rad) in world axes.
    """

    estimate: Float[np.ndarray, "rows times 3"]
    covariance: Float[np.ndarray, "rows 3 3"]


class PerRobotSmoothers:
    """How the robots solve, and the incremental solvers, kept warm: a cache of a `Smoothing`.

    Where they are not at the one that they are asked to go on from, they are made anew of its journal,
    and are then equal to the bit. A robot with nothing new but its own motion does not solve: what it
    dead-reckons from the optimum is the optimum. No robot's answer depends on who solves beside it.
    """

    def __init__(self, cfg: GraphConfig) -> None:
        """Know nothing yet."""
        self._cfg, method = cfg, OUTLIER_METHODS[cfg.outliers]
        self._robust, self._uses_told = method.loss == "huber", THIRD_PARTY[cfg.third_party]
        self._plain = method.loss == "none" and not method.bearings and not cfg.aoa_factors
        self._journal: tuple[Lesson, ...] | None = None
        self._smoothers = IncrementalSmoothers(robust=self._robust)

    def __reduce__(self) -> tuple[type["PerRobotSmoothers"], tuple[GraphConfig]]:
        """Travel between processes without the solvers, which are made anew where they are needed."""
        return PerRobotSmoothers, (self._cfg,)

    @one_thread
    @harmless_underflow
    def smoothed(
        self,
        smoothing: Smoothing,
        estimate: Float[np.ndarray, "rows times 3"],
        covariance: Float[np.ndarray, "rows 3 3"],
        *,
        edges: Edges,
        bearings: Bearings,
        sent: Int[np.ndarray, "rows peers"],
        pings: Pings = NO_PINGS,
    ) -> tuple[Smoothed, Smoothing]:
        """Let every robot solve for its own poses from all that it knows.

        Where not even QR has digits enough, a robot stays where it believes it is, as well as it knows it.

        Args:
            smoothing: What the solvers know. If the estimate is not one pose longer, they begin anew.
            estimate: Poses as the robots of all worlds believe them, the last one by odometry.
            covariance: Of the last poses, in world axes, by dead reckoning.
            edges: All measurements; each is known to the robot at its tail. Rows keep their places from
                call to call; new ones come last.
            bearings: All directions of arrival, in the same way.
            sent: How many poses of each peer of its world, with what was measured there, each robot was sent.
            pings: Directions of robots far away, and where these said they were; new ones come last.

        Returns:
            The poses, and what the solvers know then.
        """
        known = Known(estimate, covariance, edges, bearings, pings, sent)
        follows = estimate.shape[1] == smoothing.n_times + 1
        before = self._on_their_way(smoothing if follows else no_smoothing(*sent.shape), known)
        robots, solved = learners(before, known), Smoothed(estimate.copy(), covariance.copy())
        now = self._in_bands(before, known, robots[before.way[robots] == BANDED], solved)
        for way in (INCREMENTAL, CAREFUL):
            now = self._incrementally(now, known, robots[now.way[robots] == way], solved)
        return solved, now._replace(
            n_times=estimate.shape[1], n_edges=len(edges), n_pings=len(pings.observer), sent=sent
        )

    def _on_their_way(self, before: Smoothing, known: Known) -> Smoothing:
        """Robots whose graphs are not for a band any more begin anew with an incremental solver."""
        if before.sent is known.sent:
            return before
        leaves = before.way == BANDED
        if self._plain:
            leaves &= known.n_others().sum(axis=1) + known.estimate.shape[1] > MOST_IN_A_BAND
        return before.restarted(np.flatnonzero(leaves), INCREMENTAL) if leaves.any() else before

    def _in_bands(
        self, before: Smoothing, known: Known, robots: Int[np.ndarray, " robots"], solved: Smoothed
    ) -> Smoothing:
        """Let some robots solve for all that they know, at once; those whose search fails begin anew."""
        if not len(robots):
            return before
        copies = before.copies
        if known.sent is not before.sent:
            copies = grown(copies, known.n_others() * (before.way == BANDED)[:, None], known.estimate)
        graphs = graphs_of(copies, robots, known.estimate)
        low = solve_own_graphs(graphs, known.edges, uses_told=self._uses_told)
        copies, own = put_back(copies, graphs, low.poses)
        found = robots[low.settled]
        solved.estimate[found], solved.covariance[found] = own[low.settled], low.covariance[low.settled]
        anew = np.zeros(len(known.sent), dtype=bool)
        anew[robots] = True
        told = before.told.without(anew[before.told.robot])
        told = told.extended(robots[low.told_graph], low.told, np.full(len(low.told), -1), known.edges)
        now = before._replace(copies=copies, told=told)
        return now if low.settled.all() else now.restarted(robots[~low.settled], INCREMENTAL)

    def _incrementally(
        self, before: Smoothing, known: Known, robots: Int[np.ndarray, " robots"], solved: Smoothed
    ) -> Smoothing:
        """Let some robots' incremental solvers learn what is new; those that fail begin anew, carefully."""
        if not len(robots):
            return before
        stale = stale_told(before.told, known)
        news = updates_of(before, known, robots, stale, uses_told=self._uses_told)
        lesson = lesson_of(news, known.estimate, known.edges, known.bearings, before.held)
        smoothers, self._journal = self._standing_at(before.journal), None
        learned = list(zip(news, smoothers.learn(lesson), strict=True))
        self._journal = (*before.journal, lesson)
        for new, one in learned:
            if one is not None:
                solved.estimate[new.robot] = one.poses
                solved.covariance[new.robot] = in_world_axes(one.covariance[None], one.poses[-1:, 2])[0]
        now = after(before, known, learned, stale)._replace(journal=self._journal)
        failed = [new.robot for new, one in learned if one is None]
        return now.restarted(failed, CAREFUL) if failed else now

    def _standing_at(self, journal: tuple[Lesson, ...]) -> IncrementalSmoothers:
        """The incremental solvers, taught anew unless they are where they are asked to be."""
        if journal is not self._journal:
            self._smoothers = IncrementalSmoothers(robust=self._robust)
            for lesson in journal:
                self._smoothers.learn(lesson)
        return self._smoothers
