"""Synthetic aperture: invariances of the bearing and of the wavefronts that it searches."""

import math
from typing import Any

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given, settings

from wifipgo.radio.aoa import azimuth_grid, displacement_steering
from wifipgo.radio.aoa.moving_aperture import (
    ApertureConfig,
    Bearing,
    aperture_bearing,
    aperture_profiles,
    evenly_spaced,
    spherical_steering,
    timing_removed,
    unsquared,
)

WAVELENGTH_M = 0.054
N_SUBCARRIERS = 30
angles_rad = st.floats(-math.pi, math.pi)


def arc(n_packets: int = 300) -> np.ndarray:
    """Half a circle of 0.6 m with a slow start, m."""
    turned_rad = np.pi * np.linspace(0.0, 1.0, n_packets) ** 1.5
    return np.stack([0.3 * np.sin(turned_rad), -0.3 * np.cos(turned_rad), np.zeros(n_packets)], axis=1)


def product_of(position_m: np.ndarray, source_m: np.ndarray) -> np.ndarray:
    """Two-way channel of one path, the same on all subcarriers."""
    way_m = np.linalg.norm(source_m - position_m, axis=1)
    phase_rad = -4.0 * np.pi / WAVELENGTH_M * way_m
    return np.repeat(np.exp(1j * phase_rad)[:, None], N_SUBCARRIERS, axis=1).astype(np.complex64)


def source_at(azimuth_rad: float, range_m: float, position_m: np.ndarray) -> np.ndarray:
    """Point at an azimuth and a range from the mean of some positions, at their height, m."""
    return position_m.mean(axis=0) + range_m * np.array([np.cos(azimuth_rad), np.sin(azimuth_rad), 0.0])


def away_deg(estimate_rad: float, truth_rad: float) -> float:
    return abs(math.degrees(math.remainder(estimate_rad - truth_rad, math.tau)))


def found_at(azimuth_rad: float, range_m: float, cfg: ApertureConfig | None = None) -> Bearing:
    """Bearing of one source in free space."""
    position_m = arc()
    product = product_of(position_m, source_at(azimuth_rad, range_m, position_m))
    return aperture_bearing(product, position_m, wavelength_m=WAVELENGTH_M, cfg=cfg)


@settings(max_examples=25)
@given(angles_rad, st.floats(2.0, 30.0))
def test_sources_near_and_far_are_found(azimuth_rad: float, range_m: float) -> None:
    found = found_at(azimuth_rad, range_m)
    assert away_deg(found.azimuth_rad, azimuth_rad) < 1.0
    assert found.height > 0.8
    assert found.side_ratio < 0.3


@pytest.mark.parametrize("range_m", [2.0, 3.0, 4.0])
def test_plane_waves_are_biased_in_a_room(range_m: float) -> None:
    """Why spherical fronts are searched: half the azimuths would be off by most of a degree."""
    plane = ApertureConfig(curvatures_per_m=(0.0,), elevations_rad=(0.0,))
    azimuths_rad = np.deg2rad(np.arange(-180.0, 180.0, 15.0)).tolist()
    errors_deg = {
        cfg: np.median([away_deg(found_at(angle, range_m, cfg).azimuth_rad, angle) for angle in azimuths_rad])
        for cfg in (plane, ApertureConfig())
    }
    assert errors_deg[plane] > 0.5
    assert errors_deg[ApertureConfig()] < 0.2


@given(st.floats(0.0, 1.5), st.integers(0, 2**32 - 1))
def test_without_curvature_the_front_is_a_plane(elevation_rad: float, seed: int) -> None:
    position_m, grid_rad = np.random.default_rng(seed).uniform(-0.4, 0.4, (20, 3)), azimuth_grid(72)
    plane = displacement_steering(
        position_m, grid_rad, elevation_rad=elevation_rad, wavelength_m=WAVELENGTH_M
    )
    front = spherical_steering(
        position_m, grid_rad, elevation_rad=elevation_rad, curvature_per_m=0.0, wavelength_m=WAVELENGTH_M
    )
    np.testing.assert_allclose(front, plane, atol=1e-3)


@given(st.floats(0.05, 0.6), st.floats(0.0, 1.0), st.integers(0, 2**32 - 1))
def test_fronts_follow_the_distance_to_the_source(
    curvature_per_m: float, elevation_rad: float, seed: int
) -> None:
    position_m, grid_rad = np.random.default_rng(seed).uniform(-0.4, 0.4, (20, 3)), azimuth_grid(72)
    range_m = 1.0 / curvature_per_m
    flat = np.cos(elevation_rad) * np.stack([np.cos(grid_rad), np.sin(grid_rad)], axis=1)
    source_m = range_m * np.column_stack([flat, np.full(len(grid_rad), np.sin(elevation_rad))])
    way_m = np.linalg.norm(source_m[None] - position_m[:, None], axis=2)
    front = spherical_steering(
        position_m,
        grid_rad,
        elevation_rad=elevation_rad,
        curvature_per_m=curvature_per_m,
        wavelength_m=WAVELENGTH_M,
    )
    expected = np.exp(4j * np.pi / WAVELENGTH_M * (range_m - way_m))
    np.testing.assert_allclose(front, expected, atol=2e-3)


