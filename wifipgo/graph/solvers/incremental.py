"""Poses of every robot, solved anew whenever it learns something (paper Eq. 3, by iSAM2).

Kaess, Johannsson, Roberts, Ila, Leonard, Dellaert: iSAM2, IJRR 2012. Only what a new
measurement touches is solved again, so a step costs the same late in an episode as early.
"""

from itertools import accumulate, pairwise, starmap
from typing import NamedTuple

import gtsam
import numpy as np
from jaxtyping import Float, Int

from wifipgo.graph.anchor_bearings import NO_PINGS, Pings
from wifipgo.graph.bearings import Bearings, select_bearings
from wifipgo.graph.edges import Edges, select
from wifipgo.graph.solvers._factors import Models, add, add_bearings, between_factors, keys, told_factors
from wifipgo.graph.solvers._losses import geman_mcclure
from wifipgo.graph.solvers._problem import ANCHOR_SIGMA, REPORTED_SIGMA, odometry

# Variables of a world's robot r start at r times this: an episode has fewer iterations.
_KEYS_A_ROBOT = 1_000_000
_FIRST_POINT = 1_000_000_000_000  # places that others told come after all poses
_RELINEARISE = 0.05  # m, rad: a pose that moved further since is linearised anew
# Updates after another robot's graph came: its poses and one's own may both move far.
_SETTLING = 3


class SmootherUpdate(NamedTuple):
    """What is new to a robot.

    Attributes:
        robot: Which.
        held: Poses of each robot of its world that are part of its graph from now on: the first so many.
        between: Rows of the measurements between poses of the graph.
        told: Rows of those of poses outside it, which rest on what their robot told.
        removed: Numbers of measurements to drop, as returned before.
        heard: Rows of the directions of arrival between poses of the graph.
        pings: Bearings to places that others told.
        begin: Whether a new solver begins, so that all of this is all that it knows.
        use_qr: Whether that eliminates by QR, not by Cholesky's factors: half as fast, and twice the
            digits; and bounds the slope of bearings between poses that nearly coincide.
    """

    robot: int
    held: Int[np.ndarray, " peers"]
    between: Int[np.ndarray, " between"]
    told: Int[np.ndarray, " told"]
    removed: list[int]
    heard: Int[np.ndarray, " heard"]
    pings: Pings = NO_PINGS
    begin: bool = False
    use_qr: bool = False


class SmootherResult(NamedTuple):
    """What came of it.

    Attributes:
        numbers: Of the measurements that rest on what was told.
        poses: The robot's own.
        covariance: Of its last pose, in its own axes.
    """

    numbers: list[int]
    poses: Float[np.ndarray, "times 3"]
    covariance: Float[np.ndarray, "3 3"]


class Lesson(NamedTuple):
    """What the solvers learn in one iteration, with all that it takes to teach it again.

    Attributes:
        updates: One for each robot that learns something.
        starts: For each of them, where the search starts for the poses that are new to its graph: whose
            they are, the first index, and the poses.
        between: Measurements between poses of the graphs, update by update.
        told: Those of poses outside, update by update.
        heard: Directions of arrival, update by update.
    """

    updates: tuple[SmootherUpdate, ...]
    starts: tuple[tuple[tuple[int, int, Float[np.ndarray, "_ 3"]], ...], ...]
    between: Edges
    told: Edges
    heard: Bearings


def lesson_of(
    updates: list[SmootherUpdate],
    poses: Float[np.ndarray, "robots times 3"],
    edges: Edges,
    bearings: Bearings,
    held: Int[np.ndarray, "robots peers"],
) -> Lesson:
    """Take out of what is known what some updates name.

    Args:
        updates: One a robot.
        poses: Current estimates.
        edges: Measurements; no weight of those that are named is zero.
        bearings: Directions of arrival.
        held: Poses of each robot of its world that are part of each robot's graph so far.
    """
    return Lesson(
        updates=tuple(updates),
        starts=tuple(_starts(poses, new.robot, held[new.robot], new.held) for new in updates),
        between=select(edges, _joined([new.between for new in updates])),
        told=select(edges, _joined([new.told for new in updates])),
        heard=select_bearings(bearings, _joined([new.heard for new in updates])),
    )


