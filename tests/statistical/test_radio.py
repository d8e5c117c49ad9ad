"""AOA of the whole chain against the Cramer-Rao bound, and noise against what the scenario states."""

import numpy as np

from wifipgo import se2
from wifipgo.radio import aoa
from wifipgo.radio.aoa import cramer_rao
from wifipgo.radio.aoa.steering import turning_pair
from wifipgo.radio.channel import csi
from wifipgo.radio.propagation.paths import Paths
from wifipgo.world.sensing import SensingConfig, observe_robots, odometry

GAP_M, WAVELENGTH_M = 0.22, 0.06


def bearing_errors(snr_db: float, n: int, azimuth_rad: float = 0.6) -> np.ndarray:
    """Errors of the product estimator for one path, paper antenna pair and turn."""
    cfg = aoa.AoaConfig(n_azimuths=1440)
    rng = np.random.default_rng(0)
    azimuth = azimuth_rad + rng.uniform(-0.5, 0.5, n)
    paths = Paths(
        np.ones((n, 1), complex), np.zeros((n, 1)), azimuth[:, None], np.zeros((n, 1)), np.zeros((n, 1), int)
    )
    relative = aoa.turn_headings(cfg)
    channel = csi.pair_csi(paths, np.tile(relative, (n, 1)), antenna_gap_m=GAP_M, wavelength_m=WAVELENGTH_M)
    received = csi.received_csi(channel, snr_scale=10.0 ** (snr_db / 10.0), rng=rng)
    steering = aoa.turn_steering(
        relative, aoa.azimuth_grid(cfg.n_azimuths), antenna_gap_m=GAP_M, wavelength_m=WAVELENGTH_M
    )
    profile = aoa.bartlett_profiles(aoa.product_signal(received), steering)
    found = aoa.find_peaks(profile, n_peaks=1).azimuth_rad[:, 0]
    return np.asarray(se2.wrap_angle(found - azimuth))


def test_one_path_is_found_within_1_5_times_the_cramer_rao_variance() -> None:
    """The bound is taken at the lower phase variance, of an amplitude that is fixed."""
    azimuths = 0.6 + np.linspace(-0.5, 0.5, 101)
    pair = turning_pair(aoa.turn_headings(aoa.AoaConfig()), antenna_gap_m=GAP_M, wavelength_m=WAVELENGTH_M)
    for snr_db in (10.0, 15.0, 20.0, 25.0, 30.0):
        phase = cramer_rao.phase_variance_rad2(
            10.0 ** (snr_db / 10.0), n_subcarriers=30, random_amplitude=False
        )
        bound = cramer_rao.azimuth_bound_rad2(pair, azimuths, phase_variance_rad2=phase).mean()
        variance = np.mean(bearing_errors(snr_db, 600) ** 2)
        assert 0.8 * bound < variance < 1.5 * bound


def test_odometry_has_the_stated_noise_per_robot() -> None:
    cfg = SensingConfig(noise_scale=(0.5, 2.0))
    poses = np.zeros((2, 3))
    draws = np.stack([odometry(poses, poses, cfg=cfg, rng=np.random.default_rng(k)) for k in range(4000)])
    expected = np.array([0.5, 2.0])[:, None] * [cfg.sigma_t_m, cfg.sigma_t_m, cfg.sigma_r_rad]
    np.testing.assert_allclose(draws.std(axis=0), expected, rtol=0.05)
    assert np.abs(draws.mean(axis=0) / expected).max() < 0.07


def test_outliers_are_between_two_and_three_sigma_in_every_component() -> None:
    cfg = SensingConfig(outlier_share=0.4)
    poses, seen = np.zeros((30, 3)), ~np.eye(30, dtype=bool)
    rng = np.random.default_rng(0)
    measured = observe_robots(poses, 0, seen, cfg=cfg, rng=rng, outlier_rng=rng)
    in_sigmas = np.abs(measured.z) / [cfg.sigma_t_m, cfg.sigma_t_m, cfg.sigma_r_rad]
    bad = in_sigmas[measured.is_outlier]
    assert ((bad >= 2.0 - 1e-9) & (bad <= 3.0 + 1e-9)).all()
    assert abs(measured.is_outlier.mean() - 0.4) < 0.05
