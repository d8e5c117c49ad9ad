"""Bearings between poses that nearly coincide: gtsam's beyond the least range, finite differences within."""

import gtsam
import numpy as np
import pytest

from wifipgo.graph.bearings import NEAREST_M, Bearings, bearing_residuals
from wifipgo.graph.solvers._near_bearings import near_bearing

UNIT = gtsam.noiseModel.Isotropic.Sigma(1, 1.0)


def apart(range_m: float, toward_rad: float) -> gtsam.Values:
    values = gtsam.Values()
    values.insert(0, gtsam.Pose2(0.3, 0.2, 1.1))
    x, y = 0.3 + range_m * np.cos(toward_rad), 0.2 + range_m * np.sin(toward_rad)
    values.insert(1, gtsam.Pose2(x, y, -0.7))
    return values


def jacobian(factor: gtsam.NonlinearFactor, values: gtsam.Values) -> np.ndarray:
    found: np.ndarray = factor.linearize(values).jacobian()[0].ravel()
    return found


@pytest.mark.parametrize("range_m", [1e-4, 0.01, 0.05, 0.0999, 0.5])
@pytest.mark.parametrize("azimuth_rad", [-2.0, 0.3, 1.4])
def test_slopes_are_finite_differences(range_m: float, azimuth_rad: float) -> None:
    values, factor = apart(range_m, 2.0), near_bearing(0, 1, azimuth_rad, UNIT)
    step, expected = 1e-4 * range_m, np.zeros(6)
    for k in range(6):
        ends = []
        for sign in (1.0, -1.0):
            moved, delta = gtsam.Values(values), np.zeros(3)
            delta[k % 3] = sign * step
            moved.update(k // 3, values.atPose2(k // 3).retract(delta))
            ends.append(factor.unwhitenedError(moved)[0])
        expected[k] = (ends[0] - ends[1]) / (2.0 * step)
    np.testing.assert_allclose(jacobian(factor, values), expected, atol=1e-4)


def test_beyond_the_least_range_it_is_gtsams() -> None:
    values = apart(1.01 * NEAREST_M, -1.0)
    ours, theirs = near_bearing(0, 1, 0.4, UNIT), gtsam.BearingFactorPose2(0, 1, gtsam.Rot2(0.4), UNIT)
    assert ours.error(values) == pytest.approx(theirs.error(values), rel=1e-12)
    np.testing.assert_allclose(jacobian(ours, values), jacobian(theirs, values), rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("range_m", [0.0, 1e-12, 1e-6, 0.05])
def test_slopes_are_bounded_and_residuals_those_of_the_arrays(range_m: float) -> None:
    values, factor = apart(range_m, 0.7), near_bearing(0, 1, 2.2, UNIT)
    assert np.abs(jacobian(factor, values)).max() < 2.0 * (1.0 + np.pi) / NEAREST_M
    poses = np.array([[[p.x(), p.y(), p.theta()]] for p in (values.atPose2(0), values.atPose2(1))])
    bearing = Bearings.measured(
        observer=np.array([[0, 0]]),
        target=np.array([[1, 0]]),
        azimuth_rad=np.array([[2.2]]),
        sigma_rad=1.0,
    )
    off = factor.unwhitenedError(values)
    np.testing.assert_allclose(np.abs(off), np.abs(bearing_residuals(poses, bearing)), atol=1e-6)
