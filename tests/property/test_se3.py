"""Transforms in space form a group, agree with matrices, and hold the plane inside them."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.linalg import expm

from wifipgo import se2, se3

TWISTS = arrays(float, (3, 6), elements=st.floats(-1.7, 1.7))
PLANAR = arrays(float, (2, 3), elements=st.floats(-3.1, 3.1))


def matrix(T: np.ndarray) -> np.ndarray:
    """4 x 4 matrix of one transform."""
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = se3.rotation_matrix(T[3:]), T[:3]
    return out


def close(a: np.ndarray, b: np.ndarray) -> None:
    """Equal as transforms: near half a turn q and -q may change places."""
    np.testing.assert_allclose(a[..., :3], b[..., :3], atol=1e-9)
    np.testing.assert_allclose(se3.rotation_matrix(a[..., 3:]), se3.rotation_matrix(b[..., 3:]), atol=1e-9)


@given(TWISTS)
def test_group_axioms(twists: np.ndarray) -> None:
    a, b, c = se3.exp(twists)
    close(se3.compose(se3.compose(a, b), c), se3.compose(a, se3.compose(b, c)))
    close(se3.compose(a, se3.IDENTITY), a)
    close(se3.compose(se3.IDENTITY, a), a)
    close(se3.compose(a, se3.inverse(a)), se3.IDENTITY)
    close(se3.compose(a, se3.between(a, b)), b)


@given(TWISTS)
def test_operations_are_those_of_matrices(twists: np.ndarray) -> None:
    a, b, _ = se3.exp(twists)
    np.testing.assert_allclose(matrix(se3.compose(a, b)), matrix(a) @ matrix(b), atol=1e-9)
    point = np.append(twists[2, :3], 1.0)
    np.testing.assert_allclose(se3.apply(a, point[:3]), (matrix(a) @ point)[:3], atol=1e-9)
    np.testing.assert_allclose(np.abs(se3.quaternion(se3.rotation_matrix(a[3:])) @ a[3:]), 1.0, atol=1e-9)


@given(TWISTS)
def test_exp_is_the_matrix_exponential_and_log_its_inverse(twists: np.ndarray) -> None:
    for twist in (twists[0], 1e-5 * twists[1]):
        generator = np.zeros((4, 4))
        generator[:3, :3], generator[:3, 3] = se3.cross_matrix(twist[3:]), twist[:3]
        np.testing.assert_allclose(matrix(se3.exp(twist)), expm(generator), atol=1e-9)
        np.testing.assert_allclose(se3.log(se3.exp(twist)), twist, atol=1e-7)


@given(PLANAR)
def test_the_plane_is_a_subgroup(planar: np.ndarray) -> None:
    a, b = planar[:1], planar[1:]
    close(se3.compose(se3.lift(a), se3.lift(b)), se3.lift(se2.compose(a, b)))
    np.testing.assert_allclose(se3.project(se3.lift(planar)), planar, atol=1e-9)


def test_the_adjoint_moves_a_small_motion_past_a_transform() -> None:
    """``T exp(x) = exp(Ad x) T``, whatever x is."""
    rng = np.random.default_rng(0)
    T, x = se3.exp(rng.uniform(-1.0, 1.0, (20, 6))), rng.uniform(-0.5, 0.5, (20, 6))
    moved = (se3.adjoint(T) @ x[..., None])[..., 0]
    left, right = se3.compose(T, se3.exp(x)), se3.compose(se3.exp(moved), T)
    np.testing.assert_allclose(left, right, atol=1e-12)
