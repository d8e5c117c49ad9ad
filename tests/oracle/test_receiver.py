"""What a receiver does to CSI, one impairment at a time, against its closed form."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wifipgo.radio import aoa
from wifipgo.radio.channel import receiver
from wifipgo.radio.channel.bands import BANDS, SUBCARRIER_SPACING_HZ, band_of
from wifipgo.radio.channel.impairments import ImpairmentConfig, draw_episode_impairments, true_headings

IDEAL = ImpairmentConfig(noise_floor=False, common_phase=False, timing_jitter_s=0.0)


def some_channel(n_links: int = 4, n_antennas: int = 2, seed: int = 0) -> np.ndarray:
    parts = np.random.default_rng(seed).normal(size=(2, n_links, n_antennas, 16, 30))
    return (1e-4 * (parts[0] + 1j * parts[1])).astype(np.complex64)


def received(channel: np.ndarray, seed: int = 0, **changes: Any) -> np.ndarray:
    """CSI with nothing wrong but what is named."""
    values = {"noise_floor": False, "common_phase": False, "timing_jitter_s": 0.0} | changes
    cfg = ImpairmentConfig(**values)
    return receiver.received_csi(channel, snr_scale=1e9, rng=np.random.default_rng(seed), cfg=cfg)


def test_with_every_switch_off_the_channel_is_what_is_reported() -> None:
    channel = some_channel()
    np.testing.assert_array_equal(received(channel), channel)


def test_noise_is_white_and_of_the_stated_power() -> None:
    noise = receiver.white_noise((200, 2, 16, 30), rng=np.random.default_rng(0))
    assert np.mean(np.abs(noise) ** 2) == pytest.approx(1.0, abs=0.02)
    assert abs(np.mean(noise)) < 0.01
    assert abs(np.mean(noise**2)) < 0.01  # circular
    neighbours = np.mean(noise[..., 1:] * noise[..., :-1].conj())
    assert abs(neighbours) < 0.01


def test_received_csi_has_the_snr_it_should() -> None:
    channel = np.full((100, 2, 16, 30), 1e-3 + 0j, dtype=np.complex64)
    got = receiver.received_csi(channel, snr_scale=1e7, rng=np.random.default_rng(1))
    power = np.mean(np.abs(got) ** 2)  # signal 1e-6 and noise 1e-7
    assert power == pytest.approx(1.1e-6, rel=0.02)


def test_common_phase_is_uniform_and_one_per_packet() -> None:
    flat = np.ones((200, 3, 16, 30), np.complex64)
    got = received(flat, common_phase=True)
    np.testing.assert_allclose(got, np.broadcast_to(got[:, :1, :, :1], got.shape), atol=1e-6)
    phasors = got[:, 0, :, 0]
    np.testing.assert_allclose(np.abs(phasors), 1.0, atol=1e-6)
    for harmonic in (1, 2, 3):
        assert abs(np.mean(phasors**harmonic)) < 3.0 / np.sqrt(phasors.size)


@pytest.mark.parametrize("bandwidth_hz", BANDS)
def test_timing_is_a_slope_over_subcarriers_of_the_stated_spread(bandwidth_hz: float) -> None:
    cfg = ImpairmentConfig(noise_floor=False, common_phase=False, timing_jitter_s=15e-9)
    got = receiver.received_csi(
        np.ones((400, 1, 16, 30), np.complex64),
        snr_scale=1.0,
        rng=np.random.default_rng(0),
        cfg=cfg,
        bandwidth_hz=bandwidth_hz,
    )[:, 0].reshape(-1, 30)
    at_hz = SUBCARRIER_SPACING_HZ * band_of(bandwidth_hz).subcarriers
    delay_s = -np.angle(got[:, 16] * got[:, 15].conj()) / (2.0 * np.pi * (at_hz[16] - at_hz[15]))
    np.testing.assert_allclose(got, np.exp(-2j * np.pi * delay_s[:, None] * at_hz), atol=1e-3)
    assert delay_s.std() == pytest.approx(15e-9, rel=0.05)
    assert abs(delay_s.mean()) < 1e-9


@settings(max_examples=20, deadline=None)
@given(jitter_s=st.floats(1e-9, 1e-7), seed=st.integers(0, 2**20))
def test_phase_and_timing_cancel_between_antennas(jitter_s: float, seed: int) -> None:
    channel = some_channel(seed=seed)
    got = received(channel, seed, common_phase=True, timing_jitter_s=jitter_s)
    product, expected = (h[:, 0] * h[:, 1].conj() for h in (got, channel))
    np.testing.assert_allclose(product, expected, atol=1e-6 * np.abs(expected).max())


def test_quantisation_errs_by_half_a_step_at_most() -> None:
    channel = some_channel()
    exact, rounded = received(channel, agc=True), received(channel, agc=True, int8=True)
    error = (rounded - exact).view(np.float32)
    assert np.abs(error).max() <= 0.5 + 1e-5
    assert np.abs(error).max() > 0.45
    parts = rounded.view(np.float32)
    np.testing.assert_array_equal(parts, np.rint(parts))
    np.testing.assert_array_equal(np.abs(parts).max(axis=(1, 3)), receiver.FULL_SCALE)


def test_without_gain_control_one_scale_serves_the_turn() -> None:
    channel = some_channel() * np.linspace(0.1, 1.0, 16, dtype=np.float32)[:, None]
    rounded = received(channel, int8=True)
    peak = np.abs(channel.view(np.float32)).max(axis=(1, 2, 3), keepdims=True)
    assert np.abs(rounded - channel * (receiver.FULL_SCALE / peak)).max() < 0.75  # half a step in I and in Q


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**20))
def test_gain_control_leaves_the_product_signal_as_it_is(seed: int) -> None:
    rng = np.random.default_rng(seed)
    levels = 10.0 ** rng.uniform(-2.0, 2.0, (4, 1, 16, 1)).astype(np.float32)
    channel = some_channel(seed=seed)
    scaled = received(channel * levels, agc=True)
    np.testing.assert_allclose(scaled, received(channel, agc=True), rtol=1e-4, atol=1e-3)
    np.testing.assert_allclose(aoa.product_signal(scaled), aoa.product_signal(channel), atol=1e-3)


def test_a_lost_packet_is_lost_on_all_antennas_and_others_stay() -> None:
    channel = some_channel(n_links=300)
    got = received(channel, packet_loss=0.3)
    lost = np.asarray(~got.any(axis=(1, 3)))
    np.testing.assert_array_equal(got, np.where(lost[:, None, :, None], 0.0, channel))
    assert lost.mean() == pytest.approx(0.3, abs=0.03)


@pytest.mark.parametrize("changes", [{"agc": True}, {"int8": True}, {"agc": True, "int8": True}])
def test_nothing_received_is_zero_and_never_nan(changes: dict[str, bool]) -> None:
    assert not received(some_channel(), packet_loss=1.0, **changes).any()
    assert not received(np.zeros((2, 2, 16, 30), np.complex64), **changes).any()


def test_chain_offset_turns_every_packet_of_an_antenna_alike() -> None:
    channel, chain_rad = some_channel(), np.array([[0.0, 1.0]] * 4)
    got = receiver.received_csi(
        channel, snr_scale=1.0, rng=np.random.default_rng(0), cfg=IDEAL, chain_rad=chain_rad
    )
    np.testing.assert_allclose(got[:, 0], channel[:, 0])
    np.testing.assert_allclose(got[:, 1], channel[:, 1] * np.exp(1j), rtol=1e-5)


def test_chain_offsets_have_the_stated_spread_against_the_first() -> None:
    cfg = ImpairmentConfig(chain_phase_rad=0.3)
    standing = draw_episode_impairments(
        cfg, n_robots=2000, n_antennas=3, size_m=10.0, rng=np.random.default_rng(0)
    )
    assert not standing.chain_rad[:, 0].any()
    np.testing.assert_allclose(standing.chain_rad[:, 1:].std(axis=0), 0.3, rtol=0.05)


def test_headings_have_the_stated_bias_and_noise() -> None:
    cfg = ImpairmentConfig(heading_noise_rad=0.02, heading_bias_rad=-0.1)
    believed = np.tile(np.linspace(-1.5, 0.0, 20), (500, 1))
    off = true_headings(believed, cfg, rng=np.random.default_rng(0)) - believed
    assert off.mean() == pytest.approx(-0.1, abs=1e-3)
    assert off.std() == pytest.approx(0.02, rel=0.05)
    np.testing.assert_array_equal(true_headings(believed, IDEAL, rng=np.random.default_rng(0)), believed)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"packet_loss": 1.5}, r"ImpairmentConfig.packet_loss must be in 0..1, got 1.5"),
        ({"packet_loss": float("nan")}, r"ImpairmentConfig.packet_loss must be in 0..1, got nan"),
        ({"timing_jitter_s": -1e-9}, r"ImpairmentConfig.timing_jitter_s must be in 0..1e-06, got -1e-09"),
        ({"chain_phase_rad": float("inf")}, r"chain_phase_rad must be in 0..6.28319, got inf"),
        ({"heading_noise_rad": -0.1}, r"ImpairmentConfig.heading_noise_rad must be in 0..3.14"),
        ({"heading_bias_rad": 4.0}, r"ImpairmentConfig.heading_bias_rad must be in -3.14"),
        ({"diffuse_ratio": -1.0}, r"ImpairmentConfig.diffuse_ratio must be in 0..1e\+06, got -1.0"),
        ({"diffuse_spread_rad": 0.0}, r"ImpairmentConfig.diffuse_spread_rad must be in 0.001"),
    ],
)
def test_config_names_what_it_refuses(values: dict[str, float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        ImpairmentConfig(**values)  # type: ignore[arg-type]
