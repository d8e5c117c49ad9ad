"""MUSIC against its definition by eigenvectors of the covariance."""

import numpy as np
import pytest

from wifipgo.radio import aoa
from wifipgo.radio.aoa.music import music_profiles, signal_subspace

GRID = aoa.azimuth_grid(360)
STEERING = aoa.turn_steering(np.linspace(-np.pi / 2.0, 0.0, 64), GRID, antenna_gap_m=0.22, wavelength_m=0.06)


def noise(*shape: int, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)).astype(np.complex64)


def plane_waves(*azimuths_deg: float, n_snapshots: int = 30) -> np.ndarray:
    """Waves of independent amplitude in every snapshot, 20 dB above the noise."""
    bins = [round(a) + 180 for a in azimuths_deg]
    waves = noise(n_snapshots, len(bins), seed=1) @ STEERING[:, bins].T
    return (waves + 0.1 * noise(n_snapshots, 64, seed=2))[None]


@pytest.mark.parametrize("n_paths", [1, 2, 3])
@pytest.mark.parametrize("n_snapshots", [5, 90])
def test_spectrum_is_that_of_the_noise_eigenvectors(n_paths: int, n_snapshots: int) -> None:
    snapshots = noise(2, n_snapshots, 64)
    for link in range(2):
        z = snapshots[link].astype(np.complex128)
        _, vectors = np.linalg.eigh(z.T @ z.conj())
        leak = (np.abs(vectors[:, : 64 - n_paths].conj().T @ STEERING) ** 2).sum(axis=0)
        share = music_profiles(snapshots, STEERING, n_paths=n_paths)[link]
        np.testing.assert_allclose(aoa.eq5_profiles(share, 64), 1.0 / leak, rtol=1e-4)


def test_one_snapshot_and_one_path_is_the_bartlett_profile() -> None:
    signal = noise(40, 1, 64)
    music = music_profiles(signal, STEERING, n_paths=1)
    np.testing.assert_allclose(music, aoa.bartlett_profiles(signal[:, 0], STEERING), atol=1e-5)


def test_two_paths_that_bartlett_merges_are_resolved() -> None:
    """8 deg apart in the aperture of the paper, each with its own fading over the subcarriers."""
    snapshots = plane_waves(-50.0, -42.0)
    bartlett = aoa.profiles(snapshots, _pair(), azimuths_rad=GRID)[:, 0]
    music = music_profiles(snapshots, STEERING, n_paths=2)
    merged = aoa.find_peaks(bartlett, n_peaks=2, separation_rad=np.deg2rad(2.0))
    apart = aoa.find_peaks(music, n_peaks=2, separation_rad=np.deg2rad(2.0))
    assert np.ptp(np.rad2deg(merged.azimuth_rad[0])) > 20.0  # its second peak is a side lobe
    np.testing.assert_allclose(np.sort(np.rad2deg(apart.azimuth_rad[0])), [-50.0, -42.0], atol=1.0)


def _pair() -> aoa.Aperture:
    return aoa.turning_pair(np.linspace(-np.pi / 2.0, 0.0, 64), antenna_gap_m=0.22, wavelength_m=0.06)


def test_basis_is_orthonormal() -> None:
    basis = signal_subspace(noise(3, 30, 64), n_paths=4)
    np.testing.assert_allclose(basis.conj() @ basis.swapaxes(1, 2), np.tile(np.eye(4), (3, 1, 1)), atol=1e-5)


@pytest.mark.parametrize(("rank", "n_paths"), [(1, 2), (2, 2), (3, 5)])
def test_what_has_no_rank_is_refused(rank: int, n_paths: int) -> None:
    full = noise(1, 30, 64)
    short = (noise(1, 30, rank) @ noise(1, rank, 64)).astype(np.complex64)
    with pytest.raises(ValueError, match=rf"n_paths .*got {n_paths} at rank {rank} of link 1"):
        music_profiles(np.concatenate([full, short]), STEERING, n_paths=n_paths)


@pytest.mark.parametrize(("n_snapshots", "n_paths"), [(30, 0), (30, 30), (1, 2), (100, 64)])
def test_more_paths_than_the_input_can_have_are_refused(n_snapshots: int, n_paths: int) -> None:
    with pytest.raises(ValueError, match=f"n_paths must be 1, or in .*got {n_paths}"):
        music_profiles(noise(1, n_snapshots, 64), STEERING, n_paths=n_paths)


def test_nothing_heard_gives_zeros() -> None:
    snapshots = noise(3, 30, 64)
    snapshots[1] = 0.0
    profile = music_profiles(snapshots, STEERING, n_paths=3)
    assert np.isfinite(profile).all()
    assert not profile[1].any()
    assert profile[[0, 2]].any(axis=1).all()


@pytest.mark.parametrize("name", sorted(aoa.ESTIMATORS))
def test_no_links_give_no_profiles(name: str) -> None:
    profile = aoa.pair_profiles(noise(0, 2, 64, 30), STEERING, aoa.AoaConfig(aoa_estimator=name))
    assert profile.shape == (0, 360)


def test_pair_profiles_look_the_estimator_up() -> None:
    csi = noise(4, 2, 64, 30)
    for name in aoa.ESTIMATORS:
        profile = aoa.pair_profiles(csi, STEERING, aoa.AoaConfig(aoa_estimator=name))
        assert profile.shape == (4, 360)
        assert ((profile >= 0.0) & (profile <= 1.0 + 1e-6)).all()
    np.testing.assert_array_equal(
        aoa.pair_profiles(csi, STEERING, aoa.AoaConfig()),
        aoa.bartlett_profiles(aoa.product_signal(csi), STEERING),
    )


@pytest.mark.parametrize(("rank", "n_paths"), [(1, 2), (2, 2), (3, 5)])
def test_a_link_that_spans_less_has_the_subspace_that_it_spans(rank: int, n_paths: int) -> None:
    """Without noise that is the projector on what the snapshots span; links beside it stay as they are."""
    full = noise(1, 30, 64)
    short = (noise(1, 30, rank) @ noise(1, rank, 64)).astype(np.complex64)
    both = music_profiles(np.concatenate([full, short]), STEERING, n_paths=n_paths, fewer=True)
    span, _ = np.linalg.qr(short[0, :rank].T)
    expected = (np.abs(span.conj().T @ STEERING) ** 2).sum(axis=0) / 64.0
    np.testing.assert_allclose(both[1], expected, atol=1e-4)
    np.testing.assert_allclose(both[0], music_profiles(full, STEERING, n_paths=n_paths)[0], atol=1e-6)


@pytest.mark.parametrize("n_heard", [0, 1, 2, 3])
def test_few_packets_leave_a_dimension_for_the_noise(n_heard: int) -> None:
    snapshots = noise(1, 30, 64)
    snapshots[:, :, n_heard:] = 0.0
    basis = signal_subspace(snapshots, n_paths=3, fewer=True)
    lengths = np.linalg.norm(basis[0], axis=1)
    np.testing.assert_allclose(lengths, [float(k >= 4 - n_heard) for k in range(3)], atol=1e-6)
