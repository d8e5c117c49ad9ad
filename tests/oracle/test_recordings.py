"""Real recordings: a raw run against its pack, and bearings against motion capture and another toolbox."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.data_dir import data_dir

from wifipgo.radio.aoa import azimuth_grid, bartlett_profiles, displacement_steering, find_peaks
from wifipgo.radio.aoa.confidence import least_confident
from wifipgo.radio.aoa.moving_aperture import Bearing
from wifipgo.radio.recordings.__main__ import main
from wifipgo.radio.recordings.intel5300 import BLOCK_BYTES, encode_csi_log, read_csi_log
from wifipgo.radio.recordings.recorded_link import Link, bearing
from wifipgo.radio.recordings.wsr_dataset import read_links
from wifipgo.se2 import wrap_angle

RAW, PACK = "raw_LOS_A_L1", "wsr_slim_dev.npz"


@pytest.fixture(scope="module")
def folder() -> Path:
    return data_dir("wsr")


@pytest.fixture(scope="module")
def reference(folder: Path) -> dict[str, Any]:
    """Truth and others' answers, link by link."""
    content: dict[str, Any] = json.loads((folder / "reference.json").read_text("utf-8"))
    return content


@pytest.fixture(scope="module")
def links(folder: Path) -> list[Link]:
    return read_links(folder / PACK)


@pytest.fixture(scope="module")
def found(links: list[Link]) -> list[Bearing]:
    return [bearing(link) for link in links]


@pytest.fixture(scope="module")
def ours_deg(links: list[Link], found: list[Bearing]) -> np.ndarray:
    """Errors of our top peaks, degrees."""
    return wrapped_deg(
        np.array([b.azimuth_rad - link.truth_rad for b, link in zip(found, links, strict=True)])
    )


def wrapped_deg(angle_rad: np.ndarray) -> np.ndarray:
    return np.rad2deg(wrap_angle(angle_rad))


def centre_value(product: np.ndarray) -> np.ndarray:
    """Phase of a straight line through the subcarriers at index 15.5, mean magnitude of 14 and 15."""
    phase_rad = np.unwrap(np.angle(product), axis=1)
    slope, start = np.polyfit(np.arange(30), phase_rad.T, 1)
    return np.mean(np.abs(product[:, 14:16]), axis=1) * np.exp(1j * (start + 15.5 * slope))


def plain_azimuth_deg(link: Link) -> float:
    """Top peak of plane waves at the centre subcarrier, powers summed over elevations 0, 2, ..., 88 deg."""
    signal = centre_value(link.forward * link.reverse)[None].astype(np.complex64)
    profile = np.zeros((1, 360))
    for elevation_deg in range(0, 90, 2):
        steering = displacement_steering(
            link.displacement_m,
            azimuth_grid(360),
            elevation_rad=np.deg2rad(elevation_deg),
            wavelength_m=link.wavelength_m,
        )
        profile += bartlett_profiles(signal, steering)
    return float(np.rad2deg(find_peaks(profile, n_peaks=1).azimuth_rad[0, 0]))


def test_a_raw_log_is_read_whole(folder: Path) -> None:
    """Every record, and the bytes of all of them when they are written again."""
    path = next((folder / RAW).glob("csi_rx_*.dat"))
    log, raw = read_csi_log(path), path.read_bytes()
    assert len(log.header) == 4640
    assert len(raw) % BLOCK_BYTES == 0
    assert log.end_byte < len(raw)  # the logger was stopped in the middle of a record
    assert encode_csi_log(log) == raw[: log.end_byte]
    antenna_a, antenna_b, antenna_c = np.mean(np.abs(log.csi), axis=(0, 1, 3)).tolist()
    assert antenna_a > 25.0
    assert max(antenna_b, antenna_c) < 5.0  # only A was connected