def _starts(
    poses: Float[np.ndarray, "robots times 3"],
    own: int,
    before: Int[np.ndarray, " peers"],
    now: Int[np.ndarray, " peers"],
) -> tuple[tuple[int, int, Float[np.ndarray, "_ 3"]], ...]:
    """Poses that join a graph, of each peer."""
    base = own - own % len(now)
    return tuple(
        (peer, int(before[peer]), poses[base + peer, before[peer] : now[peer]].copy())
        for peer in np.flatnonzero(now > before).tolist()
    )


class IncrementalSmoothers:
    """One graph a robot, kept solved: its own measurements, and those that others sent."""

    def __init__(self, *, robust: bool) -> None:
        """Know nothing yet.

        Args:
            robust: Whether Huber's loss is on all measurements but odometry.
        """
        self._robust = robust
        self._models: Models = {}
        self._smoothers: dict[int, _IncrementalSmoother] = {}

    def learn(self, lesson: Lesson) -> list[SmootherResult | None]:
        """Let robots take in what is new to each, and solve.

        Solvers that learned the same lessons in the same order are the same, to the bit, whoever else
        learns beside them.

        Returns:
            What came of each update; nothing where it is singular to working precision. That robot's solver
            can learn nothing any more, and has to begin anew.
        """
        updates, n_peers = lesson.updates, len(lesson.updates[0].held)
        n_rows = max(new.robot for new in updates) + n_peers
        first_key = _KEYS_A_ROBOT * (np.arange(n_rows) % n_peers)
        doubted = ~odometry(lesson.between) & self._robust
        between_all = between_factors(lesson.between, first_key, doubted, self._models)
        sigma = np.broadcast_to(np.array(REPORTED_SIGMA), (len(lesson.told), 2))
        told_all = told_factors(lesson.told, sigma, first_key, doubted=self._robust)
        cuts = (_cuts([getattr(new, rows) for new in updates]) for rows in ("between", "told", "heard"))
        results: list[SmootherResult | None] = []
        for new, starts, inner, outer, heard in zip(updates, lesson.starts, *cuts, strict=True):
            if new.begin:
                self._smoothers[new.robot] = _IncrementalSmoother(
                    new.robot % n_peers, n_peers, use_qr=new.use_qr
                )
            smoother = self._smoothers[new.robot]
            try:
                numbers = smoother.learn(starts, new, between_all[inner], told_all[outer], first_key)
                if len(new.heard):
                    rows = np.arange(heard.start, heard.stop)
                    smoother.hear(select_bearings(lesson.heard, rows), first_key)
                results.append(SmootherResult(numbers, smoother.own(), smoother.covariance()))
            except RuntimeError:
                results.append(None)
        return results


def _cuts(rows: list[Int[np.ndarray, " _"]]) -> list[slice]:
    """Where each is when all are joined."""
    return list(starmap(slice, pairwise(accumulate(map(len, rows), initial=0))))


def _joined(rows: list[Int[np.ndarray, " _"]]) -> Int[np.ndarray, " all"]:
    return np.concatenate([np.zeros(0, dtype=np.int64), *rows])


