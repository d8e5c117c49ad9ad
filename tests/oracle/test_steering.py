"""Apertures, elevation and the fast profiles against their definitions."""

import numpy as np
import pytest

from wifipgo.radio import aoa
from wifipgo.radio.aoa.bartlett import bartlett_profiles, profiles
from wifipgo.radio.aoa.peaks import find_directions
from wifipgo.radio.aoa.steering import Aperture, azimuth_grid, moving_antenna, turning_pair

WAVELENGTH_M = 0.06
HEADINGS = np.linspace(-np.pi / 2.0, 0.0, 64)
PAIR = turning_pair(HEADINGS, antenna_gap_m=0.22, wavelength_m=WAVELENGTH_M)


def helix() -> Aperture:
    turn = np.linspace(0.0, 3.0, 150)
    moved = np.stack([0.2 * np.cos(2.0 * turn), 0.2 * np.sin(2.0 * turn), 0.05 * turn], axis=1)
    return moving_antenna(moved, wavelength_m=WAVELENGTH_M)


def noise(*shape: int) -> np.ndarray:
    rng = np.random.default_rng(1)
    return (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)).astype(np.complex64)


@pytest.mark.parametrize("elevation_rad", [0.0, 0.7])
def test_pair_has_the_phase_of_fig_2(elevation_rad: float) -> None:
    """2 pi r / lambda cos(elevation) cos(azimuth - heading)."""
    grid = azimuth_grid(72)
    expected = 0.22 / WAVELENGTH_M * np.cos(elevation_rad) * np.cos(grid[None] - HEADINGS[:, None])
    found = PAIR.steering(grid, elevation_rad=elevation_rad)
    np.testing.assert_allclose(found, np.exp(2j * np.pi * expected), atol=2e-5)


def test_grid_of_a_circle_makes_no_difference_to_steering() -> None:
    """Conjugates of the first half are what the second half is."""
    grid = azimuth_grid(72)
    one_by_one = np.concatenate([PAIR.steering(grid[k : k + 1]) for k in range(72)], axis=1)
    np.testing.assert_allclose(PAIR.steering(grid), one_by_one, atol=1e-6)


@pytest.mark.parametrize("aperture", [PAIR, helix()], ids=["flat", "helix"])
@pytest.mark.parametrize("n_links", [1, 3, 150, 300])
def test_profiles_are_the_share_of_power_by_definition(aperture: Aperture, n_links: int) -> None:
    grid = azimuth_grid(72)
    signal = noise(n_links, len(aperture.baseline_m))
    wide = aperture.steering(grid).astype(np.complex128)
    by_definition = np.abs(signal.conj() @ wide) ** 2
    by_definition /= len(wide) * (np.abs(signal) ** 2).sum(axis=1, keepdims=True)
    np.testing.assert_allclose(bartlett_profiles(signal, aperture.steering(grid)), by_definition, atol=2e-6)


def test_no_power_gives_zeros_in_a_large_batch() -> None:
    signal = noise(40, 64)
    signal[7] = 0.0
    profile = bartlett_profiles(signal, PAIR.steering(azimuth_grid(72)))
    assert np.isfinite(profile).all()
    assert (profile >= 0.0).all()
    assert not profile[7].any()


@pytest.mark.parametrize(("azimuth_deg", "elevation_deg"), [(-150.3, 20.2), (40.6, 47.7), (179.8, 35.0)])
def test_peak_at_true_azimuth_and_elevation(azimuth_deg: float, elevation_deg: float) -> None:
    elevations = np.deg2rad(np.arange(0.0, 90.0))
    truth = np.deg2rad([azimuth_deg])
    for aperture in (PAIR, helix()):
        signal = aperture.steering(truth, elevation_rad=float(np.deg2rad(elevation_deg))).T
        profile = profiles(signal, aperture, azimuths_rad=azimuth_grid(360), elevations_rad=elevations)
        found = find_directions(profile, elevations, n_peaks=2)
        assert abs(np.rad2deg(np.angle(np.exp(1j * (found.azimuth_rad[0, 0] - truth[0]))))) < 0.3
        assert np.rad2deg(found.elevation_rad[0, 0]) == pytest.approx(elevation_deg, abs=0.5)
        assert found.height[0, 0] > 0.95  # the bin below the top


def test_a_turn_cannot_tell_up_from_down_and_a_helix_can() -> None:
    elevations = np.deg2rad([-30.0, 30.0])
    for aperture, ambiguous in ((PAIR, True), (helix(), False)):
        signal = aperture.steering(np.array([0.5]), elevation_rad=float(elevations[1])).T
        down, up = profiles(signal, aperture, azimuths_rad=np.array([0.5]), elevations_rad=elevations)[
            0, :, 0
        ]
        assert up == pytest.approx(1.0, abs=1e-5)
        assert (down == pytest.approx(up, abs=1e-5)) == ambiguous


def test_snapshots_add_as_powers() -> None:
    signal, grid = noise(3, 5, 64), azimuth_grid(72)
    together = profiles(signal, PAIR, azimuths_rad=grid)[:, 0]
    apart = np.mean([bartlett_profiles(signal[:, s], PAIR.steering(grid)) for s in range(5)], axis=0)
    np.testing.assert_allclose(together, apart, atol=1e-6)


def test_old_names_are_the_apertures() -> None:
    grid, moved = azimuth_grid(72), np.linspace(0.0, 0.3, 9)[:, None] * [1.0, 0.5, 0.2]
    np.testing.assert_array_equal(
        aoa.turn_steering(HEADINGS, grid, antenna_gap_m=0.22, wavelength_m=WAVELENGTH_M), PAIR.steering(grid)
    )
    np.testing.assert_array_equal(
        aoa.displacement_steering(moved, grid, elevation_rad=0.2, wavelength_m=WAVELENGTH_M),
        moving_antenna(moved, wavelength_m=WAVELENGTH_M).steering(grid, elevation_rad=0.2),
    )


@pytest.mark.parametrize(
    ("field", "value"),
    [("wavelength_m", 0.0), ("baseline_m", np.zeros((0, 3))), ("baseline_m", np.full((2, 3), np.nan))],
)
def test_aperture_names_what_it_refuses(field: str, value: object) -> None:
    fields: dict[str, object] = {"baseline_m": np.ones((2, 3)), "wavelength_m": 0.06}
    with pytest.raises(ValueError, match=f"Aperture.{field}"):
        Aperture(**fields | {field: value})  # type: ignore[arg-type]
