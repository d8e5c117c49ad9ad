"""Poses of every robot, solved anew whenever it learns something (paper Eq. 3, by iSAM2).

Kaess, Johannsson, Roberts, Ila, Leonard, Dellaert: iSAM2, IJRR 2012. Only what a new
measurement touches is solved again, so a step costs the same late in an episode as early.
"""

import gtsam
import numpy as np
from jaxtyping import Float, Int

from wifipgo.graph.bearings import Bearings
from wifipgo.graph.growth import in_world_axes
from wifipgo.graph.pings import NO_PINGS, Pings
from wifipgo.graph.posegraph import Edges
from wifipgo.graph.solvers._factors import Models, add_bearings, add_between, add_told, keys
from wifipgo.graph.solvers._losses import geman_mcclure
from wifipgo.graph.solvers._problem import ANCHOR_SIGMA, TOLD_SIGMA, odometry

# Variables of robot r start at r times this: an episode has fewer iterations.
_KEYS_A_ROBOT = 1_000_000
_FIRST_POINT = 1_000_000_000_000  # places that others told come after all poses
_RELINEARISE = 0.05  # m, rad: a pose that moved further since is linearised anew
# Updates after another robot's graph came: its poses and one's own may both move far.
_SETTLING = 3


class Smoother:
    """The graph of one robot, kept solved: its own measurements, and those that others sent."""

    def __init__(self, robot: int, n_robots: int, *, doubts: bool) -> None:
        """Know nothing yet.

        Args:
            robot: Whose graph it is.
            n_robots: How many there are.
            doubts: Whether Huber's loss is on all measurements but odometry.
        """
        self._robot, self._doubts = robot, doubts
        params = gtsam.ISAM2Params()
        params.setRelinearizeThreshold(_RELINEARISE)
        params.relinearizeSkip = 1
        self._isam = gtsam.ISAM2(params)
        self._models: Models = {}
        self._first_key = _KEYS_A_ROBOT * np.arange(n_robots)
        self._n_points = 0
        self.held = np.zeros(n_robots, dtype=np.int64)

    def learn(
        self,
        poses: Float[np.ndarray, "robots times 3"],
        held: Int[np.ndarray, " robots"],
        *,
        between: Edges,
        told: Edges,
        forgotten: list[int],
        pings: Pings = NO_PINGS,
    ) -> list[int]:
        """Take in what is new, and solve.

        Args:
            poses: Current estimates: where the search starts for poses that are new to the graph.
            held: Poses of each robot that are part of the graph from now on: the first so many.
            between: New measurements between poses of the graph.
            told: New measurements of poses outside it, which rest on what their robot told.
            forgotten: Numbers of measurements to drop, as returned before.
            pings: New bearings to places that others told.

        Returns:
            Numbers of the measurements in ``told``.
        """
        others_came = int(np.count_nonzero(held > self.held)) > int(
            held[self._robot] > self.held[self._robot]
        )
        graph, values = self._new_poses(poses, held)
        self._add_pings(graph, values, pings)
        add_between(graph, between, self._first_key, ~odometry(between) & self._doubts, self._models)
        told_sigma = np.broadcast_to(np.array(TOLD_SIGMA), (len(told), 2))
        add_told(graph, told, told_sigma, self._first_key, doubted=self._doubts)
        result = self._isam.update(graph, values, forgotten)
        self.held = held
        self._settle(others_came)
        numbers: list[int] = result.getNewFactorsIndices()
        return numbers[len(numbers) - len(told) :]

    def hear(self, bearings: Bearings) -> None:
        """Add directions of arrival between poses of the graph, after its relative poses were solved for.

        A loss that lets go of what does not fit must not choose what it fits.
        """
        graph = gtsam.NonlinearFactorGraph()
        add_bearings(graph, bearings, self._first_key)
        self._isam.update(graph, gtsam.Values())
        self._settle(True)

    def own(self) -> Float[np.ndarray, "times 3"]:
        """The robot's poses; keys come sorted, so those of robots before it come first."""
        first = int(self.held[: self._robot].sum())
        rows = gtsam.utilities.extractPose2(self._isam.calculateEstimate())
        own: np.ndarray = rows[first : first + int(self.held[self._robot])]
        return own

    def covariance(self) -> Float[np.ndarray, "3 3"]:
        """Covariance of the robot's last pose, in world axes, (x_m, y_m, yaw_rad)."""
        last = int(self._first_key[self._robot] + self.held[self._robot]) - 1
        yaw_rad = self._isam.calculateEstimatePose2(last).theta()
        return in_world_axes(self._isam.marginalCovariance(last)[None], np.array([yaw_rad]))[0]

    def _new_poses(
        self, poses: Float[np.ndarray, "robots times 3"], held: Int[np.ndarray, " robots"]
    ) -> tuple[gtsam.NonlinearFactorGraph, gtsam.Values]:
        """Poses that join the graph; each robot knows its start."""
        graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
        for robot in np.flatnonzero(held > self.held).tolist():
            first, begin = int(self._first_key[robot]), int(self.held[robot])
            for index, pose in enumerate(poses[robot, begin : held[robot]].tolist(), begin):
                values.insert(first + index, gtsam.Pose2(*pose))
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
