"""Antennas that shade and hear each other: by hand for one wave, and nothing where both are off."""

import numpy as np
import pytest

from wifipgo.radio.channel.antenna_patterns import coupled, pattern_gain

PAIR_M = np.array([[0.11, 0.0], [-0.11, 0.0]])


def test_from_behind_an_antenna_loses_what_is_stated() -> None:
    """Body looks to +y: a wave from there meets the front antenna openly, the other behind it."""
    azimuth, heading = np.deg2rad([[90.0, -90.0, 0.0]]), np.deg2rad([[90.0]])
    lost_db = -20.0 * np.log10(pattern_gain(azimuth, heading, PAIR_M, front_to_back_db=6.0)[0, :, :, 0])
    np.testing.assert_allclose(lost_db, [[0.0, 6.0], [6.0, 0.0], [3.0, 3.0]], atol=1e-5)


def test_an_antenna_in_the_middle_hears_all_alike() -> None:
    three_m = np.array([[0.11, 0.0], [0.0, 0.0], [-0.11, 0.0]])
    gain = pattern_gain(np.array([[0.3, 2.0]]), np.array([[0.0]]), three_m, front_to_back_db=9.0)
    np.testing.assert_array_equal(gain[:, :, 1], 1.0)


def test_each_hears_a_share_of_the_other_half_a_wave_late() -> None:
    """Antennas 22 cm apart at a wavelength of 44 cm: the share comes with its sign turned."""
    channel = np.array([1.0 + 0.0j, 2.0j], dtype=np.complex64).reshape(1, 2, 1, 1)
    heard = coupled(channel, PAIR_M, coupling=0.1, wavelength_m=0.44).ravel()
    assert heard.tolist() == pytest.approx([1.0 - 0.2j, 2.0j - 0.1], abs=1e-6)
