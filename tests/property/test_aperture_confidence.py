"""Confidence of aperture bearings: closed forms, symmetries, and what it may look at."""

import math

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given

from wifipgo.radio.aoa import azimuth_grid
from wifipgo.radio.aoa.confidence import EXPONENT, confidences, expected_errors_rad, least_confident


def lines(heights: dict[int, float]) -> np.ndarray:
    """A profile that is zero but for bins of given heights."""
    profile = np.zeros((1, 360))
    for bin_, height in heights.items():
        profile[0, bin_] = height
    return profile


def expected_rad(profile: np.ndarray) -> float:
    """Expected error of the highest bin."""
    return float(expected_errors_rad(profile, azimuth_grid(360)[profile.argmax(axis=1)])[0])


@given(st.integers(0, 359), st.integers(1, 180), st.floats(0.0, 1.0), st.floats(1e-3, 1.0))
def test_two_lines_have_a_closed_form(at: int, apart: int, second: float, height: float) -> None:
    """Weights 1 and s^k at distances 0 and d give d s^k / (1 + s^k), wherever they stand and however high."""
    profile = lines({(at + apart) % 360: second * height, at: height})
    found = expected_errors_rad(profile, azimuth_grid(360)[[at]])[0]
    weight = second**EXPONENT
    assert found == pytest.approx(math.radians(apart) * weight / (1.0 + weight), abs=1e-9)


def test_flat_and_empty_profiles_are_guesses() -> None:
    for profile in (np.zeros((1, 360)), np.full((1, 360), 0.3)):
        assert expected_rad(profile) == pytest.approx(math.pi / 2.0)
        assert confidences(np.array([expected_rad(profile)]))[0] == pytest.approx(0.0, abs=1e-9)
    assert confidences(np.array([expected_rad(lines({7: 0.1}))]))[0] == 1.0


@given(st.integers(0, 2**32 - 1), st.integers(0, 359))
def test_expected_errors_turn_with_the_world(seed: int, turn: int) -> None:
    profile = np.random.default_rng(seed).uniform(0.0, 1.0, (1, 360))
    assert expected_rad(np.roll(profile, turn, axis=1)) == pytest.approx(expected_rad(profile))


@given(st.lists(st.floats(0.0, 3.0), max_size=60), st.floats(0.0, 1.0))
def test_rejected_are_the_worst_and_never_more_than_the_share(values: list[float], share: float) -> None:
    expected = np.array(values, dtype=float)
    out = least_confident(expected, share=share)
    assert out.sum() <= share * len(values) + 1e-6
    assert out.sum() > share * len(values) - 1.0 - 1e-6
    if out.any() and not out.all():
        assert expected[out].min() >= expected[~out].max()


def test_a_tenth_of_thirty_is_three_and_of_nine_none() -> None:
    assert least_confident(np.arange(30.0)).nonzero()[0].tolist() == [27, 28, 29]
    assert not least_confident(np.arange(9.0)).any()
    with pytest.raises(ValueError, match="share"):
        least_confident(np.arange(3.0), share=1.1)
