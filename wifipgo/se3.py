"""Rigid transforms in space as arrays of ``(x_m, y_m, z_m, qx, qy, qz, qw)`` rows, as in g2o files.

``T_a_b`` maps coordinates in frame b to coordinates in frame a, so neighbouring letters
cancel: ``T_world_j = compose(T_world_i, T_i_j)``. Quaternions have length one; q and -q are
one rotation, and every function returns the one with qw >= 0. Tangent vectors are
``(translation, rotation vector)``. `lift` and `project` are the only bridge to the plane.
"""

import numpy as np
from jaxtyping import Float
from scipy.spatial.transform import Rotation

IDENTITY = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
SMALL_RAD = 1e-4  # below it, series replace quotients of vanishing numbers


def unit_quaternion(q: Float[np.ndarray, "... 4"]) -> Float[np.ndarray, "... 4"]:
    """Scale to length one and turn the sign so that qw >= 0."""
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    return np.where(q[..., 3:] < 0.0, -q, q)


def product(p: Float[np.ndarray, "... 4"], q: Float[np.ndarray, "... 4"]) -> Float[np.ndarray, "... 4"]:
    """Hamilton product: the rotation q, then p."""
    u, v, a, b = p[..., :3], q[..., :3], p[..., 3:], q[..., 3:]
    axis = a * v + b * u + np.cross(u, v)
    return unit_quaternion(np.concatenate([axis, a * b - (u * v).sum(-1, keepdims=True)], axis=-1))


def rotate(q: Float[np.ndarray, "... 4"], v_m: Float[np.ndarray, "... 3"]) -> Float[np.ndarray, "... 3"]:
    """Rotate vectors (broadcasts over leading axes)."""
    twice = 2.0 * np.cross(q[..., :3], v_m)
    return v_m + q[..., 3:] * twice + np.cross(q[..., :3], twice)


def compose(
    T_a_b: Float[np.ndarray, "... 7"], T_b_c: Float[np.ndarray, "... 7"]
) -> Float[np.ndarray, "... 7"]:
    """Chain two transforms: ``T_a_c = T_a_b T_b_c``."""
    p_m = T_a_b[..., :3] + rotate(T_a_b[..., 3:], T_b_c[..., :3])
    return np.concatenate([p_m, product(T_a_b[..., 3:], T_b_c[..., 3:])], axis=-1)


def inverse(T_a_b: Float[np.ndarray, "... 7"]) -> Float[np.ndarray, "... 7"]:
    """Return ``T_b_a``."""
    q = unit_quaternion(T_a_b[..., 3:] * [-1.0, -1.0, -1.0, 1.0])
    return np.concatenate([-rotate(q, T_a_b[..., :3]), q], axis=-1)


def between(
    T_a_b: Float[np.ndarray, "... 7"], T_a_c: Float[np.ndarray, "... 7"]
) -> Float[np.ndarray, "... 7"]:
    """Relative pose ``T_b_c = T_a_b^-1 T_a_c`` (the noise-free part of paper Eq. 2)."""
    return compose(inverse(T_a_b), T_a_c)


def apply(T_a_b: Float[np.ndarray, "... 7"], p_b_m: Float[np.ndarray, "... 3"]) -> Float[np.ndarray, "... 3"]:
    """Coordinates in a of points given in b, m."""
    return T_a_b[..., :3] + rotate(T_a_b[..., 3:], p_b_m)


def rotation_matrix(q: Float[np.ndarray, "... 4"]) -> Float[np.ndarray, "... 3 3"]:
    """Rotation matrices of quaternions of any length but zero."""
    return Rotation.from_quat(q.reshape(-1, 4)).as_matrix().reshape(*q.shape[:-1], 3, 3)


def quaternion(R: Float[np.ndarray, "... 3 3"]) -> Float[np.ndarray, "... 4"]:
    """Quaternions of rotation matrices."""
    q = Rotation.from_matrix(R.reshape(-1, 3, 3)).as_quat()
    return unit_quaternion(q.reshape(*R.shape[:-2], 4))


