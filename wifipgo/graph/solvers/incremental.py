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
from wifipgo.graph.covariance import in_world_axes
from wifipgo.graph.edges import Edges, select
from wifipgo.graph.solvers._factors import Models, add, add_bearings, between_factors, keys, told_factors
from wifipgo.graph.solvers._losses import geman_mcclure
from wifipgo.graph.solvers._problem import ANCHOR_SIGMA, REPORTED_SIGMA, odometry

# Variables of robot r start at r times this: an episode has fewer iterations.
_KEYS_A_ROBOT = 1_000_000
_FIRST_POINT = 1_000_000_000_000  # places that others told come after all poses
_RELINEARISE = 0.05  # m, rad: a pose that moved further since is linearised anew
# Updates after another robot's graph came: its poses and one's own may both move far.
_SETTLING = 3


class SmootherUpdate(NamedTuple):
    """What is new to a robot.

    Attributes:
        robot: Which.
        held: Poses of each robot that are part of its graph from now on: the first so many.
        between: Rows of the measurements between poses of the graph.
        told: Rows of those of poses outside it, which rest on what their robot told.
        removed: Numbers of measurements to drop, as returned before.
        heard: Rows of the directions of arrival between poses of the graph.
        pings: Bearings to places that others told.
    """

    robot: int
    held: Int[np.ndarray, " robots"]
    between: Int[np.ndarray, " between"]
    told: Int[np.ndarray, " told"]
    removed: list[int]
    heard: Int[np.ndarray, " heard"]
    pings: Pings = NO_PINGS


class SmootherResult(NamedTuple):
    """What came of it: numbers of the measurements that rest on what was told, and the robot's own poses."""

    numbers: list[int]
    poses: Float[np.ndarray, "times 3"]


class IncrementalSmoothers:
    """One graph a robot, kept solved: its own measurements, and those that others sent."""

    def __init__(self, n_robots: int, *, robust: bool, use_qr: bool = False) -> None:
        """Know nothing yet.

        Args:
            n_robots: How many there are.
            robust: Whether Huber's loss is on all measurements but odometry.
            use_qr: Eliminate by QR, not by Cholesky's factors: half as fast, and twice the digits; and
                bound the slope of bearings between poses that nearly coincide.
        """
        self._robust = robust
        self._models: Models = {}
        self._first_key = _KEYS_A_ROBOT * np.arange(n_robots)
        self._smoothers = [
            _IncrementalSmoother(robot, self._first_key, use_qr=use_qr) for robot in range(n_robots)
        ]

    def held(self, robot: int) -> Int[np.ndarray, " robots"]:
        """Poses of each robot that are part of a robot's graph."""
        return self._smoothers[robot].held

    def learn(
        self,
        poses: Float[np.ndarray, "robots times 3"],
        edges: Edges,
        bearings: Bearings,
        news: list[SmootherUpdate],
    ) -> tuple[list[SmootherResult], Float[np.ndarray, "news 3 3"]]:
        """Let robots take in what is new to each, and solve.

        Args:
            poses: Current estimates: where the search starts for poses that are new to a graph.
            edges: Measurements; no weight in the news is zero.
            bearings: Directions of arrival.
            news: One entry a robot.

        Returns:
            What each learned, and the covariances of their last poses, in world axes.

        Raises:
            RuntimeError: Singular to working precision; nothing can be learned any more.
        """
        between = select(edges, _joined([new.between for new in news]))
        told = select(edges, _joined([new.told for new in news]))
        doubted = ~odometry(between) & self._robust
        between_all = between_factors(between, self._first_key, doubted, self._models)
        sigma = np.broadcast_to(np.array(REPORTED_SIGMA), (len(told), 2))
        told_all = told_factors(told, sigma, self._first_key, doubted=self._robust)
        cuts = (_cuts([new.between for new in news]), _cuts([new.told for new in news]))
        learned, own_axes = [], np.zeros((len(news), 3, 3))
        for k, (new, inner, outer) in enumerate(zip(news, *cuts, strict=True)):
            smoother = self._smoothers[new.robot]
            numbers = smoother.learn(poses, new, between_all[inner], told_all[outer])
            if len(new.heard):
                smoother.hear(select_bearings(bearings, new.heard))
            learned.append(SmootherResult(numbers, smoother.own()))
            own_axes[k] = smoother.covariance()
        yaw_rad = np.array([one.poses[-1, 2] for one in learned])
        return learned, in_world_axes(own_axes, yaw_rad)


