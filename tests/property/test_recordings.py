"""A synthetic run end to end: known bearings are found, and the command says so."""

import csv
import json
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from support.synthetic_run import CHANNEL, SPOTS_M, TRUTH, TX3, refusal, write_run

from wifipgo.radio.recordings.__main__ import main
from wifipgo.radio.recordings.intel5300 import STOCK, CsiLog, encode_csi_log, payload_bytes
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
    found = json.loads((tmp_path / "new" / "folder" / "synthetic.json").read_text())
    with (tmp_path / "new" / "folder" / "synthetic.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    for row, one in zip(rows, found, strict=True):
        assert float(row["bearing_deg"]) == one["bearing_deg"] == one["peaks"][0]["azimuth_deg"]
        error_deg = away_deg(np.deg2rad(one["bearing_deg"]), np.deg2rad(one["truth_deg"]))
        assert one["error_deg"] == pytest.approx(error_deg)
        assert abs(error_deg) < 1.0


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
    log, out = damaged / TX3, damaged.parent / "packets"
    assert main([str(log), "--out", str(out)]) == 0
    said = capsys.readouterr().out
    assert "host-stamped" in said
    assert MACS["rx"] in said
    with (out / f"{log.stem}.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 600
    assert {row["antennas"] for row in rows} == {"ABC"}
    assert {row["sender"] for row in rows} == {MACS["rx"]}
    log.write_bytes(log.read_bytes()[:-1])
    assert "at byte" in refusal(log, capsys)


def test_a_stock_log_is_read(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The card's clock begins again after 2^32 us; a packet that C alone heard is in C's column."""
    header = np.zeros(3, STOCK)
    header["n_rx"], header["n_tx"], header["payload_bytes"] = 1, 1, payload_bytes(1)
    header["antenna_sel"], header["noise_dbm"] = [2, 0, 2], [-127, -90, -90]
    header["clock_us"] = [2**32 - 500_000, 0, 250_000]
    csi = np.zeros((3, 30, 3, 1), np.complex64)
    csi[[0, 2], :, 2], csi[1, :, 0] = 3 + 4j, 10
    (tmp_path / "stock.dat").write_bytes(encode_csi_log(CsiLog(header, csi)))
    assert main([str(tmp_path / "stock.dat"), "--out", str(tmp_path)]) == 0
    assert "the layout names none" in capsys.readouterr().out
    with (tmp_path / "stock.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["antennas"] for row in rows] == ["C", "A", "C"]
    assert [float(row["since_first_s"]) for row in rows] == pytest.approx([0.0, 0.5, 0.75])
    assert [(row["csi_rms_A"], row["csi_rms_C"]) for row in rows] == [("", "5.0"), ("10.0", ""), ("", "5.0")]
    assert [row["noise_dbm"] for row in rows] == ["", "-90", "-90"]


@pytest.mark.parametrize("what", ["one transmitter", "the file"])
def test_without_a_survey_there_are_bearings(
    what: str, damaged: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    survey = damaged / TRUTH
    about = json.loads(survey.read_text("utf-8"))
    if what == "one transmitter":
        del about["true_tx_positions"]["value"]["tx3"]
    survey.write_text(json.dumps(about), "utf-8")
    command = [str(damaged), "--out", str(tmp_path)]
    if what == "the file":
        survey.unlink()
        assert "channel must be given (--channel, 7..200)" in refusal(damaged, capsys)
        command += ["--channel", str(CHANNEL)]
    assert main(command) == 0
    found = json.loads((tmp_path / f"{damaged.name}.json").read_text())
    errors = {row["transmitter"]: row["error_deg"] for row in found}
    assert errors["tx3"] is None
    assert (errors["tx2"] is None) == (what != "one transmitter")
    assert (tmp_path / f"{damaged.name}.png").is_file()


def test_no_such_path_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "no such file or folder" in refusal(tmp_path / "nowhere", capsys)
