"""Effective SNR, rates and service discrepancy against closed forms and the standard's table."""

from typing import Any

import numpy as np
import pytest
from scipy.special import erfc, erfcinv
from scipy.stats import norm

from wifipgo.radio.channel import rates


@pytest.mark.parametrize("snr_db", [0.0, 5.0, 12.0, 20.0])
def test_a_flat_channel_has_its_own_snr(snr_db: float) -> None:
    flat = np.full((1, 30), 10.0 ** (snr_db / 10.0))
    np.testing.assert_allclose(rates.esnr_db(flat), snr_db, atol=5e-5)


def test_bpsk_error_rate_is_halperins() -> None:
    """Two subcarriers, by hand: mean of Q(sqrt(2 snr)), inverted."""
    snr = np.array([[1.0, 4.0]])
    mean = norm.sf(np.sqrt(2.0 * snr)).mean()
    by_hand = norm.isf(mean) ** 2 / 2.0
    assert rates.esnr_db(snr)[0, 0] == pytest.approx(10.0 * np.log10(by_hand), abs=1e-3)


def test_table_agrees_with_the_special_function() -> None:
    """Fading links from -10 to 40 dB against erfc and its inverse, all four modulations."""
    rng = np.random.default_rng(0)
    snr = rng.exponential(1.0, (500, 30)) * 10.0 ** rng.uniform(-1.0, 4.0, (500, 1))
    scale, spread = np.array([0.5, 0.5, 3.0 / 8.0, 7.0 / 24.0]), np.array([1.0, 2.0, 10.0, 42.0])
    error_rate = scale * erfc(np.sqrt(snr[..., None] / spread)).mean(axis=1)
    exact = 10.0 * np.log10(spread * erfcinv(error_rate / scale) ** 2)
    clear = (error_rate > 1e-250) & (exact > -25.0)
    assert np.abs(rates.esnr_db(snr) - exact)[clear].max() < 2e-4


def test_effective_snr_lies_between_worst_and_mean() -> None:
    snr = np.random.default_rng(0).exponential(30.0, (50, 30))
    esnr = rates.esnr_db(snr)
    assert (esnr <= 10.0 * np.log10(snr.mean(axis=1, keepdims=True)) + 1e-3).all()
    assert (esnr >= 10.0 * np.log10(snr.min(axis=1, keepdims=True)) - 1e-3).all()


@pytest.mark.parametrize(
    ("esnr_db", "rate"),
    [
        (3.9, 0.0),
        (4.0, 6.5),
        (7.0, 13.0),
        (9.0, 19.5),
        (12.0, 26.0),
        (16.0, 39.0),
        (20.0, 52.0),
        (21.0, 58.5),
        (22.0, 65.0),
    ],
)
def test_rates_step_at_their_thresholds(esnr_db: float, rate: float) -> None:
    assert rates.rate_mbit_s(np.full((1, 4), esnr_db))[0] == rate


def test_wide_band_carries_the_rates_of_the_standard() -> None:
    """802.11n-2009, MCS 0 to 7 at 40 MHz, 800 ns guard interval: 108 data subcarriers every 4 us."""
    bits = np.array([1, 2, 2, 4, 4, 6, 6, 6]) * np.array(
        [1 / 2, 1 / 2, 3 / 4, 1 / 2, 3 / 4, 2 / 3, 3 / 4, 5 / 6]
    )
    passing = np.repeat(rates.RATE_ESNR_DB[:, None], 4, axis=1)
    np.testing.assert_allclose(rates.rate_mbit_s(passing, bandwidth_hz=40e6), 108 * bits / 4.0)
    np.testing.assert_allclose(rates.rate_mbit_s(passing, bandwidth_hz=20e6), 52 * bits / 4.0)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"q_mbit_s": 136.0}, r"LinkConfig.q_mbit_s must be in 0.001..135, got 136.0"),
        ({"q_mbit_s": float("nan")}, r"LinkConfig.q_mbit_s must be in 0.001..135, got nan"),
        ({"alpha": float("inf")}, r"LinkConfig.alpha must be in 0..1e\+06, got inf"),
    ],
)
def test_config_names_what_it_refuses(values: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        rates.LinkConfig(**values)


def test_extremes_stay_finite() -> None:
    esnr = rates.esnr_db(np.array([[0.0] * 30, [1e12] * 30]))
    assert np.isfinite(esnr).all()
    assert rates.rate_mbit_s(esnr).tolist() == [0.0, 65.0]


def test_service_discrepancy_is_eq_1() -> None:
    rate = np.array([0.0, 19.5, 39.0, 65.0])
    clipped = rates.service_discrepancy(rate, q_mbit_s=39.0, alpha=2.0)
    np.testing.assert_allclose(clipped, [2.0, 1.0, 0.0, 0.0])
    assert rates.service_discrepancy(rate, q_mbit_s=39.0, alpha=2.0, clip=False)[3] < 0.0


@pytest.mark.parametrize("bandwidth_hz", [20e6, 40e6])
def test_looking_at_fewer_modulations_finds_the_same_rate(bandwidth_hz: float) -> None:
    """Links from none to the top rate: the short way against all four modulations."""
    rng = np.random.default_rng(1)
    snr = rng.exponential(1.0, (2_000, 30)) * 10.0 ** rng.uniform(-1.0, 3.5, (2_000, 1))
    rate, shown_db = rates.rate_and_esnr(snr, bandwidth_hz=bandwidth_hz)
    esnr_db = rates.esnr_db(snr)
    np.testing.assert_array_equal(rate, rates.rate_mbit_s(esnr_db, bandwidth_hz=bandwidth_hz))
    np.testing.assert_array_equal(shown_db, esnr_db[:, -1])
    assert len(np.unique(rate)) == 9