class _IncrementalSmoother:
    """The graph of one robot."""

    def __init__(self, robot: int, n_peers: int, *, use_qr: bool) -> None:
        """Know nothing yet.

        Args:
            robot: Whose graph it is: its number in its own world.
            n_peers: Robots of a world.
            use_qr: Eliminate by QR.
        """
        self._robot, self._use_qr = robot, use_qr
        params = gtsam.ISAM2Params()
        params.setRelinearizeThreshold(_RELINEARISE)
        params.relinearizeSkip = 1
        params.setFactorization("QR" if use_qr else "CHOLESKY")
        self._isam = gtsam.ISAM2(params)
        self._n_points = 0
        self.held = np.zeros(n_peers, dtype=np.int64)

    def learn(
        self,
        starts: tuple[tuple[int, int, Float[np.ndarray, "_ 3"]], ...],
        news: SmootherUpdate,
        between: list[gtsam.NonlinearFactor],
        told: list[gtsam.NonlinearFactor],
        first_key: Int[np.ndarray, " rows"],
    ) -> list[int]:
        """Take in what is new, with its factors, and solve; numbers of the measurements in ``told``."""
        came = news.held > self.held
        others_came = int(np.count_nonzero(came)) > int(came[self._robot])
        graph, values = self._new_poses(starts)
        self._add_pings(graph, values, news.pings, first_key)
        add(graph, [*between, *told])
        result = self._isam.update(graph, values, news.removed)
        self.held = news.held
        self._settle(others_came)
        numbers: list[int] = result.getNewFactorsIndices()
        return numbers[len(numbers) - len(told) :]

    def hear(self, bearings: Bearings, first_key: Int[np.ndarray, " rows"]) -> None:
        """Add directions of arrival between poses of the graph, after its relative poses were solved for.

        A loss that lets go of what does not fit must not choose what it fits.
        """
        graph = gtsam.NonlinearFactorGraph()
        add_bearings(graph, bearings, first_key, near=self._use_qr)
        self._isam.update(graph, gtsam.Values())
        self._settle(True)

    def own(self) -> Float[np.ndarray, "times 3"]:
        """The robot's poses; keys come sorted, so those of robots before it come first."""
        first = int(self.held[: self._robot].sum())
        rows = gtsam.utilities.extractPose2(self._isam.calculateEstimate())
        own: np.ndarray = rows[first : first + int(self.held[self._robot])]
        return own

    def covariance(self) -> Float[np.ndarray, "3 3"]:
        """Covariance of the robot's last pose, in its own axes, (x_m, y_m, yaw_rad)."""
        last = _KEYS_A_ROBOT * self._robot + int(self.held[self._robot]) - 1
        found: np.ndarray = self._isam.marginalCovariance(last)
        return found

    def _new_poses(
        self, starts: tuple[tuple[int, int, Float[np.ndarray, "_ 3"]], ...]
    ) -> tuple[gtsam.NonlinearFactorGraph, gtsam.Values]:
        """Poses that join the graph; each robot knows its start."""
        graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
        for peer, begin, poses in starts:
            first = _KEYS_A_ROBOT * peer
            for index, pose in enumerate(poses.tolist(), begin):
                values.insert(first + index, pose2=gtsam.Pose2(*pose))
            if begin == 0:
                anchor = gtsam.noiseModel.Isotropic.Sigma(3, ANCHOR_SIGMA)
                graph.addPriorPose2(first, gtsam.Pose2(*poses[0].tolist()), anchor)
        return graph, values

    def _add_pings(
        self,
        graph: gtsam.NonlinearFactorGraph,
        values: gtsam.Values,
        pings: Pings,
        first_key: Int[np.ndarray, " rows"],
    ) -> None:
        """Bearings with Geman-McClure's loss to points that are known as well as they were told."""
        observers = keys(pings.observer, first_key)
        for i, azimuth_rad, sigma_rad, point_m, covariance_m2 in zip(observers, *pings[2:], strict=True):
            point, self._n_points = _FIRST_POINT + self._n_points, self._n_points + 1
            values.insert(point, point_m)
            graph.addPriorPoint2(point, point_m, gtsam.noiseModel.Gaussian.Covariance(covariance_m2))
            loss = geman_mcclure(sigma_rad)
            graph.add(gtsam.BearingFactor2D(i, point, gtsam.Rot2(azimuth_rad), loss))

    def _settle(self, others_came: bool) -> None:
        for _ in range(_SETTLING * others_came):
            self._isam.update()
