"""Transforms against 3 x 3 matrices, an independent representation."""

import numpy as np

from wifipgo import se2


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
