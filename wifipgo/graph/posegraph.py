"""Pose graphs of several robots with any keys, in the plane or in space, as frozen arrays.

A pose is a row ``(x_m, y_m, yaw_rad)`` or ``(x_m, y_m, z_m, qx, qy, qz, qw)``; all rows of a
graph are of one kind. Poses are sorted by robot and index, edges by their ends and values, so
equal graphs have equal arrays whatever order they were given in.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from types import MappingProxyType

import numpy as np
from jaxtyping import Bool, Float, Int

from wifipgo import se2, se3
from wifipgo.errors import require

# Numbers of a pose row and its degrees of freedom.
FREEDOM: Mapping[int, int] = MappingProxyType({3: 3, 7: 6})
UNIT_LENGTH_ATOL = 1e-3  # printed quaternions have six digits


@dataclass(frozen=True, slots=True, kw_only=True)
class PoseGraph:
    """Poses of robots, measurements between them, and how sure these are. Make one with `pose_graph`.

    Attributes:
        robot: Whose pose it is, >= 0.
        index: Number of the pose on its robot; numbers may be missing.
        poses: Value in the world: where a search starts, or its result.
        tail: Row of the pose in whose frame a measurement is.
        head: Row of the measured pose.
        z: Measured pose of the head in the frame of the tail.
        information: Inverse covariance of z in the tangent space at the head, translation first (1 / m^2,
            1 / (m rad), 1 / rad^2).
        weight: Factor on the information, in [0, 1]; 0 drops the measurement.
    """

    robot: Int[np.ndarray, " poses"]
    index: Int[np.ndarray, " poses"]
    poses: Float[np.ndarray, "poses dims"]
    tail: Int[np.ndarray, " edges"]
    head: Int[np.ndarray, " edges"]
    z: Float[np.ndarray, "edges dims"]
    information: Float[np.ndarray, "edges freedom freedom"]
    weight: Float[np.ndarray, " edges"]

    def __post_init__(self) -> None:
        """Let no one write into the arrays."""
        for f in fields(self):
            getattr(self, f.name).flags.writeable = False

    @property
    def freedom(self) -> int:
        """Degrees of freedom of a pose: 3 in the plane, 6 in space."""
        return FREEDOM[self.poses.shape[1]]

    @property
    def robots(self) -> Int[np.ndarray, " robots"]:
        """Numbers of the robots that have poses, ascending."""
        return np.unique(self.robot)

    @property
    def between_robots(self) -> Bool[np.ndarray, " edges"]:
        """Which measurements are between two robots."""
        return self.robot[self.tail] != self.robot[self.head]

    @property
    def odometry(self) -> Bool[np.ndarray, " edges"]:
        """Which measurements are from a pose to the next one of its robot."""
        return ~self.between_robots & (self.head == self.tail + 1)

    def with_poses(self, poses: Float[np.ndarray, "poses dims"]) -> "PoseGraph":
        """Return the same measurements at other poses."""
        return replace(self, poses=poses.copy())

    def with_weight(self, weight: Float[np.ndarray, " edges"]) -> "PoseGraph":
        """Return the same graph with other weights."""
        _check_weight(weight)
        return replace(self, weight=weight.copy())


def pose_graph(
    *,
    robot: Int[np.ndarray, " poses"],
    index: Int[np.ndarray, " poses"],
    poses: Float[np.ndarray, "poses dims"],
    tail: Int[np.ndarray, "edges 2"],
    head: Int[np.ndarray, "edges 2"],
    z: Float[np.ndarray, "edges dims"],
    information: Float[np.ndarray, "edges freedom freedom"],
    weight: Float[np.ndarray, " edges"] | float = 1.0,
) -> PoseGraph:
    """Check and sort the poses and measurements of a graph.

    Args:
        robot: See `PoseGraph`.
        index: See `PoseGraph`.
        poses: See `PoseGraph`.
        tail: (robot, index) of each measurement's frame.
        head: (robot, index) of each measured pose.
        z: See `PoseGraph`.
        information: See `PoseGraph`.
        weight: One for each measurement, or one for all.

    Raises:
        ValueError: Two poses have one key, an edge ends at a pose that is not there or where
            it began, a number is not finite, a quaternion has no length one, an information
            matrix is not symmetric and positive definite, or a weight is outside [0, 1].
    """
    _check_shapes(poses, information)
    weights = np.array(np.broadcast_to(np.asarray(weight, dtype=np.float64), (len(tail),)))
    _check_numbers(poses, z, information, weights)
    order = np.lexsort((index, robot))
    keys = np.stack([robot, index], axis=-1).astype(np.int64)[order]
    repeated = np.flatnonzero((keys[1:] == keys[:-1]).all(axis=1))
    require(len(repeated) == 0, "poses", "one for each (robot, index)", _named(keys, repeated))
    tails, heads = rows_of(keys, tail, "tail"), rows_of(keys, head, "head")
    require(
        bool((tails != heads).all()),
        "edges",
        "between two poses",
        _named(tail, np.flatnonzero(tails == heads)),
    )
    first = np.lexsort((*z.T[::-1], heads, tails))
    return PoseGraph(
        robot=keys[:, 0].copy(),
        index=keys[:, 1].copy(),
        poses=normalised(poses[order]),
        tail=tails[first],
        head=heads[first],
        z=normalised(z[first]),
        information=information[first],
        weight=weights[first],
    )


def _check_shapes(poses: np.ndarray, information: np.ndarray) -> None:
    """Refuse poses that are of neither plane nor space, and matrices of another freedom than theirs."""
    require(poses.shape[1] in FREEDOM, "poses", "rows of 3 (plane) or 7 (space) numbers", poses.shape[1])
    freedom = FREEDOM[poses.shape[1]]
    rule = f"{freedom} x {freedom}"
    require(information.shape[1:] == (freedom, freedom), "information", rule, information.shape)


def rows_of(
    keys: Int[np.ndarray, "poses 2"], wanted: Int[np.ndarray, "n 2"], field: str = "keys"
) -> Int[np.ndarray, " n"]:
    """Rows of (robot, index) pairs among sorted ones.

    Raises:
        ValueError: A pair is not there.
    """
    place = {key: row for row, key in enumerate(map(tuple, keys.tolist()))}
    rows = np.array([place.get((r, i), -1) for r, i in wanted.tolist()], dtype=np.int64)
    require(bool((rows >= 0).all()), field, "a pose of the graph", _named(wanted, np.flatnonzero(rows < 0)))
    return rows


def normalised(poses: Float[np.ndarray, "n dims"]) -> Float[np.ndarray, "n dims"]:
    """Quaternions of length one, or angles in [-pi, pi)."""
    if poses.shape[1] == 3:
        return np.concatenate([poses[:, :2], se2.wrap_angle(poses[:, 2:])], axis=-1)
    return np.concatenate([poses[:, :3], se3.unit_quaternion(poses[:, 3:])], axis=-1)


def keys_of(graph: PoseGraph) -> Int[np.ndarray, "poses 2"]:
    """(robot, index) of every pose."""
    return np.stack([graph.robot, graph.index], axis=-1)


def _check_numbers(
    poses: Float[np.ndarray, "poses dims"],
    z: Float[np.ndarray, "edges dims"],
    information: Float[np.ndarray, "edges freedom freedom"],
    weight: Float[np.ndarray, " edges"],
) -> None:
    """Refuse numbers that mean nothing, by the row where the first of them is."""
    for name, rows in (("poses", poses), ("z", z)):
        bad = ~np.isfinite(rows).all(axis=1)
        require(not bad.any(), name, "finite", _rows(rows, bad))
        bad = np.abs(np.linalg.norm(rows[:, 3:], axis=1) - 1.0) > UNIT_LENGTH_ATOL
        require(rows.shape[1] == 3 or not bad.any(), name, "with quaternions of length 1", _rows(rows, bad))
    bad = ~is_information(information)
    require(not bad.any(), "information", "symmetric and positive definite", _rows(information, bad))
    _check_weight(weight)


def _check_weight(weight: Float[np.ndarray, " edges"]) -> None:
    require(bool(((weight >= 0.0) & (weight <= 1.0)).all()), "weight", "in [0, 1]", weight)


def is_information(matrices: Float[np.ndarray, "n freedom freedom"]) -> Bool[np.ndarray, " n"]:
    """Which matrices are finite, symmetric and positive definite."""
    finite = np.isfinite(matrices).all(axis=(1, 2))
    safe = np.where(finite[:, None, None], matrices, np.eye(matrices.shape[-1]))
    symmetric = np.isclose(safe, np.swapaxes(safe, 1, 2)).all(axis=(1, 2))
    return finite & symmetric & (np.linalg.eigvalsh(safe)[:, 0] > 0.0)


def _rows(rows: np.ndarray, bad: Bool[np.ndarray, " n"]) -> str:
    """The first bad row, for a message."""
    first = int(np.flatnonzero(bad)[0]) if bad.any() else -1
    return f"row {first}: {rows[first].tolist()}" if first >= 0 else ""


def _named(keys: Int[np.ndarray, "n 2"], rows: Int[np.ndarray, " bad"]) -> str:
    """Keys of some rows, for a message."""
    return ", ".join(f"pose {i} of robot {r}" for r, i in keys[rows[:3]].tolist())
