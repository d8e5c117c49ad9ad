"""Confidence of profiles whose figures are known."""

import numpy as np
import pytest

from wifipgo.radio.aoa.confidence import confidence
from wifipgo.radio.aoa.steering import azimuth_grid

GRID = azimuth_grid(720)


def bump(centre_rad: float, sigma_rad: float, height: float = 1.0) -> np.ndarray:
    away = np.angle(np.exp(1j * (GRID - centre_rad)))
    return height * np.exp(-0.5 * (away / sigma_rad) ** 2)


@pytest.mark.parametrize("centre_rad", [0.3, -3.1, 3.14])
def test_figures_of_a_gaussian(centre_rad: float) -> None:
    """Width 2 sqrt(2 ln 2) sigma, variance sigma^2 over pi^2 / 3, wherever it stands and however high."""
    found = confidence(np.stack([bump(centre_rad, 0.1), 7.0 * bump(centre_rad, 0.2)]))
    np.testing.assert_allclose(found.width_rad, np.sqrt(8.0 * np.log(2.0)) * np.array([0.1, 0.2]), rtol=2e-3)
    np.testing.assert_allclose(found.variance, 3.0 * np.array([0.1, 0.2]) ** 2 / np.pi**2, rtol=5e-3)
    np.testing.assert_array_equal(found.sidelobe_ratio, 0.0)


def test_side_lobe_and_variance_of_two_lines() -> None:
    """A second line of height h opposite to the first puts a share h / (1 + h) at distance pi."""
    profile = np.zeros((1, 720))
    profile[0, [100, 460]] = 1.0, 0.6
    found = confidence(profile)
    assert found.sidelobe_ratio[0] == pytest.approx(0.6)
    assert found.variance[0] == pytest.approx(3.0 * 0.6 / 1.6, rel=1e-5)


def test_nothing_and_flat_profiles_are_not_trusted() -> None:
    found = confidence(np.stack([np.zeros(720), np.ones(720)]))
    np.testing.assert_allclose(found.width_rad, 2.0 * np.pi)
    np.testing.assert_array_equal(found.sidelobe_ratio, 1.0)
    np.testing.assert_allclose(found.variance, 1.0)
    np.testing.assert_allclose(found.expected_error_rad, 0.5 * np.pi)


def test_a_peak_that_never_falls_to_half_is_as_wide_as_the_circle() -> None:
    assert confidence(1.0 + 0.1 * np.cos(GRID)[None]).width_rad[0] == pytest.approx(2.0 * np.pi)
