"""What `reproduce real` does with a recorded run, on runs whose every pose is known."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy import stats
from support.mrclam_folder import BEGIN_S, circle, seen_by, write_run

from baselines.reproduce import _figures
from baselines.reproduce.__main__ import main
from baselines.reproduce.real_outliers import TREATMENTS, errors_of, often_met, tails, wifi_errors
from baselines.reproduce.real_windows import N_WINDOWS, SOLVED, Window, data_folder, run_in, window
from wifipgo.datasets import cut_run, read_mrclam
from wifipgo.errors import BadInputError
from wifipgo.graph.bearings import bearing_residuals


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three robots that see each other every 1.1 s."""
    return write_run(tmp_path_factory.mktemp("run"), lasts_s=62.0, every_s=1.1)


@pytest.fixture(scope="module")
def drifting(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two robots whose wheels err."""
    place = tmp_path_factory.mktemp("drifting")
    return write_run(place, lasts_s=32.0, every_s=1.1, robots=(1, 2), wheels_err=(0.1, 0.3))


def test_a_piece_begins_at_the_truth(folder: Path) -> None:
    whole = read_mrclam(folder)
    piece = cut_run(whole, 10, 25, robots=(0, 2))
    assert piece.robots == (1, 3)
    exact = np.stack([circle(n, whole.time_s[10:26]) for n in (1, 3)])
    np.testing.assert_allclose(piece.start, exact, atol=1e-6)
    assert len(piece.odometry) == 2 * 15
    ends = whole.bearings.observer, whole.bearings.target
    inside = [(end[:, 0] != 1) & (end[:, 1] >= 10) & (end[:, 1] <= 25) for end in ends]
    assert len(piece.bearings) == len(piece.ranges) == int((inside[0] & inside[1]).sum()) > 0
    assert np.abs(bearing_residuals(piece.truth, piece.bearings)).max() < 0.05
    for arguments in (
        {"first": 5, "last": 5},
        {"first": 0, "last": 99},
        {"first": 0, "last": 5, "robots": (2, 0)},
    ):
        with pytest.raises(BadInputError, match=r"must be (ascending|rows)"):
            cut_run(whole, **arguments)


def test_windows_share_no_step_and_exact_wheels_stay_exact(folder: Path, tmp_path: Path) -> None:
    run = run_in(folder)
    pieces = [window(run, k) for k in range(N_WINDOWS)]
    assert sum(len(piece.time_s) - 1 for piece in pieces if piece is not None) == len(run.time_s) - 1
    task = Window(folder, 3, tmp_path / "window.npz")
    task.keep(task.compute())
    found = task.load()
    assert found["errors"].shape == (1 + len(SOLVED),)
    assert found["errors"][0] < 1e-10  # dead reckoning
    assert max(found["errors"].max(), found["online"].max()) < 0.01


def test_a_draw_is_solved_under_every_treatment(folder: Path, drifting: Path) -> None:
    assert [pair.piece.robots for pair in often_met(run_in(folder))] == [(1, 2), (1, 3), (2, 3)]
    (pair,) = often_met(run_in(drifting))
    for who, at, azimuth_rad in zip(pair.who, pair.at, pair.camera_rad, strict=True):
        exact_rad = seen_by(1 + who, 2 - who, BEGIN_S + float(at))[1]
        assert np.abs(np.remainder(azimuth_rad - exact_rad + np.pi, 2.0 * np.pi) - np.pi) < 0.1
    errors = dict(zip(TREATMENTS, errors_of([pair], np.random.default_rng(0)), strict=True))
    assert all(0.0 < error < 5.0 or np.isnan(error) for error in errors.values())
    assert len({errors["nothing"], errors["removed"], errors["eq11_camera"], errors["factors_camera"]}) == 4


@pytest.mark.parametrize(("median_deg", "beyond_20"), [(6.0, 0.06), (12.0, 0.34)])
def test_errors_like_wifi_have_the_median_the_tails_and_the_memory(
    median_deg: float, beyond_20: float
) -> None:
    freedom, scale_deg = tails(median_deg, beyond_20)
    assert 2.0 * stats.t.sf(20.0 / scale_deg, freedom) == pytest.approx(beyond_20, abs=0.005)
    time_s = np.arange(20_000.0)
    error_deg = np.rad2deg(wifi_errors(time_s, median_deg, beyond_20, rng=np.random.default_rng(2)))
    assert np.median(np.abs(error_deg)) == pytest.approx(median_deg, rel=0.05)
    assert np.mean(np.abs(error_deg) > 20.0) == pytest.approx(beyond_20, abs=0.015)
    clipped = np.clip(error_deg, -30.0, 30.0)
    assert 0.3 < np.corrcoef(clipped[1:], clipped[:-1])[0, 1] < 0.58


def test_without_data_nothing_is_run_and_it_says_why(tmp_path: Path) -> None:
    out, empty = tmp_path / "out", tmp_path / "empty"
    empty.mkdir()
    arguments = ["real", "--data", str(empty), "--trials", "1", "--roots", "1", "--jobs", "1"]
    assert main([*arguments, "--executor", "serial", "--out", str(out)]) == 0
    claims = json.loads((out / "real" / "claims.json").read_text("utf-8"))["claims"]
    assert [claim["verdict"] for claim in claims] == ["not run"] * 4
    assert all("docs/datasets.md" in claim["findings"][0]["note"] for claim in claims)
    assert "not run" in (out / "real" / "real.md").read_text("utf-8")
    assert data_folder(empty) is None
    assert "real" not in _figures.chosen(("all",))
