"""How the uncertainty of a pose is carried along, and grows while its robot only counts its own steps."""

import numpy as np
from jaxtyping import Float

from wifipgo.underflow import harmless_underflow

_IDENTITY = np.eye(3)


def lever(d_m: Float[np.ndarray, "... 2"]) -> Float[np.ndarray, "... 3 3"]:
    """Matrix that carries an error of a pose to a point ``d_m`` away that is fixed to it."""
    out = np.empty((*d_m.shape[:-1], 3, 3))
    out[...] = _IDENTITY
    out[..., 0, 2], out[..., 1, 2] = -d_m[..., 1], d_m[..., 0]
    return out


@harmless_underflow
def carried(
    covariance: Float[np.ndarray, "... 3 3"], d_m: Float[np.ndarray, "... 2"]
) -> Float[np.ndarray, "... 3 3"]:
    """Covariances of poses, at points ``d_m`` away that are fixed to them."""
    J = lever(d_m)
    return J @ covariance @ np.swapaxes(J, -1, -2)


@harmless_underflow
def in_world_axes(
    own_axes: Float[np.ndarray, "poses 3 3"], yaw_rad: Float[np.ndarray, " poses"]
) -> Float[np.ndarray, "poses 3 3"]:
    """Covariances of poses that were given in the axes of each pose, as gtsam has them."""
    turn = np.zeros((len(yaw_rad), 3, 3))
    turn[:, 0, 0] = turn[:, 1, 1] = np.cos(yaw_rad)
    turn[:, 1, 0] = np.sin(yaw_rad)
    turn[:, 0, 1], turn[:, 2, 2] = -turn[:, 1, 0], 1.0
    return turn @ own_axes @ turn.transpose(0, 2, 1)


@harmless_underflow
def dead_reckoned(
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
    grown = carried(covariance, after[:, :2] - before[:, :2])
    variance = sigma**2
    for axis, noise in enumerate((0, 0, 1)):
        grown[..., axis, axis] += variance[:, noise]
    return grown
