"""Transforms against 3 x 3 matrices, an independent representation."""

import numpy as np

from wifipgo import se2, se3


def as_matrix(poses: np.ndarray) -> np.ndarray:
    out = np.zeros((len(poses), 3, 3))
    out[:, :2, 2], out[:, 2, 2] = poses[:, :2], 1.0
    out[:, 0, 0] = out[:, 1, 1] = np.cos(poses[:, 2])
    out[:, 1, 0] = np.sin(poses[:, 2])
    out[:, 0, 1] = -out[:, 1, 0]
    return out


def test_chain_inverse_and_points_match_matrices() -> None:
    rng = np.random.default_rng(1)
    a, b = rng.uniform(-3.0, 3.0, (2, 50, 3))
    p = rng.uniform(-3.0, 3.0, (50, 2))
    A, B = as_matrix(a), as_matrix(b)
    np.testing.assert_allclose(as_matrix(se2.compose(a, b)), A @ B, atol=1e-12)
    np.testing.assert_allclose(as_matrix(se2.inverse(a)), np.linalg.inv(A), atol=1e-12)
    np.testing.assert_allclose(as_matrix(se2.between(a, b)), np.linalg.inv(A) @ B, atol=1e-12)
    homogeneous = np.concatenate([p, np.ones((50, 1))], axis=1)[..., None]
    np.testing.assert_allclose(se2.apply(a, p), (A @ homogeneous)[:, :2, 0], atol=1e-12)


def test_wrap_keeps_direction_and_range() -> None:
    angles = np.linspace(-20.0, 20.0, 4001)
    wrapped = se2.wrap_angle(angles)
    assert wrapped.min() >= -np.pi
    assert wrapped.max() < np.pi
    np.testing.assert_allclose(np.exp(1j * wrapped), np.exp(1j * angles), atol=1e-12)


def drawn(seed: int, n: int = 50) -> np.ndarray:
    """Tangent vectors, some without a turn, some nearly so."""
    twist = np.random.default_rng(seed).uniform(-1.0, 1.0, (n, 3)) * [3.0, 3.0, 3.1]
    twist[:3, 2] = 0.0, 1e-12, -1e-7
    return twist


def test_exp_and_log_are_those_of_space() -> None:
    """The plane is the part of space whose turns are about z."""
    twist = drawn(0)
    wide = np.zeros((len(twist), 6))
    wide[:, [0, 1, 5]] = twist
    np.testing.assert_allclose(se2.exp(twist), se3.project(se3.exp(wide)), atol=1e-12)
    np.testing.assert_allclose(se2.log(se2.exp(twist)), twist, atol=1e-9)


def test_the_adjoint_moves_a_small_motion_past_a_transform() -> None:
    """``T exp(x) = exp(Ad x) T``, whatever x is."""
    T, x = se2.exp(drawn(1)), 0.3 * drawn(2)
    moved = (se2.adjoint(T) @ x[..., None])[..., 0]
    left, right = se2.compose(T, se2.exp(x)), se2.compose(se2.exp(moved), T)
    np.testing.assert_allclose(se2.between(left, right), 0.0, atol=1e-12)


def test_an_offset_is_the_adjoint_of_going_back() -> None:
    d_m = drawn(3)[:, :2]
    back = np.column_stack([-d_m, np.zeros(len(d_m))])
    np.testing.assert_array_equal(se2.offset_jacobian(d_m), se2.adjoint(back))


def test_the_inverse_left_jacobian_undoes_the_left_and_its_slope_is_its_derivative() -> None:
    yaw_rad = drawn(4)[:, 2]
    inverse = se2.inverse_left_jacobian(yaw_rad)
    np.testing.assert_allclose(se2.left_jacobian_times(yaw_rad, inverse), 1.0, atol=1e-12)
    h = 1e-5
    slope = (se2.inverse_left_jacobian(yaw_rad + h) - se2.inverse_left_jacobian(yaw_rad - h)) / (2.0 * h)
    np.testing.assert_allclose(se2.inverse_left_jacobian_slope(inverse), slope, atol=1e-6)


def test_a_chain_of_motions_is_a_product_of_matrices() -> None:
    first, motions = drawn(5)[:2], np.stack([drawn(6), drawn(7)])
    poses = se2.chained(first, motions)
    for start, steps, found in zip(first, motions, poses, strict=True):
        expected = [as_matrix(start[None])[0]]
        for step in as_matrix(steps):
            expected.append(expected[-1] @ step)
        np.testing.assert_allclose(as_matrix(found), expected, atol=1e-9)
