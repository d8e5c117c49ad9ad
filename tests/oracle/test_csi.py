"""CSI of the antenna pair against one plane wave worked out by hand."""

import numpy as np
import pytest

from wifipgo.radio import csi
from wifipgo.radio.paths import Paths


def one_path(gain: complex, azimuth_rad: float, delay_s: float) -> Paths:
    return Paths(
        np.array([[gain]]),
        np.array([[delay_s]]),
        np.array([[azimuth_rad]]),
        np.array([[0.0]]),
        np.array([[0]]),
    )


def test_antennas_differ_by_the_plane_waves_travel() -> None:
    """The antenna ahead is ``gap cos(azimuth - heading)`` nearer to the source."""
    gap_m, wavelength_m, heading = 0.22, 0.06, np.array([[0.0, 0.7, 1.5]])
    channel = csi.pair_csi(
        one_path(2e-3 + 1e-3j, 1.1, 3e-8), heading, antenna_gap_m=gap_m, wavelength_m=wavelength_m
    )
    measured = channel[0, 0, :, 3] / channel[0, 1, :, 3]
    expected = np.exp(2j * np.pi * gap_m / wavelength_m * np.cos(1.1 - heading[0]))
    np.testing.assert_allclose(measured, expected, atol=1e-4)


def test_delay_turns_the_phase_along_the_subcarriers() -> None:
    delay_s = 4.7e-8
    channel = csi.centre_channel(one_path(1.0, 0.0, delay_s))[0]
    expected = np.exp(-2j * np.pi * csi.REPORTED_SUBCARRIERS * csi.SUBCARRIER_SPACING_HZ * delay_s)
    np.testing.assert_allclose(channel, expected, atol=1e-5)


def test_thirty_subcarriers_of_the_intel_5300() -> None:
    assert len(set(csi.REPORTED_SUBCARRIERS.tolist())) == 30
    assert csi.REPORTED_SUBCARRIERS.min() == -28
    assert csi.REPORTED_SUBCARRIERS.max() == 28


def test_snr_scale_is_power_over_thermal_noise() -> None:
    """0 dBm against -174 dBm/Hz + 10 log10(20 MHz) + 6 dB = -95 dBm."""
    assert 10.0 * np.log10(csi.RadioConfig(tx_power_dbm=0.0).snr_scale) == pytest.approx(94.99, abs=0.01)


def test_noise_is_white_and_of_the_stated_power() -> None:
    noise = csi.unit_noise((200, 2, 16, 30), rng=np.random.default_rng(0))
    assert np.mean(np.abs(noise) ** 2) == pytest.approx(1.0, abs=0.02)
    assert abs(np.mean(noise)) < 0.01
    assert abs(np.mean(noise**2)) < 0.01  # circular
    neighbours = np.mean(noise[..., 1:] * noise[..., :-1].conj())
    assert abs(neighbours) < 0.01


def test_received_csi_has_the_snr_it_should() -> None:
    channel = np.full((100, 2, 16, 30), 1e-3 + 0j, dtype=np.complex64)
    got = csi.received_csi(channel, snr_scale=1e7, rng=np.random.default_rng(1))
    power = np.mean(np.abs(got) ** 2)  # signal 1e-6 and noise 1e-7
    assert power == pytest.approx(1.1e-6, rel=0.02)


def test_config_names_what_it_refuses() -> None:
    with pytest.raises(ValueError, match=r"RadioConfig.carrier_hz must be in 1e9..10e9, got 0"):
        csi.RadioConfig(carrier_hz=0.0)