def exp(twist: Float[np.ndarray, "... 6"]) -> Float[np.ndarray, "... 7"]:
    """Transform of a tangent vector ``(rho_m, omega_rad)``: rotation by omega, translation V(omega) rho."""
    omega = twist[..., 3:]
    q = Rotation.from_rotvec(omega.reshape(-1, 3)).as_quat().reshape(*twist.shape[:-1], 4)
    p_m = (left_jacobian(omega) @ twist[..., :3, None])[..., 0]
    return np.concatenate([p_m, unit_quaternion(q)], axis=-1)


def log(T_a_b: Float[np.ndarray, "... 7"]) -> Float[np.ndarray, "... 6"]:
    """Tangent vector of a transform, inverse of `exp` for rotations below pi."""
    omega = Rotation.from_quat(T_a_b[..., 3:].reshape(-1, 4)).as_rotvec().reshape(*T_a_b.shape[:-1], 3)
    rho = np.linalg.solve(left_jacobian(omega), T_a_b[..., :3, None])[..., 0]
    return np.concatenate([rho, omega], axis=-1)


def adjoint(T_a_b: Float[np.ndarray, "... 7"]) -> Float[np.ndarray, "... 6 6"]:
    """Adjoint: tangent vectors, translation first, of frame b as those of frame a."""
    R = rotation_matrix(T_a_b[..., 3:])
    above = np.concatenate([R, cross_matrix(T_a_b[..., :3]) @ R], axis=-1)
    return np.concatenate([above, np.concatenate([np.zeros_like(R), R], axis=-1)], axis=-2)


def lift(T_a_b: Float[np.ndarray, "... 3"]) -> Float[np.ndarray, "... 7"]:
    """Planar transform ``(x_m, y_m, yaw_rad)`` as one in space: z = 0, rotation about z."""
    half_rad = 0.5 * T_a_b[..., 2]
    out = np.zeros((*T_a_b.shape[:-1], 7))
    out[..., :2], out[..., 5], out[..., 6] = T_a_b[..., :2], np.sin(half_rad), np.cos(half_rad)
    out[..., 3:] = unit_quaternion(out[..., 3:])
    return out


def in_space(poses: Float[np.ndarray, "poses dims"]) -> Float[np.ndarray, "poses 7"]:
    """Poses of either kind, in space: planar ones lifted."""
    return lift(poses) if poses.shape[1] == 3 else poses


def project(T_a_b: Float[np.ndarray, "... 7"]) -> Float[np.ndarray, "... 3"]:
    """Planar part ``(x_m, y_m, yaw_rad)``: the height goes, and yaw is where the x axis points from above."""
    x, y, z, w = np.moveaxis(T_a_b[..., 3:], -1, 0)
    yaw_rad = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y**2 + z**2))
    return np.concatenate([T_a_b[..., :2], yaw_rad[..., None]], axis=-1)


def cross_matrix(v: Float[np.ndarray, "... 3"]) -> Float[np.ndarray, "... 3 3"]:
    """Matrix of the cross product: ``cross_matrix(v) @ u = v x u``."""
    out = np.zeros((*v.shape, 3))
    out[..., 2, 1], out[..., 0, 2], out[..., 1, 0] = v[..., 0], v[..., 1], v[..., 2]
    return out - np.swapaxes(out, -1, -2)


def left_jacobian(omega: Float[np.ndarray, "... 3"]) -> Float[np.ndarray, "... 3 3"]:
    """Left Jacobian of rotations, ``I + (1 - cos a) / a^2 W + (a - sin a) / a^3 W^2``.

    W is ``cross_matrix(omega)`` and a the length of omega.
    """
    angle = np.linalg.norm(omega, axis=-1)[..., None, None]
    safe = np.maximum(angle, SMALL_RAD)
    first = np.where(angle < SMALL_RAD, 0.5 - angle**2 / 24.0, 2.0 * np.sin(0.5 * safe) ** 2 / safe**2)
    second = np.where(angle < SMALL_RAD, 1.0 / 6.0 - angle**2 / 120.0, (safe - np.sin(safe)) / safe**3)
    W = cross_matrix(omega)
    return np.eye(3) + first * W + second * (W @ W)