@settings(max_examples=10)
@given(angles_rad, st.integers(-180, 180))
def test_bearings_turn_with_the_world(azimuth_rad: float, turn_deg: int) -> None:
    """By whole bins of the grid: the profile itself turns."""
    position_m, turn_rad = arc(), math.radians(turn_deg)
    c, s = math.cos(turn_rad), math.sin(turn_rad)
    turned_m = position_m @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    product = product_of(position_m, source_at(azimuth_rad, 4.0, position_m))
    found = aperture_bearing(product, position_m, wavelength_m=WAVELENGTH_M)
    turned = aperture_bearing(product, turned_m, wavelength_m=WAVELENGTH_M)
    np.testing.assert_allclose(turned.profile, np.roll(found.profile, turn_deg), atol=1e-3)


@settings(max_examples=10)
@given(st.integers(0, 2**32 - 1))
def test_timing_gain_and_origin_do_not_matter(seed: int) -> None:
    rng, position_m = np.random.default_rng(seed), arc()
    product = product_of(position_m, source_at(0.7, 3.0, position_m))
    slope = np.exp(1j * rng.uniform(-0.5, 0.5, (len(product), 1)) * (np.arange(N_SUBCARRIERS) - 14.5))
    gain = rng.uniform(1.0, 1e4, (len(product), 1))
    disturbed = (product * slope * gain).astype(np.complex64)
    np.testing.assert_allclose(timing_removed(disturbed), product, atol=1e-3)
    found = aperture_bearing(product, position_m, wavelength_m=WAVELENGTH_M)
    again = aperture_bearing(disturbed, position_m + rng.uniform(-9.0, 9.0, 3), wavelength_m=WAVELENGTH_M)
    np.testing.assert_allclose(again.profile, found.profile, atol=1e-3)


def test_pieces_of_the_path_are_means() -> None:
    position_m = np.array(
        [[0.0, 0.0, 0.0], [0.001, 0.0, 0.0], [0.012, 0.0, 0.0], [0.013, 0.0, 0.0], [0.031, 0.0, 0.0]]
    )
    signal = np.array([[1.0], [3.0], [5.0], [7.0], [9.0]], np.complex64)
    means, at_m = evenly_spaced(signal, position_m, spacing_m=0.01)
    np.testing.assert_allclose(means[:, 0], [2.0, 6.0, 9.0])
    np.testing.assert_allclose(at_m[:, 0], [0.0005, 0.0125, 0.031])


def test_silence_has_no_peak() -> None:
    found = aperture_bearing(np.zeros((300, N_SUBCARRIERS), np.complex64), arc(), wavelength_m=WAVELENGTH_M)
    assert found.height == 0.0
    assert found.side_ratio == 0.0


@pytest.mark.parametrize(
    "wrong",
    [
        {"n_azimuths": 4},
        {"spacing_m": 0.0},
        {"n_peaks": 0},
        {"elevations_rad": ()},
        {"curvatures_per_m": (-0.1,)},
    ],
)
def test_configurations_without_meaning_are_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=next(iter(wrong))):
        ApertureConfig(**wrong)


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1))
def test_the_root_of_a_square_is_the_channel(seed: int) -> None:
    """Four paths, every lambda / 32 of the way: but for one sign per subcarrier and rare deep fades."""
    rng = np.random.default_rng(seed)
    position_m = arc(600)
    sources_m = rng.uniform(-5.0, 5.0, (4, 3)) * [1.0, 1.0, 0.0]
    away_m = np.linalg.norm(position_m[:, None] - sources_m, axis=2)
    gain = [1.0, 0.4, 0.2, 0.1] * np.exp(1j * rng.uniform(-np.pi, np.pi, (N_SUBCARRIERS, 1, 4)))
    channel = np.sum(gain * np.exp(-2j * np.pi / WAVELENGTH_M * away_m), axis=2).T.astype(np.complex64)
    root = unsquared(channel**2)
    np.testing.assert_allclose(root**2, channel**2, atol=1e-4)
    sign = np.sign((root * channel.conj()).real)
    assert np.mean(np.abs(sign.mean(axis=0)) == 1.0) > 0.9


def test_ghosts_of_the_square_are_not_in_its_root() -> None:
    """Two paths of amplitudes 1 and 0.7: the square has a third, of amplitude 1.4, at their bisector."""
    position_m = arc(600)
    sources_m = [source_at(angle, 50.0, position_m) for angle in (-0.15, 0.15)]
    away_m = [np.linalg.norm(position_m - source_m, axis=1) for source_m in sources_m]
    one_way = np.array([1.0, 0.7]) @ np.exp(-2j * np.pi / WAVELENGTH_M * np.array(away_m))
    squared = np.repeat(one_way[:, None] ** 2, N_SUBCARRIERS, axis=1).astype(np.complex64)
    both_ways, alone = aperture_profiles(squared, position_m, wavelength_m=WAVELENGTH_M)
    bisector, direct = 180, 180 - round(math.degrees(0.15))
    assert both_ways[bisector] > both_ways[direct - 1 : direct + 2].max()
    assert alone[bisector] < 0.5 * alone[direct - 1 : direct + 2].max()
