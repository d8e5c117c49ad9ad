"""Planar rigid transforms as arrays of ``(x_m, y_m, yaw_rad)`` rows.

``T_a_b`` maps coordinates in frame b to coordinates in frame a, so neighbouring
letters cancel: ``T_world_j = compose(T_world_i, T_i_j)``.
"""

import numpy as np
from jaxtyping import Float


def wrap_angle(angle_rad: Float[np.ndarray, "..."]) -> Float[np.ndarray, "..."]:
    """Return the same directions in [-pi, pi), rad."""
    return np.mod(angle_rad + np.pi, 2.0 * np.pi) - np.pi


def length(v: Float[np.ndarray, "... 2"]) -> Float[np.ndarray, "..."]:
    """Length of vectors, several times faster than `np.hypot`, which guards against overflow."""
    x, y = v[..., 0], v[..., 1]
    out: np.ndarray = np.sqrt(x * x + y * y)
    return out


def rotate(yaw_rad: Float[np.ndarray, "..."], v_m: Float[np.ndarray, "... 2"]) -> Float[np.ndarray, "... 2"]:
    """Rotate vectors by ``yaw_rad`` (broadcasts over leading axes)."""
    x_m, y_m = _turned(yaw_rad, v_m[..., 0], v_m[..., 1])
    return _rows(x_m, y_m)


def _turned(yaw_rad: np.ndarray, x_m: np.ndarray, y_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates of vectors that are turned by ``yaw_rad``."""
    c, s = np.cos(yaw_rad), np.sin(yaw_rad)
    return c * x_m - s * y_m, s * x_m + c * y_m


def _rows(*columns: np.ndarray) -> np.ndarray:
    """Columns side by side along a new last axis, several times faster than `np.stack`."""
    out = np.empty((*columns[0].shape, len(columns)))
    for k, column in enumerate(columns):
        out[..., k] = column
    return out


def compose(
    T_a_b: Float[np.ndarray, "... 3"], T_b_c: Float[np.ndarray, "... 3"]
) -> Float[np.ndarray, "... 3"]:
    """Chain two transforms: ``T_a_c = T_a_b T_b_c``."""
    yaw_rad = T_a_b[..., 2]
    x_m, y_m = _turned(yaw_rad, T_b_c[..., 0], T_b_c[..., 1])
    return _rows(T_a_b[..., 0] + x_m, T_a_b[..., 1] + y_m, wrap_angle(yaw_rad + T_b_c[..., 2]))


def inverse(T_a_b: Float[np.ndarray, "... 3"]) -> Float[np.ndarray, "... 3"]:
    """Return ``T_b_a``."""
    yaw_rad = wrap_angle(-T_a_b[..., 2])
    x_m, y_m = _turned(yaw_rad, T_a_b[..., 0], T_a_b[..., 1])
    return _rows(-x_m, -y_m, yaw_rad)


def between(
    T_a_b: Float[np.ndarray, "... 3"], T_a_c: Float[np.ndarray, "... 3"]
) -> Float[np.ndarray, "... 3"]:
    """Relative pose ``T_b_c = T_a_b^-1 T_a_c`` (the noise-free part of paper Eq. 2)."""
    d = T_a_c - T_a_b
    x_m, y_m = _turned(-T_a_b[..., 2], d[..., 0], d[..., 1])
    return _rows(x_m, y_m, wrap_angle(d[..., 2]))


def apply(T_a_b: Float[np.ndarray, "... 3"], p_b_m: Float[np.ndarray, "... 2"]) -> Float[np.ndarray, "... 2"]:
    """Coordinates in a of points given in b, m."""
    x_m, y_m = _turned(T_a_b[..., 2], p_b_m[..., 0], p_b_m[..., 1])
    return _rows(T_a_b[..., 0] + x_m, T_a_b[..., 1] + y_m)
