"""Every estimator with losses, without noise, with coarse samples: profiles, never nan nor a refusal."""

import itertools
from typing import Any

import numpy as np
import pytest

from envs.rendezvous_v0 import parallel_env
from wifipgo.radio import aoa
from wifipgo.radio.channel.receiver import reported

STEERING = aoa.turn_steering(
    np.linspace(-np.pi / 2.0, 0.0, 8), aoa.azimuth_grid(72), antenna_gap_m=0.22, wavelength_m=0.06
)
TEAM = {"n_robots": 4, "n_slots": 3, "n_steps": 2, "size_m": 14.0, "n_azimuths": 72, "n_positions": 8}
HARD: list[dict[str, Any]] = [
    {"packet_loss": 0.5, "max_order": 0, "n_paths": 7},
    {"packet_loss": 0.9, "agc": True, "int8": True},
    {"max_order": 0, "int8": True},
    {"penetration": False, "n_obstacles": 2},
    {"packet_loss": 1.0},
]


@pytest.mark.parametrize("estimator", sorted(aoa.ESTIMATORS))
@pytest.mark.parametrize("noise_floor", [True, False])
def test_no_episode_ends_for_what_was_heard(estimator: str, noise_floor: bool) -> None:
    for seed, hard in enumerate(HARD):
        options = TEAM | hard | {"noise_floor": noise_floor, "aoa_estimator": estimator}
        env = parallel_env("paper-hw-2", **options)
        shown, _ = env.reset(seed=seed)
        while env.agents:
            assert all(env.observation_space(agent).contains(shown[agent]) for agent in env.agents)
            shown, *_ = env.step({agent: np.array([0.3, 0.2, 1.0]) for agent in env.agents})


def packets(seed: int = 0) -> np.ndarray:
    """CSI of seven links: silence, saturation, one packet, one antenna, one subcarrier, one path, noise."""
    rng = np.random.default_rng(seed)
    csi = (rng.standard_normal((7, 2, 8, 30)) + 1j * rng.standard_normal((7, 2, 8, 30))).astype(np.complex64)
    csi[0] = 0.0
    csi[1] = 127.0 - 127.0j
    csi[2, :, 1:] = 0.0
    csi[3, 1] = 0.0
    csi[4, :, :, 1:] = 0.0
    csi[5] = np.exp(1j * np.arange(8))[:, None]
    return csi


@pytest.mark.parametrize("estimator", sorted(aoa.ESTIMATORS))
@pytest.mark.parametrize("scale", [1e-30, 1e-18, 1.0, 1e4])
@pytest.mark.parametrize("n_paths", [1, 3, 7])
def test_any_packets_give_shares_of_power(estimator: str, scale: float, n_paths: int) -> None:
    cfg = aoa.AoaConfig(aoa_estimator=estimator, n_paths=n_paths, n_azimuths=72, n_positions=8)
    for agc, int8 in itertools.product((False, True), repeat=2):
        csi = packets() * np.float32(scale)
        if agc or int8:
            csi = reported(csi, agc=agc, int8=int8)
        profile = aoa.pair_profiles(csi, STEERING, cfg)
        assert ((profile >= 0.0) & (profile <= 1.0 + 1e-5)).all()
        assert not profile[[0, 3]].any()


def test_a_fade_of_any_depth_is_a_finite_ratio() -> None:
    csi = np.ones((60, 2, 8, 30), np.complex64)
    csi[:, 1] *= 10.0 ** -np.arange(60, dtype=np.float32)[:, None, None]
    profile = aoa.pair_profiles(csi * np.float32(100.0), STEERING, aoa.AoaConfig(aoa_estimator="ratio"))
    assert np.isfinite(profile).all()
