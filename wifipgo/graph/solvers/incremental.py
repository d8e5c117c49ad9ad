"""Poses of one robot, solved anew whenever it learns something (paper Eq. 3, by iSAM2).

Kaess, Johannsson, Roberts, Ila, Leonard, Dellaert: iSAM2, IJRR 2012. Only what a new
measurement touches is solved again, so a step costs the same late in an episode as early.
"""

from typing import NamedTuple

import gtsam
import numpy as np
from jaxtyping import Bool, Float, Int

from wifipgo.graph.bearings import Bearings, select_bearings
from wifipgo.graph.posegraph import Edges, select
from wifipgo.graph.solvers._factors import add_bearings, add_between, add_told
from wifipgo.graph.solvers.planar import ANCHOR_SIGMA, THIRD_PARTY, TOLD_SIGMA, odometry
from wifipgo.se2 import wrap_angle

# Variables of robot r start at r times this: an episode has fewer iterations.
_KEYS_A_ROBOT = 1_000_000
# A told pose that changed by less, in standard deviations of told poses, is not worth solving again for.
_SAME_TOLD = 0.1
_RELINEARISE = 0.01  # m, rad: a pose that moved further since is linearised anew
# Updates after another robot's graph came: its poses and one's own may both move far.
_SETTLING = 4


class Knowledge(NamedTuple):
    """What a robot holds after it learned something.

    Attributes:
        held: Poses of each robot that are part of its graph: the first so many. Its own are all there.
        rows: Rows of the edges that are new to it, each measured at a held pose.
        heard: Rows of the bearings that are new to it, between held poses.
    """

    held: Int[np.ndarray, " robots"]
    rows: Int[np.ndarray, " rows"]
    heard: Int[np.ndarray, " heard"]


