"""How far each robot may be from where it believes it is: covariances of its poses.

Covariances are over ``(x_m, y_m, yaw_rad)`` along the axes of the world. An error in yaw moves
all that lies beyond it: `wifipgo.se2.offset_jacobian`. Everything here is what robots can compute.
"""

import numpy as np
from jaxtyping import Float, Int

from wifipgo.arithmetic import harmless_underflow
from wifipgo.graph.edges import Edges
from wifipgo.se2 import adjoint, offset_jacobian

Covariances = Float[np.ndarray, "... 3 3"]


@harmless_underflow
def transport_covariance(
    covariance: Float[np.ndarray, "... 3 3"], d_m: Float[np.ndarray, "... 2"]
) -> Float[np.ndarray, "... 3 3"]:
    """Covariances of poses, at points ``d_m`` away that are fixed to them."""
    J = offset_jacobian(d_m)
    return J @ covariance @ np.swapaxes(J, -1, -2)


@harmless_underflow
def in_world_axes(
    own_axes: Float[np.ndarray, "poses 3 3"], yaw_rad: Float[np.ndarray, " poses"]
) -> Float[np.ndarray, "poses 3 3"]:
    """Covariances of poses that were given in the axes of each pose, as gtsam has them."""
    poses = np.zeros((len(yaw_rad), 3))
    poses[:, 2] = yaw_rad
    turn = adjoint(poses)
    return turn @ own_axes @ turn.transpose(0, 2, 1)


@harmless_underflow
def propagate_covariance(
    covariance: Float[np.ndarray, "*kinds robots 3 3"],
    before: Float[np.ndarray, "robots 3"],
    after: Float[np.ndarray, "robots 3"],
    sigma: Float[np.ndarray, "robots 2"],
) -> Float[np.ndarray, "*kinds robots 3 3"]:
    """Covariances of poses after one odometry each, to first order (Smith, Self, Cheeseman 1990).

    Args:
        covariance: Of the poses before, over (x_m, y_m, yaw_rad) in world axes; of several kinds at once.
        before: Poses before.
        after: Poses after, as odometry has them.
        sigma: Standard deviations of the odometry, (m on each axis, rad).

    Returns:
        Of the poses after, in world axes.
    """
    grown = transport_covariance(covariance, after[:, :2] - before[:, :2])
    variance = sigma**2
    for axis, noise in enumerate((0, 0, 1)):
        grown[..., axis, axis] += variance[:, noise]
    return grown


def covariance_after_closure(
    covariance: Float[np.ndarray, "robots 3 3"],
    d_m: Float[np.ndarray, "robots 2"],
    sigma: Float[np.ndarray, "robots 2"],
) -> Float[np.ndarray, "robots 3 3"]:
    """Covariance of a pose from which a place of known covariance was measured.

    Args:
        covariance: Of the place.
        d_m: From the place to the pose.
        sigma: ``(sigma_t_m, sigma_r_rad)`` of the measurement, which was made at the pose.
    """
    variance = sigma**2
    seen_back = covariance.copy()
    seen_back[:, 2, 2] += variance[:, 1]
    out = transport_covariance(seen_back, d_m)
    out[:, 0, 0] += variance[:, 0]
    out[:, 1, 1] += variance[:, 0]
    return out


def propagate_backwards(
    end: Float[np.ndarray, "robots 3 3"],
    p_m: Float[np.ndarray, "robots times 2"],
    sigma: Float[np.ndarray, "robots 2"],
) -> Float[np.ndarray, "robots times 3 3"]:
    """Covariances of a trajectory by dead reckoning backwards from its last pose.

    Each odometry reading between a pose k and the end adds its own noise at the place of the
    reading, carried to pose k. Sums over readings are cumulative sums of places and of their
    squares, so no loop over time is needed.

    Args:
        end: Covariance of each robot's last pose.
        p_m: Positions.
        sigma: Of odometry.
    """
    back = transport_covariance(end[:, None], p_m - p_m[:, -1:])
    n_after = np.arange(p_m.shape[1] - 1, -1, -1.0)
    turn, shift = sigma[:, 1:] ** 2, sigma[:, :1] ** 2
    x, y = p_m[..., 0], p_m[..., 1]
    after_x, after_y = _sum_after(x), _sum_after(y)
    back[..., 0, 0] += turn * _spread(y, y, after_y, after_y, n_after) + shift * n_after
    back[..., 1, 1] += turn * _spread(x, x, after_x, after_x, n_after) + shift * n_after
    across = turn * _spread(x, y, after_x, after_y, n_after)
    back[..., 0, 1] -= across
    back[..., 1, 0] -= across
    for axis, turned in enumerate((after_y - n_after * y, n_after * x - after_x)):
        back[..., axis, 2] += turn * turned
        back[..., 2, axis] += turn * turned
    back[..., 2, 2] += turn * n_after
    return back


def _spread(
    a: Float[np.ndarray, "robots times"],
    b: Float[np.ndarray, "robots times"],
    after_a: Float[np.ndarray, "robots times"],
    after_b: Float[np.ndarray, "robots times"],
    n_after: Float[np.ndarray, " times"],
) -> Float[np.ndarray, "robots times"]:
    """Sum over all later places of the product of how far they are along two axes."""
    return n_after * a * b - a * after_b - b * after_a + _sum_after(a * b)


def _sum_after(x: Float[np.ndarray, "robots times"]) -> Float[np.ndarray, "robots times"]:
    """Sum over all later times."""
    return np.flip(np.cumsum(np.flip(x, 1), axis=1), 1) - x


def spread_m(covariance: Covariances) -> Float[np.ndarray, "..."]:
    """Root of the trace of the position's covariance: the root mean square error of the position."""
    return np.sqrt(covariance[..., 0, 0] + covariance[..., 1, 1])


def point_mse_m2(covariance: Covariances, *, reach_m: float) -> Float[np.ndarray, "..."]:
    """Mean squared error of a point ``reach_m`` away from a pose: what two covariances are compared by."""
    return covariance[..., 0, 0] + covariance[..., 1, 1] + reach_m**2 * covariance[..., 2, 2]


def smaller_covariance(a: Covariances, b: Covariances, *, reach_m: float) -> Covariances:
    """The smaller of two covariances, each: they share readings, so they must not be fused as if not."""
    closer = point_mse_m2(a, reach_m=reach_m) <= point_mse_m2(b, reach_m=reach_m)
    return np.where(closer[..., None, None], a, b)


def loop_closures_at(edges: Edges, t: int) -> tuple[Int[np.ndarray, " rows"], Int[np.ndarray, " rows"]]:
    """Robots that measured a place of their own at iteration ``t``, the last, and when they were there.

    Measurements are in the order in which they were taken.
    """
    last = slice(int(edges.tail[:, 1].searchsorted(t)), None)
    tail, head = edges.tail[last], edges.head[last]
    rows = (tail[:, 0] == head[:, 0]).nonzero()[0]
    return tail[rows, 0], head[rows, 1]
