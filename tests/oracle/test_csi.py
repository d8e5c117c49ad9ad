"""CSI of antennas that turn and move, against plane waves worked out by hand."""

from typing import Any

import numpy as np
import pytest

from wifipgo.radio import aoa
from wifipgo.radio.channel import csi
from wifipgo.radio.channel.bands import BANDS, band_of
from wifipgo.radio.propagation.paths import Paths

GAP_M, WAVELENGTH_M = 0.22, 0.06


def one_path(gain: complex, azimuth_rad: float, delay_s: float) -> Paths:
    return Paths(
        np.array([[gain]]),
        np.array([[delay_s]]),
        np.array([[azimuth_rad]]),
        np.array([[0.0]]),
        np.array([[0]]),
    )


def some_paths(n_links: int, n_paths: int) -> Paths:
    rng = np.random.default_rng(0)
    gain = rng.normal(size=(2, n_links, n_paths))
    delay_s, azimuth_rad = rng.uniform(1e-8, 1e-7, gain[0].shape), rng.uniform(-3.0, 3.0, gain[0].shape)
    return Paths(
        gain[0] + 1j * gain[1], delay_s, azimuth_rad, np.zeros(gain[0].shape), np.ones(gain[0].shape, int)
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


@pytest.mark.parametrize("bandwidth_hz", BANDS)
def test_delay_turns_the_phase_along_the_subcarriers(bandwidth_hz: float) -> None:
    delay_s = 4.7e-8
    channel = csi.centre_channel(one_path(1.0, 0.0, delay_s), bandwidth_hz=bandwidth_hz)[0]
    at_hz = band_of(bandwidth_hz).subcarriers * csi.SUBCARRIER_SPACING_HZ
    np.testing.assert_allclose(channel, np.exp(-2j * np.pi * at_hz * delay_s), atol=2e-5)


@pytest.mark.parametrize("bandwidth_hz", BANDS)
@pytest.mark.parametrize("n_links", [1, 300])
def test_few_links_and_many_are_sums_over_paths(n_links: int, bandwidth_hz: float) -> None:
    paths = some_paths(n_links, 5)
    at_hz = band_of(bandwidth_hz).subcarriers * csi.SUBCARRIER_SPACING_HZ
    expected = (paths.gain[..., None] * np.exp(-2j * np.pi * at_hz * paths.delay_s[..., None])).sum(axis=1)
    most = np.abs(paths.gain).sum(axis=1).max()
    channel = csi.centre_channel(paths, bandwidth_hz=bandwidth_hz)
    np.testing.assert_allclose(channel, expected, rtol=0.0, atol=1e-5 * most)


@pytest.mark.parametrize("bandwidth_hz", BANDS)
def test_an_array_of_the_pair_is_the_pair(bandwidth_hz: float) -> None:
    """The general way for any antennas against the fast one, a turn of 7 packets."""
    paths, heading = some_paths(5, 4), np.random.default_rng(1).uniform(-3.0, 3.0, (5, 7))
    pair = csi.pair_csi(
        paths, heading, antenna_gap_m=GAP_M, wavelength_m=WAVELENGTH_M, bandwidth_hz=bandwidth_hz
    )
    offset_m = csi.antenna_offsets(np.array([[GAP_M / 2.0, 0.0], [-GAP_M / 2.0, 0.0]]), heading)
    array = csi.array_csi(paths, offset_m, wavelength_m=WAVELENGTH_M, bandwidth_hz=bandwidth_hz)
    np.testing.assert_allclose(array, pair, atol=2e-5)


@pytest.mark.parametrize("axes", [2, 3])
def test_one_path_on_a_moving_antenna_is_displacement_steering(axes: int) -> None:
    """A curve of 5 m, nearly a hundred wavelengths: the phase of one way from azimuth 1.1."""
    s = np.linspace(0.0, 1.0, 40)[:, None]
    displacement_m = np.concatenate([5.0 * s, np.sin(4.0 * s), 0.0 * s], axis=1)
    offset_m = csi.antenna_offsets(np.zeros((1, 2)), np.zeros((1, 40)), displacement_m[:, :axes])
    got = csi.array_csi(one_path(1.0, 1.1, 0.0), offset_m, wavelength_m=WAVELENGTH_M)
    expected = aoa.displacement_steering(
        displacement_m, np.array([1.1]), elevation_rad=0.0, wavelength_m=WAVELENGTH_M, passes=1
    )
    assert got.shape == (1, 1, 40, 30)
    np.testing.assert_allclose(got[0, 0], np.repeat(expected, 30, axis=1), atol=1e-5)


def test_offsets_add_body_and_antenna_one_displacement_per_link() -> None:
    """Heading north, 2 cm ahead and 1 cm left is (-1, 2) cm in the world."""
    heading = np.full((2, 1), np.pi / 2.0)
    displacement_m = np.array([[[1.0, 0.0]], [[0.0, 3.0]]])
    offset_m = csi.antenna_offsets(np.array([[0.02, 0.01]]), heading, displacement_m)
    np.testing.assert_allclose(offset_m[:, 0, 0], [[0.99, 0.02], [-0.01, 3.02]], atol=1e-12)


def test_thirty_subcarriers_of_the_intel_5300() -> None:
    assert len(set(csi.REPORTED_SUBCARRIERS.tolist())) == 30
    assert csi.REPORTED_SUBCARRIERS.min() == -28
    assert csi.REPORTED_SUBCARRIERS.max() == 28


def test_wide_band_reports_every_fourth_subcarrier() -> None:
    """802.11n-2009, 40 MHz, Ng = 4: -58, -54 ... -2, 2 ... 58."""
    by_hand = [*range(-58, 0, 4), *range(2, 59, 4)]
    assert band_of(40e6).subcarriers.tolist() == by_hand
    assert len(by_hand) == 30


def test_twice_the_bandwidth_is_twice_the_noise() -> None:
    narrow, wide = csi.RadioConfig().snr_scale, csi.RadioConfig(bandwidth_hz=40e6).snr_scale
    assert narrow / wide == pytest.approx(2.0)


def test_snr_scale_is_power_over_thermal_noise() -> None:
    """0 dBm against -174 dBm/Hz + 10 log10(20 MHz) + 6 dB = -95 dBm."""
    assert 10.0 * np.log10(csi.RadioConfig(tx_power_dbm=0.0).snr_scale) == pytest.approx(94.99, abs=0.01)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"carrier_hz": 0.0}, r"RadioConfig.carrier_hz must be in 1e\+09..1e\+10, got 0"),
        ({"carrier_hz": float("nan")}, r"RadioConfig.carrier_hz must be in 1e\+09..1e\+10, got nan"),
        ({"bandwidth_hz": 80e6}, r"RadioConfig.bandwidth_hz must be 20e6 or 40e6, got 80000000.0"),
        (
            {"antennas_m": ((0.0, 0.0),) * 2},
            r"RadioConfig.antennas_m must be positions at least 0.0001 m apart",
        ),
        (
            {"antennas_m": ((0.0,),)},
            r"RadioConfig.antennas_m must be pairs \(x_m, y_m\) of at most 10 m, got",
        ),
        ({"antennas_m": ((0.0, float("inf")),)}, r"RadioConfig.antennas_m must be pairs"),
        ({"antennas_m": tuple((0.1 * k, 0.0) for k in range(4))}, r"antennas_m must be at most 3 positions"),
    ],
)
def test_config_names_what_it_refuses(values: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        csi.RadioConfig(**values)


def test_displacements_that_are_no_places_are_refused() -> None:
    antennas_m, heading = np.zeros((1, 2)), np.zeros((1, 3))
    with pytest.raises(ValueError, match="displacement_m must be finite"):
        csi.antenna_offsets(antennas_m, heading, np.full((3, 2), np.nan))
    with pytest.raises(ValueError, match="axes of displacement_m must be 2 or 3"):
        csi.antenna_offsets(antennas_m, heading, np.zeros((3, 4)))
    with pytest.raises(ValueError, match="bandwidth_hz must be 20e6 or 40e6"):
        csi.centre_channel(one_path(1.0, 0.0, 0.0), bandwidth_hz=10e6)


def test_no_links_are_no_rows() -> None:
    nothing, heading = some_paths(0, 2), np.zeros((0, 8))
    pair = csi.pair_csi(nothing, heading, antenna_gap_m=GAP_M, wavelength_m=WAVELENGTH_M)
    offset_m = csi.antenna_offsets(np.zeros((3, 2)), heading)
    array = csi.array_csi(nothing, offset_m, wavelength_m=WAVELENGTH_M)
    assert pair.shape == (0, 2, 8, 30)
    assert array.shape == (0, 3, 8, 30)
