"""Pairs that cannot hear each other are passed over: tables are as if each pair were judged by itself."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wifipgo.radio.channel import rates
from wifipgo.radio.channel.csi import RadioConfig, centre_channel
from wifipgo.radio.channel.power_bound import most_mean_power
from wifipgo.radio.links import probe_links
from wifipgo.radio.propagation.materials import Slab
from wifipgo.radio.propagation.paths import Paths, Surfaces, surfaces_of, trace_paths
from wifipgo.world.layout import room_walls

CARRIER_HZ, SIZE_M = 5.0e9, 300.0
BOX_M = np.array([[100.0, 100.0], [180.0, 110.0], [170.0, 190.0], [90.0, 160.0]])


def scene(*boxes_m: np.ndarray) -> Surfaces:
    return surfaces_of(
        room_walls(SIZE_M), list(boxes_m), carrier_hz=CARRIER_HZ, wall=Slab(), obstacle=Slab("brick", 0.1)
    )


def robots(n: int, seed: int) -> np.ndarray:
    """Outside the box."""
    p_m = np.random.default_rng(seed).uniform(1.0, SIZE_M - 1.0, (4 * n, 2))
    return p_m[((p_m < 85.0) | (p_m > 195.0)).any(axis=1)][:n]


@settings(max_examples=60)
@given(
    seed=st.integers(0, 2**32 - 1),
    n_paths=st.integers(1, 12),
    longest_s=st.sampled_from([1e-10, 1e-8, 1e-7, 1e-6, 1e-5]),
    bandwidth_hz=st.sampled_from([20e6, 40e6]),
)
def test_no_mean_power_is_above_its_bound(
    seed: int, n_paths: int, longest_s: float, bandwidth_hz: float
) -> None:
    rng, shape = np.random.default_rng(seed), (50, n_paths)
    gain = rng.standard_normal(shape) * np.exp(2j * np.pi * rng.random(shape))
    delay_s, nothing = rng.uniform(0.0, longest_s, shape), np.zeros(shape)
    channel = centre_channel(
        Paths(gain, delay_s, nothing, nothing, np.zeros(shape, dtype=int)), bandwidth_hz=bandwidth_hz
    )
    power = (np.abs(channel) ** 2).mean(axis=1)
    bound = most_mean_power(gain.T, delay_s.T, bandwidth_hz=bandwidth_hz)
    assert (power <= bound * (1.0 + 1e-4)).all()
    assert (bound <= np.abs(gain).sum(axis=1) ** 2 * (1.0 + 1e-5)).all()


@pytest.mark.parametrize("bandwidth_hz", [20e6, 40e6])
@pytest.mark.parametrize("penetration", [True, False])
@pytest.mark.parametrize("boxes_m", [(), (BOX_M,)])
def test_links_are_those_of_every_pair_judged_by_itself(
    boxes_m: tuple[np.ndarray, ...], penetration: bool, bandwidth_hz: float
) -> None:
    """Against paths in double precision of all pairs; a rate may only differ at its very threshold."""
    radio = RadioConfig(tx_power_dbm=-6.0, penetration=penetration, bandwidth_hz=bandwidth_hz)
    p_m, surfaces = robots(70, seed=1), scene(*boxes_m)
    links = probe_links(p_m, surfaces, radio)
    low, high = np.triu_indices(len(p_m), 1)
    paths = trace_paths(
        p_m[low], p_m[high], surfaces, carrier_hz=CARRIER_HZ, max_order=1, penetration=penetration
    )
    channel = centre_channel(paths, bandwidth_hz=bandwidth_hz)
    rate, esnr_db = rates.rate_and_esnr(radio.snr_scale * np.abs(channel) ** 2, bandwidth_hz=bandwidth_hz)
    got, heard = links.rate_mbit_s[low, high], rate > 0.0
    assert 0.1 < heard.mean() < 0.7
    assert (got == rate).mean() > 0.999
    np.testing.assert_array_equal(links.rate_mbit_s, links.rate_mbit_s.T)
    same = (got == rate) & heard
    np.testing.assert_allclose(links.esnr_db[low, high][same], esnr_db[same], atol=2e-4)
    assert (links.esnr_db[low, high][got == 0.0] == -30.0).all()


def test_a_pair_alone_is_that_of_the_crowd() -> None:
    """To the bit, whether somebody looked if it can be heard or not."""
    radio, p_m, surfaces = RadioConfig(tx_power_dbm=-6.0), robots(70, seed=2), scene(BOX_M)
    links = probe_links(p_m, surfaces, radio)
    for other in range(1, 40):
        alone = probe_links(p_m[[0, other]], surfaces, radio)
        assert alone.rate_mbit_s[0, 1] == links.rate_mbit_s[0, other]
        assert alone.esnr_db[0, 1] == links.esnr_db[0, other]
