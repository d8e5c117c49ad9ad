"""Planar rigid transforms as arrays of ``(x_m, y_m, yaw_rad)`` rows.

``T_a_b`` maps coordinates in frame b to coordinates in frame a, so neighbouring
letters cancel: ``T_world_j = compose(T_world_i, T_i_j)``. Tangent vectors are ``(x_m, y_m, yaw_rad)``
too, and every Jacobian of the group is here: the plane is that of complex numbers, in which the left
Jacobian of `exp` and its inverse are factors on a position.
"""

import numpy as np
from jaxtyping import Complex, Float

_TINY = 1e-300  # stands in for zero where a sine is divided by its angle
_IDENTITY = np.eye(3)
_SMALL_RAD = 5e-5  # of half a turn: below, a series serves


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


def chained(
    first: Float[np.ndarray, "paths 3"], motions: Float[np.ndarray, "paths steps 3"]
) -> Float[np.ndarray, "paths poses 3"]:
    """Poses that motions lead to, one after the other, the first pose among them."""
    poses = np.empty((len(motions), motions.shape[1] + 1, 3))
    poses[:, 0] = first
    for t in range(motions.shape[1]):
        poses[:, t + 1] = compose(poses[:, t], motions[:, t])
    return poses


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


def exp(twist: Float[np.ndarray, "... 3"]) -> Float[np.ndarray, "... 3"]:
    """Transform of a tangent vector: the way there is an arc."""
    p_m = left_jacobian_times(twist[..., 2], twist[..., 0] + 1j * twist[..., 1])
    return _rows(p_m.real, p_m.imag, wrap_angle(twist[..., 2]))


def log(T_a_b: Float[np.ndarray, "... 3"]) -> Float[np.ndarray, "... 3"]:
    """Tangent vector of a transform, inverse of `exp` for turns below pi."""
    yaw_rad = wrap_angle(T_a_b[..., 2])
    rho = inverse_left_jacobian(yaw_rad) * (T_a_b[..., 0] + 1j * T_a_b[..., 1])
    return _rows(rho.real, rho.imag, yaw_rad)


def left_jacobian_times(
    yaw_rad: Float[np.ndarray, "*n"], rho_m: Complex[np.ndarray, "*n"]
) -> Complex[np.ndarray, "*n"]:
    """Left Jacobian of `exp` on positions x + iy: ``sin(h) / h exp(i h)`` with h half the turn."""
    half = np.asarray(0.5 * yaw_rad)
    half = np.where(half == 0.0, _TINY, half)
    return rho_m * np.exp(1j * half) * (np.sin(half) / half)


def inverse_left_jacobian(yaw_rad: Float[np.ndarray, "*n"]) -> Complex[np.ndarray, "*n"]:
    """Inverse left Jacobian on positions x + iy: ``h cot(h) - i h`` with h half the turn."""
    half = np.asarray(0.5 * yaw_rad)
    half = np.where(half == 0.0, _TINY, half)
    return half / np.tan(half) - 1j * half


def inverse_left_jacobian_slope(inverse: Complex[np.ndarray, "*n"]) -> Complex[np.ndarray, "*n"]:
    """Derivative of `inverse_left_jacobian` by the turn, where it is known itself."""
    cot, half = inverse.real, -inverse.imag  # of half the turn: times its cotangent, and itself
    slope = (cot * (1.0 - cot) - half * half) / (2.0 * half)
    return np.where(np.abs(half) < _SMALL_RAD, half / -3.0, slope) - 0.5j


def adjoint(T_a_b: Float[np.ndarray, "... 3"]) -> Float[np.ndarray, "... 3 3"]:
    """Adjoint: tangent vectors, translation first, of frame b as those of frame a."""
    out = np.zeros((*T_a_b.shape[:-1], 3, 3))
    c, s = np.cos(T_a_b[..., 2]), np.sin(T_a_b[..., 2])
    out[..., 0, 0], out[..., 0, 1], out[..., 0, 2] = c, -s, T_a_b[..., 1]
    out[..., 1, 0], out[..., 1, 1], out[..., 1, 2] = s, c, -T_a_b[..., 0]
    out[..., 2, 2] = 1.0
    return out


def offset_jacobian(d_m: Float[np.ndarray, "... 2"]) -> Float[np.ndarray, "... 3 3"]:
    """Matrix that carries an error of a pose, in the axes of its world, to a point ``d_m`` away fixed to it.

    The adjoint of the translation back by ``d_m``.
    """
    out = np.empty((*d_m.shape[:-1], 3, 3))
    out[...] = _IDENTITY
    out[..., 0, 2], out[..., 1, 2] = -d_m[..., 1], d_m[..., 0]
    return out


def rotation_matrix(yaw_rad: Float[np.ndarray, "..."]) -> Float[np.ndarray, "... 2 2"]:
    """Rotation matrices."""
    c, s = np.cos(yaw_rad), np.sin(yaw_rad)
    return np.stack([c, -s, s, c], axis=-1).reshape(*c.shape, 2, 2)
