"""Pose graphs as frozen arrays: relative-pose measurements, one row each (paper Eq. 2).

Trajectories are one dense array of world-frame poses, ``poses[robot, index]`` =
``(x_m, y_m, yaw_rad)``: every robot has one pose an iteration.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from jaxtyping import Bool, Float, Int

from wifipgo.arithmetic import harmless_underflow
from wifipgo.errors import require


@dataclass(frozen=True, slots=True, kw_only=True)
class Edges:
    """Relative poses ``z = T_tail_head``: odometry, places seen again, other robots (paper Eq. 2).

    Attributes:
        tail: (robot, index) of the pose in whose frame the measurement is; that robot took it.
        head: (robot, index) of the measured pose.
        z: Measured ``(x_m, y_m, yaw_rad)`` of the head in the frame of the tail.
        sigma: Standard deviations ``(sigma_t_m, sigma_r_rad)`` of z; sigma_t holds for each axis.
        weight: Factor on the information of z (Eq. 11), in [0, 1]; 0 drops the measurement.
        reported_pose: Pose of the head in the world as its robot last told it to the tail's robot.
            Without meaning where both ends belong to one robot.
    """

    tail: Int[np.ndarray, "edges 2"]
    head: Int[np.ndarray, "edges 2"]
    z: Float[np.ndarray, "edges 3"]
    sigma: Float[np.ndarray, "edges 2"]
    weight: Float[np.ndarray, " edges"]
    reported_pose: Float[np.ndarray, "edges 3"]

    def __len__(self) -> int:
        """Return the number of measurements."""
        return len(self.tail)

    @classmethod
    def empty(cls) -> "Edges":
        """Return a graph without measurements."""
        pair, pose = np.zeros((0, 2), dtype=np.int64), np.zeros((0, 3))
        return cls(
            tail=pair, head=pair, z=pose, sigma=np.zeros((0, 2)), weight=np.zeros(0), reported_pose=pose
        )

    @classmethod
    def measured(
        cls,
        *,
        tail: Int[np.ndarray, "edges 2"],
        head: Int[np.ndarray, "edges 2"],
        z: Float[np.ndarray, "edges 3"],
        sigma: Float[np.ndarray, "#edges 2"] | tuple[float, float],
        weight: Float[np.ndarray, " edges"] | float = 1.0,
        reported_pose: Float[np.ndarray, "edges 3"] | None = None,
    ) -> "Edges":
        """Check new measurements and fill in what they share.

        Args:
            tail: See the class.
            head: See the class.
            z: See the class.
            sigma: One row for each measurement, or one pair for all.
            weight: One for each measurement, or one for all.
            reported_pose: May be left out where both ends belong to one robot.

        Raises:
            ValueError: A sigma is not > 0, a weight is outside [0, 1], a number is not finite, or a
                measurement of another robot comes without what that robot told.
        """
        n = len(tail)
        sigmas, weights, given = np.empty((n, 2)), np.empty(n), np.asarray(weight)
        sigmas[:], weights[:] = sigma, given
        if not np.isfinite(z).all():
            require(False, "Edges.z", "finite", z[~np.isfinite(z).all(axis=1)])
        require(bool(sigmas.min(initial=np.inf) > 0.0), "Edges.sigma", "> 0", sigma)
        within = bool(((given >= 0.0) & (given <= 1.0)).all())
        require(within, "Edges.weight", "in [0, 1]", weight)
        if reported_pose is None:
            alone = not (tail[:, 0] != head[:, 0]).any()
            require(alone, "Edges.reported_pose", "given for edges between robots", reported_pose)
            reported_pose = np.zeros((n, 3))
        return cls(tail=tail, head=head, z=z, sigma=sigmas, weight=weights, reported_pose=reported_pose)

    @property
    def between_robots(self) -> Bool[np.ndarray, " edges"]:
        """Which measurements are of another robot."""
        return self.tail[:, 0] != self.head[:, 0]

    @property
    def measured_at(self) -> Int[np.ndarray, " edges"]:
        """Iteration of each measurement: that of the later of the own poses, as odometry comes after both."""
        return np.where(self.between_robots, self.tail[:, 1], np.maximum(self.tail[:, 1], self.head[:, 1]))


def extended(edges: Edges, *more: Edges) -> Edges:
    """Append measurements."""
    parts = (edges, *more)
    if len(parts) == 1:
        return edges
    return Edges(**{f: np.concatenate([getattr(part, f) for part in parts]) for f in _NAMES})


def select(edges: Edges, rows: Bool[np.ndarray, " edges"] | Int[np.ndarray, " rows"]) -> Edges:
    """Keep the rows of a mask, or those listed, in the order listed."""
    listed = np.flatnonzero(rows) if rows.dtype == np.bool_ else rows
    return Edges(**{f: getattr(edges, f).take(listed, axis=0) for f in _NAMES})


def known_to(edges: Edges, robots: Sequence[int]) -> Edges:
    """What some robots measured."""
    return select(edges, np.isin(edges.tail[:, 0], robots))


def refresh_reported(
    edges: Edges, poses: Float[np.ndarray, "robots times 3"], *, robots: Iterable[int]
) -> Edges:
    """Let the given robots tell each other their current poses (what a rendezvous exchanges)."""
    return refresh_reported_within(edges, poses, groups=[list(robots)])


@harmless_underflow
def refresh_reported_within(
    edges: Edges, poses: Float[np.ndarray, "robots times 3"], *, groups: Sequence[Sequence[int]]
) -> Edges:
    """Let robots of a group tell each other their current poses; nobody is in two groups."""
    if not groups:
        return edges
    of = group_of(groups, len(poses))
    tail, head = of.take(edges.tail[:, 0]), of.take(edges.head[:, 0])
    rows = ((tail == head) & (tail >= 0)).nonzero()[0]
    now = edges.reported_pose.copy()
    now[rows] = poses[edges.head[rows, 0], edges.head[rows, 1]]
    return replace(edges, reported_pose=now)


def group_of(groups: Sequence[Sequence[int]], n_robots: int) -> Int[np.ndarray, " robots"]:
    """Number of the group that each robot is in, -1 of those in none."""
    of = np.full(n_robots, -1)
    of[[robot for group in groups for robot in group]] = np.repeat(
        np.arange(len(groups)), [len(group) for group in groups]
    )
    return of


_NAMES = tuple(f.name for f in fields(Edges))
