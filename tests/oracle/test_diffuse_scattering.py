"""The diffuse cluster: stated power, geometry of one bounce, frozen, the same from both ends."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wifipgo.radio.channel import csi
from wifipgo.radio.propagation.diffuse_scattering import (
    N_SCATTERERS,
    SCATTERED,
    Diffuse,
    draw_diffuse,
    with_diffuse,
)
from wifipgo.radio.propagation.materials import SPEED_OF_LIGHT_M_S
from wifipgo.radio.propagation.paths import Paths

CARRIER_HZ = 5.0e9


def direct(tx_m: np.ndarray, rx_m: np.ndarray, gain: float = 1e-3) -> Paths:
    """The line of sight of each link, all of one power."""
    way_m = tx_m - rx_m
    arrives = np.arctan2(way_m[:, 1], way_m[:, 0])[:, None]
    leaves = np.arctan2(-way_m[:, 1], -way_m[:, 0])[:, None]
    delay_s = np.linalg.norm(way_m, axis=1)[:, None] / SPEED_OF_LIGHT_M_S
    gains = gain * np.exp(-2j * np.pi * CARRIER_HZ * delay_s)
    return Paths(gains, delay_s, arrives, leaves, np.zeros(arrives.shape, int))


def scattered(tx_m: np.ndarray, rx_m: np.ndarray, diffuse: Diffuse) -> Paths:
    return with_diffuse(direct(tx_m, rx_m), tx_m, rx_m, diffuse, carrier_hz=CARRIER_HZ)


def some_diffuse(ratio: float = 0.2, spread_rad: float = 0.5, seed: int = 0) -> Diffuse:
    return draw_diffuse(ratio=ratio, spread_rad=spread_rad, size_m=20.0, rng=np.random.default_rng(seed))


def some_ends(n: int = 50) -> tuple[np.ndarray, np.ndarray]:
    both = np.random.default_rng(3).uniform(0.0, 20.0, (2, n, 2))
    return both[0], both[1]


@settings(max_examples=20, deadline=None)
@given(ratio=st.floats(1e-3, 10.0), spread_rad=st.floats(0.01, 3.0), seed=st.integers(0, 1000))
def test_power_is_the_stated_share_of_the_traced_paths(ratio: float, spread_rad: float, seed: int) -> None:
    paths = scattered(*some_ends(), some_diffuse(ratio, spread_rad, seed))
    power = np.abs(paths.gain) ** 2
    np.testing.assert_allclose(power[:, 1:].sum(axis=1), ratio * power[:, 0], rtol=1e-9)


@pytest.mark.parametrize("left", [0.0, 0.25, 1.0])
def test_obstacles_scatter_a_share_of_what_they_take(left: float) -> None:
    """Of free space over 8 m `left`, in power, goes on straight; what was never taken is not scattered."""
    tx_m, rx_m = np.array([[1.0, 1.0]]), np.array([[9.0, 1.0]])
    free = (SPEED_OF_LIGHT_M_S / CARRIER_HZ / (4.0 * np.pi * 8.0)) ** 2
    diffuse = some_diffuse(0.3)._replace(power_of="obstructed")
    straight = direct(tx_m, rx_m, gain=float(np.sqrt(left * free)))
    paths = with_diffuse(straight, tx_m, rx_m, diffuse, carrier_hz=CARRIER_HZ)
    scattered_power = (np.abs(paths.gain[:, 1:]) ** 2).sum()
    assert scattered_power == pytest.approx(0.3 * (1.0 - left) * free, rel=1e-6, abs=1e-15)
    assert np.all((paths.order[0, 1:] == SCATTERED) == (left < 1.0))


def test_delays_and_directions_are_those_of_one_bounce() -> None:
    """Scatterer at (0, 4) of a link from (3, 0) to (0, 0): a triangle of 3, 4 and 5 m."""
    diffuse = Diffuse(np.array([[0.0, 4.0]]), np.array([1.0 + 0.0j]), 1.0, 1.0)
    paths = scattered(np.array([[3.0, 0.0]]), np.array([[0.0, 0.0]]), diffuse)
    assert paths.delay_s[0, 1] * SPEED_OF_LIGHT_M_S == pytest.approx(9.0)
    assert paths.azimuth_rx_rad[0, 1] == pytest.approx(np.pi / 2.0)
    assert paths.azimuth_tx_rad[0, 1] == pytest.approx(np.arctan2(4.0, -3.0))
    assert paths.order[0].tolist() == [0, SCATTERED]
    turns = CARRIER_HZ * 9.0 / SPEED_OF_LIGHT_M_S
    assert paths.gain[0, 1] == pytest.approx(1e-3 * np.exp(-2j * np.pi * turns), rel=1e-6)


def test_the_same_poses_have_the_same_channel_and_near_ones_nearly() -> None:
    (tx_m, rx_m), diffuse = some_ends(), some_diffuse()
    first, again = (csi.centre_channel(scattered(tx_m, rx_m, diffuse)) for _ in range(2))
    np.testing.assert_array_equal(first, again)
    near = csi.centre_channel(scattered(tx_m, rx_m + 1e-4, diffuse))  # 1/600 of a wavelength
    assert np.abs(near - first).max() < 0.1 * np.abs(first).max()
    other = csi.centre_channel(scattered(tx_m, rx_m, some_diffuse(seed=1)))
    assert np.abs(other - first).max() > 0.1 * np.abs(first).max()


def test_both_ends_see_the_same_channel() -> None:
    (tx_m, rx_m), diffuse = some_ends(), some_diffuse()
    there, back = scattered(tx_m, rx_m, diffuse), scattered(rx_m, tx_m, diffuse)
    np.testing.assert_allclose(back.gain[:, 1:], there.gain[:, 1:], rtol=1e-6)
    np.testing.assert_array_equal(back.azimuth_rx_rad, there.azimuth_tx_rad)


def test_a_wider_taper_spreads_power_wider() -> None:
    tx_m, rx_m = some_ends(400)
    spreads = []
    for spread_rad in (0.1, 0.3, 1.0):
        paths = scattered(tx_m, rx_m, some_diffuse(spread_rad=spread_rad))
        off = np.angle(np.exp(1j * (paths.azimuth_rx_rad - paths.azimuth_rx_rad[:, :1])))
        spreads.append(np.sqrt(np.mean((np.abs(paths.gain) ** 2 * off**2).sum(axis=1)) / 0.2e-6))
    assert spreads[0] < spreads[1] < spreads[2]
    assert spreads[2] < 1.2


def test_a_link_without_a_path_stays_without() -> None:
    (tx_m, rx_m), diffuse = some_ends(3), some_diffuse()
    paths = with_diffuse(direct(tx_m, rx_m, gain=0.0), tx_m, rx_m, diffuse, carrier_hz=CARRIER_HZ)
    assert paths.gain.shape == (3, 1 + N_SCATTERERS)
    assert not paths.gain.any()
    assert (paths.order[:, 1:] == -1).all()
    assert not paths.delay_s[:, 1:].any()
