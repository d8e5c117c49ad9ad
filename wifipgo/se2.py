"""Planar rigid transforms as arrays of ``(x_m, y_m, yaw_rad)`` rows.

``T_a_b`` maps coordinates in frame b to coordinates in frame a, so neighbouring
letters cancel: ``T_world_j = compose(T_world_i, T_i_j)``.
"""

import numpy as np
from jaxtyping import Float


def wrap_angle(angle_rad: Float[np.ndarray, "..."]) -> Float[np.ndarray, "..."]:
    """Return the same directions in [-pi, pi), rad."""
    return np.mod(angle_rad + np.pi, 2.0 * np.pi) - np.pi


def rotate(yaw_rad: Float[np.ndarray, "..."], v_m: Float[np.ndarray, "... 2"]) -> Float[np.ndarray, "... 2"]:
    """Rotate vectors by ``yaw_rad`` (broadcasts over leading axes)."""
    c, s = np.cos(yaw_rad), np.sin(yaw_rad)
    x, y = v_m[..., 0], v_m[..., 1]
    turned_x = c * x - s * y
    out = np.empty((*turned_x.shape, 2))
    out[..., 0], out[..., 1] = turned_x, s * x + c * y
    return out


def _joined(p_m: Float[np.ndarray, "... 2"], yaw_rad: Float[np.ndarray, "..."]) -> Float[np.ndarray, "... 3"]:
    """Rows of position and heading."""
    out = np.empty((*p_m.shape[:-1], 3))
    out[..., :2], out[..., 2] = p_m, yaw_rad
    return out


def compose(
    T_a_b: Float[np.ndarray, "... 3"], T_b_c: Float[np.ndarray, "... 3"]
) -> Float[np.ndarray, "... 3"]:
    """Chain two transforms: ``T_a_c = T_a_b T_b_c``."""
    p_m = T_a_b[..., :2] + rotate(T_a_b[..., 2], T_b_c[..., :2])
    return _joined(p_m, wrap_angle(T_a_b[..., 2] + T_b_c[..., 2]))


def inverse(T_a_b: Float[np.ndarray, "... 3"]) -> Float[np.ndarray, "... 3"]:
    """Return ``T_b_a``."""
    yaw_rad = wrap_angle(-T_a_b[..., 2])
    return _joined(-rotate(yaw_rad, T_a_b[..., :2]), yaw_rad)


def between(
    T_a_b: Float[np.ndarray, "... 3"], T_a_c: Float[np.ndarray, "... 3"]
) -> Float[np.ndarray, "... 3"]:
    """Relative pose ``T_b_c = T_a_b^-1 T_a_c`` (the noise-free part of paper Eq. 2)."""
    p_m = rotate(-T_a_b[..., 2], T_a_c[..., :2] - T_a_b[..., :2])
    return _joined(p_m, wrap_angle(T_a_c[..., 2] - T_a_b[..., 2]))


def apply(T_a_b: Float[np.ndarray, "... 3"], p_b_m: Float[np.ndarray, "... 2"]) -> Float[np.ndarray, "... 2"]:
    """Coordinates in a of points given in b, m."""
    return T_a_b[..., :2] + rotate(T_a_b[..., 2], p_b_m)
