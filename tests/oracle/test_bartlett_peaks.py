"""Profiles and peaks against closed forms."""

import numpy as np
import pytest

from wifipgo.errors import UnknownNameError
from wifipgo.radio import aoa

WAVELENGTH_M = 0.06
CFG = aoa.AoaConfig()


def steering(azimuths: np.ndarray) -> np.ndarray:
    return aoa.turn_steering(
        aoa.turn_headings(CFG), azimuths, antenna_gap_m=CFG.antenna_gap_m, wavelength_m=WAVELENGTH_M
    )


@pytest.mark.parametrize("azimuth_deg", range(-180, 180, 37))
def test_one_plane_wave_peaks_at_its_direction(azimuth_deg: int) -> None:
    """The response to a direction is largest at that direction, where it explains all power."""
    truth = np.deg2rad([azimuth_deg + 0.4])
    profile = aoa.bartlett_profiles(steering(truth).T, steering(aoa.azimuth_grid(360)))
    peaks = aoa.find_peaks(profile, n_peaks=2)
    away = np.rad2deg(np.abs(np.angle(np.exp(1j * (peaks.azimuth_rad[0, 0] - truth)))))
    assert away < 0.15  # a seventh of a bin: what the parabola leaves
    assert peaks.height[0, 0] == pytest.approx(1.0, abs=1e-2)


def test_eq5_with_one_snapshot_equals_the_eigenvector_form() -> None:
    """Eq. 5 by its definition, noise eigenvectors of h h^H, against the map of the Bartlett share."""
    rng = np.random.default_rng(0)
    h = (rng.standard_normal((1, CFG.n_positions)) + 1j * rng.standard_normal((1, CFG.n_positions))).astype(
        np.complex64
    )
    a = steering(aoa.azimuth_grid(72)).astype(np.complex128)
    _, vectors = np.linalg.eigh(h.T @ h.conj())
    by_definition = 1.0 / (np.abs(vectors[:, :-1].conj().T @ a) ** 2).sum(axis=0)
    profile = aoa.eq5_profiles(aoa.bartlett_profiles(h, a.astype(np.complex64)), CFG.n_positions)
    np.testing.assert_allclose(profile[0], by_definition, rtol=1e-4)


def test_ratio_and_product_of_one_path_have_the_same_phase() -> None:
    rng = np.random.default_rng(3)
    csi = rng.standard_normal((4, 2, 16, 1)) + 1j * rng.standard_normal((4, 2, 16, 1))
    ratio, product = aoa.ratio_signal(csi), aoa.product_signal(csi)
    np.testing.assert_allclose(np.angle(ratio * product.conj()), 0.0, atol=1e-5)
    np.testing.assert_allclose(np.abs(product), 1.0, rtol=1e-5)


def test_common_phase_of_a_packet_cancels() -> None:
    rng = np.random.default_rng(4)
    csi = rng.standard_normal((2, 2, 16, 30)) + 1j * rng.standard_normal((2, 2, 16, 30))
    turned = csi * np.exp(2j * np.pi * rng.random((2, 1, 16, 1)))
    for estimator in aoa.ESTIMATORS.values():
        np.testing.assert_allclose(
            estimator.snapshots(csi), estimator.snapshots(turned), rtol=1e-4, atol=1e-5
        )


def test_no_power_gives_a_profile_of_zeros() -> None:
    profile = aoa.bartlett_profiles(np.zeros((1, 64), np.complex64), steering(aoa.azimuth_grid(72)))
    assert not profile.any()
    assert np.isfinite(aoa.find_peaks(profile, n_peaks=3).azimuth_rad).all()


def test_peaks_come_in_order_apart_and_refined_across_the_seam() -> None:
    grid = aoa.azimuth_grid(360)
    bump = sum(h * np.exp(60.0 * (np.cos(grid - c) - 1.0)) for h, c in ((1.0, -3.13), (0.6, 0.5), (0.3, 2.0)))
    peaks = aoa.find_peaks(np.asarray(bump)[None], n_peaks=4)
    np.testing.assert_allclose(peaks.azimuth_rad[0, :3], [-3.13, 0.5, 2.0], atol=2e-3)
    assert (np.diff(peaks.height[0]) <= 0.0).all()
    assert peaks.height[0, 3] == 0.0  # there is no fourth


def test_closest_peak_wraps() -> None:
    peaks = aoa.Peaks(np.array([[3.1, 0.0]]), np.array([[1.0, 0.5]]))
    assert aoa.closest_peak(peaks, np.array([-3.0]))[0] == 3.1
    assert aoa.closest_peak(peaks, np.array([0.4]))[0] == 0.0


def test_displacement_doubles_its_phase_for_two_passes() -> None:
    moved = np.array([[0.0, 0.0, 0.0], [0.01, 0.0, 0.0]])
    one, two = (
        aoa.displacement_steering(
            moved, np.array([0.0]), elevation_rad=0.0, wavelength_m=WAVELENGTH_M, passes=k
        )
        for k in (1, 2)
    )
    np.testing.assert_allclose(two, one**2, rtol=1e-5)
    assert np.angle(one[1, 0]) == pytest.approx(2.0 * np.pi * 0.01 / WAVELENGTH_M, rel=1e-5)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("antenna_gap_m", 0.0),
        ("turn_rad", float("nan")),
        ("n_positions", 1),
        ("n_positions", 10**20),
        ("antenna_gap_m", 1e100),
        ("antenna_scale", (1e300,)),
        ("turn_rad", 1e100),
        ("n_azimuths", 100),
        ("n_peaks", 0),
    ],
)
def test_config_names_what_it_refuses(field: str, value: float) -> None:
    with pytest.raises(ValueError, match=f"AoaConfig.{field}"):
        aoa.AoaConfig(**{field: value})  # type: ignore[arg-type]


def test_unknown_estimator_lists_what_exists() -> None:
    with pytest.raises(UnknownNameError, match=r"musik.*music, product, ratio"):
        aoa.AoaConfig(aoa_estimator="musik")
