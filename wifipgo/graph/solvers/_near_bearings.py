"""Bearings whose slope stays bounded where observer and target nearly coincide.

gtsam's own bearing has a slope of 1 / range: between two poses a millimetre apart it weighs a million times
what it does at a metre, pulls the two together, and no digits are left for anything else. Beyond
`wifipgo.graph.bearings.NEAREST_M` this one is gtsam's.
"""

from functools import partial
from math import atan2, cos, hypot, remainder, sin, tau
from typing import Any

import gtsam
import numpy as np
from jaxtyping import Float

from wifipgo.graph.bearings import NEAREST_M, nearness


def near_bearing(
    observer: int, target: int, azimuth_rad: float, noise: gtsam.noiseModel.Base
) -> gtsam.CustomFactor:
    """Bearing from a pose to a pose."""
    return gtsam.CustomFactor(noise, [observer, target], partial(_residual, azimuth_rad))


def _residual(
    azimuth_rad: float,
    factor: gtsam.CustomFactor,
    values: gtsam.Values,
    jacobians: Any,
) -> Float[np.ndarray, "1"]:
    """Residual in rad; derivatives by both poses, (x, y, yaw) in the axes of each."""
    keys = factor.keys()
    observer, target = (values.atPose2(key) for key in keys)
    p_m = observer.transformTo(target.translation())
    off_rad, slope = bearing_slope(p_m, azimuth_rad)
    if jacobians is not None:
        x_m, y_m = p_m
        turn_rad = target.theta() - observer.theta()
        c, s = cos(turn_rad), sin(turn_rad)
        jacobians[0] = np.array([[-slope[0], -slope[1], slope[0] * y_m - slope[1] * x_m]])
        jacobians[1] = np.array([[c * slope[0] + s * slope[1], -s * slope[0] + c * slope[1], 0.0]])
    return np.array([off_rad])


def bearing_slope(p_m: Float[np.ndarray, "2"], azimuth_rad: float) -> tuple[float, Float[np.ndarray, "2"]]:
    """Residual of a target at ``p_m`` in the observer's axes, rad, and its slope there, rad / m."""
    x_m, y_m = p_m.tolist()
    range_m = hypot(x_m, y_m)
    toward = (x_m / range_m, y_m / range_m) if range_m > 0.0 else (cos(azimuth_rad), sin(azimuth_rad))
    along = np.array(toward)
    across = np.array([-along[1], along[0]])
    off_rad = remainder(atan2(along[1], along[0]) - azimuth_rad, tau)
    if range_m >= NEAREST_M:
        return off_rad, across / range_m
    share = range_m / NEAREST_M
    slope = ((2.0 - share) * across + off_rad * (2.0 - 2.0 * share) * along) / NEAREST_M
    return off_rad * float(nearness(np.array([range_m]))[0]), slope
