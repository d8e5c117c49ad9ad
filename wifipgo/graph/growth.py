"""How the uncertainty of a pose grows while its robot only counts its own steps."""

import numpy as np
from jaxtyping import Float


def dead_reckoned(
    covariance: Float[np.ndarray, "robots 3 3"],
    before: Float[np.ndarray, "robots 3"],
    after: Float[np.ndarray, "robots 3"],
    sigma: Float[np.ndarray, "robots 2"],
) -> Float[np.ndarray, "robots 3 3"]:
    """Covariances of poses after one odometry each, to first order (Smith, Self, Cheeseman 1990).

    Args:
        covariance: Of the poses before, over (x_m, y_m, yaw_rad) in world axes.
        before: Poses before.
        after: Poses after, as odometry has them.
        sigma: Standard deviations of the odometry, (m on each axis, rad).

    Returns:
        Of the poses after, in world axes.
    """
    J = np.zeros((len(before), 3, 3))
    J[:, [0, 1, 2], [0, 1, 2]] = 1.0
    J[:, 0, 2] = before[:, 1] - after[:, 1]
    J[:, 1, 2] = after[:, 0] - before[:, 0]
    grown = J @ covariance @ J.transpose(0, 2, 1)
    grown[:, [0, 1, 2], [0, 1, 2]] += sigma[:, [0, 0, 1]] ** 2
    return grown
