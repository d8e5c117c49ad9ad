"""Errors of a set of poses: against its measurements (paper Eq. 4) and against the truth (Eqs. 12, 13)."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from wifipgo.arithmetic import harmless_underflow
from wifipgo.errors import pick
from wifipgo.graph.edges import Edges, select

# Whether each term of Eq. 4 is divided by the variance of its measurement.
ERR_WEIGHTS: Mapping[str, bool] = MappingProxyType({"unit": False, "information": True})

_MANY = 1000  # measurements from which on it pays to look for what changed


def chordal_square(angle_rad: Float[np.ndarray, "*shape"]) -> Float[np.ndarray, "*shape"]:
    """Squared Frobenius distance of two rotations ``angle_rad`` apart: 4 (1 - cos d), in 2-D and 3-D."""
    return 8.0 * np.sin(0.5 * angle_rad) ** 2


@harmless_underflow
def squared_residuals(
    poses: Float[np.ndarray, "robots times 3"], edges: Edges
) -> tuple[Float[np.ndarray, " edges"], Float[np.ndarray, " edges"]]:
    """The two squared norms under the sum of paper Eq. 4, by what the tail's robot believes.

    It knows its own poses from ``poses``, and another robot's as that last told it.

    Returns:
        ``|p_j - p_i - R_i pbar|^2`` in m^2 and ``|R_j - R_i Rbar|_F^2``, unitless.
    """
    times, rows = poses.shape[1], poses.reshape(-1, 3)
    tail = edges.tail[:, 0] * times + edges.tail[:, 1]
    head = edges.head[:, 0] * times + edges.head[:, 1]
    T_world_i = rows.take(tail, axis=0)
    T_world_j = np.where(edges.between_robots[:, None], edges.reported_pose, rows.take(head, axis=0))
    d = T_world_j - T_world_i
    if len(edges) < len(rows):
        c, s = np.cos(T_world_i[:, 2]), np.sin(T_world_i[:, 2])
    else:
        c, s = np.cos(rows[:, 2]).take(tail), np.sin(rows[:, 2]).take(tail)
    x, y = edges.z[:, 0], edges.z[:, 1]
    off_m2 = (d[:, 0] - c * x + s * y) ** 2 + (d[:, 1] - s * x - c * y) ** 2
    return off_m2, chordal_square(d[:, 2] - edges.z[:, 2])


class Judged(NamedTuple):
    """Err_i of every robot by unit weights as it was, of which poses and measurements."""

    err: Float[np.ndarray, " robots"]
    poses: Float[np.ndarray, "robots times 3"]
    edges: Edges


@harmless_underflow
def residual_error(
    poses: Float[np.ndarray, "robots times 3"],
    edges: Edges,
    *,
    weights: str = "unit",
    before: Judged | None = None,
) -> Float[np.ndarray, " robots"]:
    """Err_i of every robot (paper Eq. 4): how far its measurements disagree with its poses.

    A term counts by its weight of Eq. 11 in both modes, since Omega' replaces Omega
    there. Err_i sums over what robot i measured: edges whose tail is its own.

    Args:
        poses: What each robot believes its trajectory to be, world frame.
        edges: All measurements.
        weights: ``unit``: omega_p = 1 / m and omega_R = 1, the paper's, summed.
            ``information``: omega = 1 / sigma, so a chi-square, here divided by its
            degrees of freedom: three for each measurement of positive weight, less
            three for each pose but the first, at least 1.
        before: Err_i before the last measurements came. It saves the time for terms that are as they were,
            where these are many, and changes no bit.

    Returns:
        Err_i, unitless.
    """
    by_sigma = pick(ERR_WEIGHTS, weights, "Err weights")
    if before is not None and len(before.edges) >= _MANY and not by_sigma:
        return _brought_up_to_date(before, poses, edges)
    off_m2, turn = squared_residuals(poses, edges)
    robot, (n_robots, times) = edges.tail[:, 0], poses.shape[:2]
    freedom = np.ones(n_robots)
    if by_sigma:
        off_m2, turn = off_m2 / edges.sigma[:, 0] ** 2, turn / edges.sigma[:, 1] ** 2
        counted = np.bincount(robot, edges.weight > 0.0, minlength=n_robots)
        freedom = np.maximum(3.0 * (counted - (times - 1)), 1.0)
    return np.bincount(robot, edges.weight * (off_m2 + 0.5 * turn), minlength=n_robots) / freedom


def _brought_up_to_date(
    before: Judged, poses: Float[np.ndarray, "robots times 3"], edges: Edges
) -> Float[np.ndarray, " robots"]:
    """Sums of old terms and new ones, as they came; from the first for robots with terms that changed."""
    n_old, (n_robots, times) = len(before.edges), before.poses.shape[:2]
    robot = edges.tail[:, 0]
    others = (robot[:n_old] != edges.head[:n_old, 0]).nonzero()[0]
    told = (edges.reported_pose[others] != before.edges.reported_pose[others]).any(axis=1)
    anew = (poses[:, :times] != before.poses).reshape(n_robots, -1).any(axis=1)
    anew[robot[others[told]]] = True
    rows = np.append(anew[robot[:n_old]].nonzero()[0], np.arange(n_old, len(edges)))
    off_m2, turn = squared_residuals(poses, few := select(edges, rows))
    terms = np.append(np.where(anew, 0.0, before.err), few.weight * (off_m2 + 0.5 * turn))
    return np.bincount(np.append(np.arange(n_robots), few.tail[:, 0]), terms, minlength=n_robots)


@harmless_underflow
def ate_trans(
    estimate: Float[np.ndarray, "robots times 3"], reference: Float[np.ndarray, "robots times 3"]
) -> Float[np.ndarray, " robots"]:
    """Mean squared position error of each robot, m^2 (paper Eq. 12: no root, no alignment).

    All robots have as many poses, so the mean over robots is Eq. 12 of the team.
    """
    d_m = estimate - reference
    total_m2: np.ndarray = (d_m[..., 0] ** 2 + d_m[..., 1] ** 2).sum(axis=-1)
    return total_m2 / d_m.shape[-2]


@harmless_underflow
def ate_rot(
    estimate: Float[np.ndarray, "robots times 3"], reference: Float[np.ndarray, "robots times 3"]
) -> Float[np.ndarray, " robots"]:
    """Mean squared rotation error of each robot, unitless (paper Eq. 13); its mean is the team's."""
    total: np.ndarray = chordal_square(estimate[..., 2] - reference[..., 2]).sum(axis=-1)
    return total / estimate.shape[-2]