def _cuts(rows: list[Int[np.ndarray, " _"]]) -> list[slice]:
    """Where each is when all are joined."""
    return list(starmap(slice, pairwise(accumulate(map(len, rows), initial=0))))


def _joined(rows: list[Int[np.ndarray, " _"]]) -> Int[np.ndarray, " all"]:
    return np.concatenate([np.zeros(0, dtype=np.int64), *rows])


class _IncrementalSmoother:
    """The graph of one robot."""

    def __init__(self, robot: int, first_key: Int[np.ndarray, " robots"], *, use_qr: bool) -> None:
        """Know nothing yet.

        Args:
            robot: Whose graph it is.
            first_key: Variables of the robots' first poses.
            use_qr: Eliminate by QR.
        """
        self._robot, self._first_key, self._use_qr = robot, first_key, use_qr
        params = gtsam.ISAM2Params()
        params.setRelinearizeThreshold(_RELINEARISE)
        params.relinearizeSkip = 1
        params.setFactorization("QR" if use_qr else "CHOLESKY")
        self._isam = gtsam.ISAM2(params)
        self._n_points = 0
        self.held = np.zeros(len(first_key), dtype=np.int64)

    def learn(
        self,
        poses: Float[np.ndarray, "robots times 3"],
        news: SmootherUpdate,
        between: list[gtsam.NonlinearFactor],
        told: list[gtsam.NonlinearFactor],
    ) -> list[int]:
        """Take in what is new, with its factors, and solve; numbers of the measurements in ``told``."""
        came = news.held > self.held
        others_came = int(np.count_nonzero(came)) > int(came[self._robot])
        graph, values = self._new_poses(poses, news.held)
        self._add_pings(graph, values, news.pings)
        add(graph, [*between, *told])
        result = self._isam.update(graph, values, news.removed)
        self.held = news.held
        self._settle(others_came)
        numbers: list[int] = result.getNewFactorsIndices()
        return numbers[len(numbers) - len(told) :]

    def hear(self, bearings: Bearings) -> None:
        """Add directions of arrival between poses of the graph, after its relative poses were solved for.

        A loss that lets go of what does not fit must not choose what it fits.
        """
        graph = gtsam.NonlinearFactorGraph()
        add_bearings(graph, bearings, self._first_key, near=self._use_qr)
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
        last = int(self._first_key[self._robot] + self.held[self._robot]) - 1
        found: np.ndarray = self._isam.marginalCovariance(last)
        return found

    def _new_poses(
        self, poses: Float[np.ndarray, "robots times 3"], held: Int[np.ndarray, " robots"]
    ) -> tuple[gtsam.NonlinearFactorGraph, gtsam.Values]:
        """Poses that join the graph; each robot knows its start."""
        graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
        for robot in np.flatnonzero(held > self.held).tolist():
            first, begin = int(self._first_key[robot]), int(self.held[robot])
            for index, pose in enumerate(poses[robot, begin : held[robot]].tolist(), begin):
                values.insert(first + index, pose2=gtsam.Pose2(*pose))
            if begin == 0:
                anchor = gtsam.noiseModel.Isotropic.Sigma(3, ANCHOR_SIGMA)
                graph.addPriorPose2(first, gtsam.Pose2(*poses[robot, 0].tolist()), anchor)
        return graph, values

    def _add_pings(self, graph: gtsam.NonlinearFactorGraph, values: gtsam.Values, pings: Pings) -> None:
        """Bearings with Geman-McClure's loss to points that are known as well as they were told."""
        observers = keys(pings.observer, self._first_key)
        for i, azimuth_rad, sigma_rad, point_m, covariance_m2 in zip(observers, *pings[1:], strict=True):
            point, self._n_points = _FIRST_POINT + self._n_points, self._n_points + 1
            values.insert(point, point_m)
            graph.addPriorPoint2(point, point_m, gtsam.noiseModel.Gaussian.Covariance(covariance_m2))
            loss = geman_mcclure(sigma_rad)
            graph.add(gtsam.BearingFactor2D(i, point, gtsam.Rot2(azimuth_rad), loss))

    def _settle(self, others_came: bool) -> None:
        for _ in range(_SETTLING * others_came):
            self._isam.update()
