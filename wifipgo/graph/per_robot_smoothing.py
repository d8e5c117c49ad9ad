"""Each robot optimises what it knows at every iteration (estimator "every_step").

A robot knows what it measured, what it was told, and the graphs that it was sent when it
met others, as far as they went then.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from wifipgo.arithmetic import harmless_underflow
from wifipgo.graph.anchor_bearings import NO_PINGS, Pings
from wifipgo.graph.bearings import Bearings
from wifipgo.graph.config import GraphConfig
from wifipgo.graph.edges import Edges
from wifipgo.graph.outliers.methods import OUTLIER_METHODS
from wifipgo.graph.smoother_updates import Known, Smoothing, after, no_smoothing, updates_of
from wifipgo.graph.solvers import THIRD_PARTY
from wifipgo.graph.solvers.incremental import (
    IncrementalSmoothers,
    lesson_of,
)


class Smoothed(NamedTuple):
    """Where each robot thinks it was, and how well it knows where it is.

    Attributes:
        estimate: Poses of every robot, each by its own graph.
        covariance: Of the last poses, (x_m, y_m, yaw_rad) in world axes.
    """

    estimate: Float[np.ndarray, "robots times 3"]
    covariance: Float[np.ndarray, "robots 3 3"]


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
        known, n_robots = Known(estimate, covariance, edges, bearings, pings, sent), len(estimate)
        for use_qr in dict.fromkeys((smoothing.use_qr, True)):
            follows = use_qr == smoothing.use_qr and estimate.shape[1] == smoothing.n_times + 1
            try:
                return self._solved(smoothing if follows else no_smoothing(n_robots, use_qr=use_qr), known)
            except RuntimeError:  # singular to working precision: one kind of noise far below the other
                self._at = None
        return Smoothed(estimate.copy(), covariance.copy()), no_smoothing(n_robots, use_qr=True)

    def _solved(self, before: Smoothing, known: Known) -> tuple[Smoothed, Smoothing]:
        """Solve where something is new."""
        news = updates_of(before, known, uses_told=self._uses_told)
        lesson = lesson_of(news, known.estimate, known.edges, known.bearings, before.held)
        smoothers, self._at = self._standing_at(before), None
        results, covariances = smoothers.learn(lesson)
        robots = np.array([new.robot for new in news], dtype=np.int64)
        solved, covariance = known.estimate.copy(), known.covariance.copy()
        for new, one in zip(news, results, strict=True):
            solved[new.robot] = one.poses
        covariance[robots] = covariances
        self._at = after(before, known, news, results)._replace(journal=(*before.journal, lesson))
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