class Smoother:
    """The graph of one robot: its own measurements, and those that others sent when they met.

    A measurement of a robot whose pose is not part of the graph ties the own pose to what that
    robot told; it becomes a measurement between two poses once the other's graph came.
    """

    def __init__(self, robot: int, *, huber: bool = False, third_party: str = "fixed_told") -> None:
        """Know nothing yet."""
        self._robot, self._huber, self._uses_told = robot, huber, THIRD_PARTY[third_party]
        params = gtsam.ISAM2Params()
        params.setRelinearizeThreshold(_RELINEARISE)
        params.relinearizeSkip = 1
        self._isam = gtsam.ISAM2(params)
        self._held = np.zeros(0, dtype=np.int64)
        self._told_rows = np.zeros(0, dtype=np.int64)
        self._told = np.zeros((0, 3))
        self._told_factors = np.zeros(0, dtype=np.int64)

    def learn(
        self,
        poses: Float[np.ndarray, "robots times 3"],
        edges: Edges,
        bearings: Bearings,
        knowledge: Knowledge,
    ) -> Float[np.ndarray, "times 3"]:
        """Take in what is new, and say where the robot now thinks it was.

        Args:
            poses: Current estimates: where the search starts for poses that are new to the graph.
            edges: All measurements. Rows keep their places from call to call; new ones come last.
            bearings: All directions of arrival, as the edges.
            knowledge: What the robot holds from now on.
        """
        before = self._held if len(self._held) else np.zeros(len(poses), dtype=np.int64)
        others_came = bool((np.delete(knowledge.held - before, self._robot) > 0).any())
        graph, values = self._new_poses(poses, before, knowledge.held)
        self._held = knowledge.held
        inner, outer, stale = self._sorted_out(edges, knowledge.rows)
        first_key = _KEYS_A_ROBOT * np.arange(len(poses))
        between = select(edges, inner)
        add_between(graph, between, first_key, ~odometry(between) & self._huber)
        told = select(edges, outer)
        sigma = np.broadcast_to(np.array(TOLD_SIGMA), (len(outer), 2))
        add_told(graph, told, sigma, first_key, doubted=self._huber)
        result = self._isam.update(graph, values, self._told_factors[stale].tolist())
        self._remember_told(outer, told.told, stale, result.getNewFactorsIndices())
        self._settle(others_came)
        if len(knowledge.heard):
            graph = gtsam.NonlinearFactorGraph()
            add_bearings(graph, select_bearings(bearings, knowledge.heard), first_key)
            self._isam.update(graph, gtsam.Values())
            self._settle(others_came)
        return self._own()

    def covariance(self) -> Float[np.ndarray, "3 3"]:
        """Covariance of the robot's last pose, in world axes, (x_m, y_m, yaw_rad)."""
        key = _KEYS_A_ROBOT * self._robot + int(self._held[self._robot]) - 1
        pose = self._isam.calculateEstimatePose2(key)
        T = np.eye(3)
        T[:2, :2] = pose.rotation().matrix()
        covariance: np.ndarray = T @ self._isam.marginalCovariance(key) @ T.T
        return covariance

    def _new_poses(
        self,
        poses: Float[np.ndarray, "robots times 3"],
        before: Int[np.ndarray, " robots"],
        now: Int[np.ndarray, " robots"],
    ) -> tuple[gtsam.NonlinearFactorGraph, gtsam.Values]:
        """Poses that join the graph; each robot knows its start."""
        graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
        for robot in np.flatnonzero(now > before).tolist():
            for index in range(int(before[robot]), int(now[robot])):
                values.insert(_KEYS_A_ROBOT * robot + index, gtsam.Pose2(*poses[robot, index].tolist()))
            if before[robot] == 0:
                anchor = gtsam.noiseModel.Isotropic.Sigma(3, ANCHOR_SIGMA)
                graph.addPriorPose2(_KEYS_A_ROBOT * robot, gtsam.Pose2(*poses[robot, 0].tolist()), anchor)
        return graph, values

    def _sorted_out(
        self, edges: Edges, rows: Int[np.ndarray, " rows"]
    ) -> tuple[Int[np.ndarray, " inner"], Int[np.ndarray, " outer"], Bool[np.ndarray, " told"]]:
        """New measurements between held poses; those that rest on what was told; and what was told otherwise."""
        moved = edges.told[self._told_rows] - self._told
        moved[:, 2] = wrap_angle(moved[:, 2])
        stale = (np.abs(moved) > _SAME_TOLD * np.array([TOLD_SIGMA[0], *TOLD_SIGMA])).any(axis=1)
        stale |= self._is_held(edges, self._told_rows)
        rows = np.concatenate([rows[edges.weight[rows] > 0.0], self._told_rows[stale]])
        inside = self._is_held(edges, rows)
        return rows[inside], rows[~inside & self._uses_told], stale

    def _is_held(self, edges: Edges, rows: Int[np.ndarray, " rows"]) -> Bool[np.ndarray, " rows"]:
        """Whose heads are part of the graph."""
        head = edges.head[rows]
        inside: np.ndarray = head[:, 1] < self._held[head[:, 0]]
        return inside

    def _remember_told(
        self,
        rows: Int[np.ndarray, " rows"],
        told: Float[np.ndarray, "rows 3"],
        stale: Bool[np.ndarray, " told"],
        new_factors: list[int],
    ) -> None:
        """Keep which factors rest on what was told; they are the last of those that are new."""
        factors = np.array(new_factors[len(new_factors) - len(rows) :], dtype=np.int64)
        self._told_rows = np.concatenate([self._told_rows[~stale], rows])
        self._told = np.concatenate([self._told[~stale], told])
        self._told_factors = np.concatenate([self._told_factors[~stale], factors])

    def _settle(self, others_came: bool) -> None:
        for _ in range(_SETTLING * others_came):
            self._isam.update()

    def _own(self) -> Float[np.ndarray, "times 3"]:
        """The robot's poses; keys come sorted, so those of robots before it come first."""
        first = int(self._held[: self._robot].sum())
        rows = gtsam.utilities.extractPose2(self._isam.calculateEstimate())
        own: np.ndarray = rows[first : first + int(self._held[self._robot])]
        return own