def test_a_raw_run_equals_its_pack(folder: Path, links: list[Link]) -> None:
    raw = read_links(folder / RAW)
    assert [len(link.forward) for link in raw] == [874, 875, 873]
    for ours, packed in zip(raw, links, strict=False):
        assert ours.transmitter == packed.transmitter
        np.testing.assert_array_equal(ours.forward * ours.reverse, packed.forward * packed.reverse)
        np.testing.assert_allclose(ours.displacement_m, packed.displacement_m, atol=1e-5)
        assert ours.truth_rad == pytest.approx(packed.truth_rad, abs=1e-6)
        assert ours.wavelength_m == packed.wavelength_m


def test_links_are_those_of_the_reference(links: list[Link], reference: dict[str, Any]) -> None:
    for link, row in zip(links, reference["links"], strict=True):
        assert (link.set_name, link.place, link.transmitter) == (row["set"], str(row["loc"]), row["tx"])
        assert len(link.forward) == row["packets"]
        assert np.rad2deg(link.truth_rad) == pytest.approx(row["bearing_mean_deg"], abs=1e-3)


def test_the_plain_profile_has_the_peaks_of_the_reference(
    links: list[Link], reference: dict[str, Any]
) -> None:
    """Same packets, same steering, another grid. Every third link, for time."""
    plain = np.deg2rad([plain_azimuth_deg(link) for link in links[::3]])
    expected = np.deg2rad([row["elsum_deg"] for row in reference["links"][::3]])
    away_deg = np.abs(wrapped_deg(plain - expected))
    assert np.mean(away_deg < 1.1) >= 0.9


def test_bearings_are_no_worse_than_the_toolbox(links: list[Link], ours_deg: np.ndarray) -> None:
    toolbox_deg = wrapped_deg(np.array([link.toolbox_rad[0] - link.truth_rad for link in links]))
    in_sight = np.array([link.set_name.startswith("LOS") for link in links])
    for chosen in (in_sight, ~in_sight, in_sight | ~in_sight):
        ours, toolbox = np.abs(ours_deg[chosen]), np.abs(toolbox_deg[chosen])
        assert np.median(ours) < np.median(toolbox)
        assert np.mean(ours) < np.mean(toolbox)
    assert np.median(np.abs(ours_deg)) <= 4.29
    assert np.median(np.abs(ours_deg[in_sight])) <= 1.0


def test_without_the_least_confident_tenth_the_mean_beyond_sight_halves(
    links: list[Link], found: list[Bearing], ours_deg: np.ndarray
) -> None:
    """The confidence sees profiles only; three of thirty links are left out."""
    expected = np.array([b.expected_error_rad for b in found])
    beyond = np.array([link.set_name.startswith("NLOS") for link in links])
    kept = ~least_confident(expected)
    assert kept.sum() == 27
    assert np.abs(ours_deg[beyond & kept]).mean() < 0.5 * np.abs(ours_deg[beyond]).mean()
    assert np.abs(ours_deg[~beyond & kept]).mean() < 1.8


def test_the_command_reports_and_draws(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([str(folder / RAW), "--out", str(tmp_path)]) == 0
    text = capsys.readouterr().out
    assert all(
        word in text for word in (RAW, "tx2", "tx3", "tx4", "874", "875", "873", "mean aperture position")
    )
    assert (tmp_path / f"{RAW}.png").stat().st_size > 20_000


@pytest.mark.parametrize("n_blocks", [132, 88, 10])
def test_a_run_with_half_a_log_is_refused(n_blocks: int, folder: Path, tmp_path: Path) -> None:
    """Cut where the logger itself cuts, a log looks whole: that it ends before the motion gives it away."""
    for path in (folder / RAW).iterdir():
        whole = path.read_bytes()
        cut = n_blocks * BLOCK_BYTES if path.name.startswith("csi_rx_") else len(whole)
        (tmp_path / path.name).write_bytes(whole[:cut])
    with pytest.raises(ValueError, match=r"csi_rx_.* expected packets of the whole motion"):
        read_links(tmp_path)
