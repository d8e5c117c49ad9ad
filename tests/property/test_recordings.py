"""A synthetic run end to end: known bearings are found, and the command says so."""

import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from support.synthetic_run import SPOTS_M, TX3, refusal, write_run

from wifipgo.radio.recordings.__main__ import main
from wifipgo.radio.recordings.recorded_link import bearing
from wifipgo.radio.recordings.wsr_dataset import MACS, read_links


def away_deg(estimate_rad: float, truth_rad: float) -> float:
    """Wrapped difference, degrees."""
    return math.degrees(math.remainder(estimate_rad - truth_rad, math.tau))


def test_known_bearings_are_found(synthetic_run: Path) -> None:
    links = read_links(synthetic_run)
    assert [link.transmitter for link in links] == list(SPOTS_M)
    for link, spot in zip(links, SPOTS_M.values(), strict=True):
        # The path's mean lies at x = 0.3 * 2 / pi, y = 0.
        assert link.truth_rad == pytest.approx(np.arctan2(spot[1], spot[0] - 0.6 / np.pi), abs=2e-3)
        found = bearing(link)
        assert abs(away_deg(found.azimuth_rad, link.truth_rad)) < 1.0
        assert found.height > 0.8
        assert found.side_ratio < 0.2


@pytest.mark.parametrize("azimuth_deg", range(-165, 180, 60))
def test_every_direction_is_found(azimuth_deg: int, tmp_path: Path) -> None:
    turn = np.deg2rad(azimuth_deg)
    write_run(tmp_path, transmitters_m={"tx2": (4 * np.cos(turn), 4 * np.sin(turn), 0.2)}, seed=2)
    (link,) = read_links(tmp_path)
    assert abs(away_deg(bearing(link).azimuth_rad, link.truth_rad)) < 1.0


def test_command_prints_and_draws(
    synthetic_run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([str(synthetic_run), "--out", str(tmp_path / "new" / "folder")]) == 0
    text = capsys.readouterr().out
    assert all(
        word in text for word in ("synthetic", "tx2", "tx4", "mean aperture position", "median / mean")
    )
    assert (tmp_path / "new" / "folder" / "synthetic.png").stat().st_size > 20_000


def test_command_line_explains_itself_and_refuses(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "wifipgo.radio.recordings"]
    told = subprocess.run([*command, "--help"], capture_output=True, text=True, check=False)
    assert told.returncode == 0
    assert "mean" in told.stdout
    assert "--out" in told.stdout
    ended = subprocess.run([*command, str(tmp_path)], capture_output=True, text=True, check=False)
    assert ended.returncode == 2
    assert ended.stderr == f"error: {tmp_path}: no csi_rx_*.dat log and no .npz pack in this folder\n"


def test_pictures_do_not_decide_and_ctrl_c_is_one_line(synthetic_run: Path, tmp_path: Path) -> None:
    """A notebook's back-end, python -OO; then an interruption while profiles are worked out."""
    once = ["-OO", "-m", "wifipgo.radio.recordings", str(synthetic_run), "--out", str(tmp_path / "out")]
    env = dict(os.environ) | {"MPLBACKEND": "module://matplotlib_inline.backend_inline"}
    done = subprocess.run([sys.executable, *once], capture_output=True, text=True, check=False, env=env)
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "out" / "synthetic.png").is_file()
    stop = "import wifipgo.radio.recordings.__main__ as r\ndef stop(*_):\n    raise KeyboardInterrupt\n"
    stop += "r.bearing = stop\nraise SystemExit(r.main())"
    command = [sys.executable, "-c", stop, str(synthetic_run), "--out", str(tmp_path / "out")]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    assert ended.returncode == 130
    assert ended.stderr.count("\n") == 1


def test_a_log_alone_says_what_it_holds(damaged: Path, capsys: pytest.CaptureFixture[str]) -> None:
    said = refusal(damaged / TX3, capsys)
    assert "expected the folder of a run" in said
    assert "a log of 600 records, host-stamped layout; antenna A in 600, B in 600, C in 600" in said
    assert f"senders {MACS['rx']} of 600" in said
    (damaged / TX3).write_bytes((damaged / TX3).read_bytes()[:-1])
    assert "at byte" in refusal(damaged / TX3, capsys)


def test_no_such_path_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "no such file or folder" in refusal(tmp_path / "nowhere", capsys)
