"""Lidar and signal levels with noise: as large as stated, within their range, and the truth without."""

import numpy as np
import pytest

from wifipgo.radio.channel.csi import RadioConfig
from wifipgo.radio.links import MOST_ESNR_DB, probe_links, read_levels
from wifipgo.radio.propagation.materials import Slab
from wifipgo.radio.propagation.paths import surfaces_of
from wifipgo.world.layout import room_walls
from wifipgo.world.lidar import noisy


def test_distances_have_the_stated_deviation_and_free_rays_none() -> None:
    free_m = np.full((500, 16), 2.0)
    free_m[:, ::2] = 4.0
    measured_m = noisy(free_m, sigma_m=0.05, range_m=4.0, rng=np.random.default_rng(0))
    assert np.std(measured_m[:, 1::2]) == pytest.approx(0.05, rel=0.05)
    assert np.all(measured_m[:, ::2] == 4.0)
    wild_m = noisy(free_m, sigma_m=50.0, range_m=4.0, rng=np.random.default_rng(0))
    assert wild_m.min() == 0.0
    assert wild_m.max() == 4.0
    assert noisy(free_m, sigma_m=0.0, range_m=4.0, rng=np.random.default_rng(0)) is free_m


def test_levels_have_the_stated_deviation_and_rates_stay() -> None:
    rng, cfg = np.random.default_rng(1), RadioConfig(tx_power_dbm=0.0)
    room = surfaces_of(room_walls(20.0), carrier_hz=cfg.carrier_hz, wall=Slab())
    links = probe_links(rng.uniform(1.0, 19.0, (40, 2)), room, cfg)
    read = read_levels(links, sigma_db=2.0, rng=rng)
    heard = (links.rate_mbit_s > 0.0) & (links.esnr_db < MOST_ESNR_DB - 10.0)
    assert np.std((read.esnr_db - links.esnr_db)[heard]) == pytest.approx(2.0, rel=0.1)
    assert np.all(read.esnr_db.diagonal() == -30.0)
    assert read.rate_mbit_s is links.rate_mbit_s
    assert read_levels(links, sigma_db=0.0, rng=rng) is links
