"""A synthetic run end to end: known bearings are found, and damaged runs are refused in one line."""

import json
import math
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from support.synthetic_run import STAMP, write_run

from wifipgo.radio.recordings.__main__ import bearing, main
from wifipgo.radio.recordings.intel5300 import BLOCK_BYTES, STOCK, CsiLog, encode_csi_log, read_csi_log
from wifipgo.radio.recordings.wsr_dataset import MACS, pair, read_links

SPOTS_M = {"tx2": (-2.4, 2.6, 0.7), "tx3": (2.5, -2.6, 0.5), "tx4": (-3.7, -1.5, 0.3)}
RX, TX3 = f"csi_rx_{STAMP}.dat", f"csi_tx3_{STAMP}.dat"
TRAJECTORY, TRUTH = f"rx_trajectory_{STAMP}_.csv", "groundtruth_positions.json"


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("recordings") / "synthetic"
    write_run(folder, transmitters_m=SPOTS_M, seed=1)
    return folder


@pytest.fixture
def damaged(run: Path, tmp_path: Path) -> Path:
    """A copy of the run, to be damaged."""
    return shutil.copytree(run, tmp_path / "run")


def away_deg(estimate_rad: float, truth_rad: float) -> float:
    """Wrapped difference, degrees."""
    return math.degrees(math.remainder(estimate_rad - truth_rad, math.tau))


def refusal(path: Path, capsys: pytest.CaptureFixture[str]) -> str:
    """The one line on stderr with which the command ends."""
    assert main([str(path), "--out", str(path.parent / "pictures")]) == 2
    line = capsys.readouterr().err
    assert line.count("\n") == 1
    return line


def test_known_bearings_are_found(run: Path) -> None:
    links = read_links(run)
    assert [link.transmitter for link in links] == list(SPOTS_M)
    for link, spot in zip(links, SPOTS_M.values(), strict=True):
        # The path's mean lies at x = 0.3 * 2 / pi, y = 0.
        assert link.truth_rad == pytest.approx(np.arctan2(spot[1], spot[0] - 0.6 / np.pi), abs=2e-3)
        found = bearing(link)
        assert abs(away_deg(found.azimuth_rad, link.truth_rad)) < 1.0
        assert found.height > 0.8
        assert found.side_ratio < 0.2


@pytest.mark.parametrize("azimuth_deg", range(-165, 180, 30))
def test_every_direction_is_found(azimuth_deg: int, tmp_path: Path) -> None:
    turn = np.deg2rad(azimuth_deg)
    write_run(tmp_path, transmitters_m={"tx2": (4 * np.cos(turn), 4 * np.sin(turn), 0.2)}, seed=2)
    (link,) = read_links(tmp_path)
    assert abs(away_deg(bearing(link).azimuth_rad, link.truth_rad)) < 1.0


def test_pairs_carry_the_same_counter(run: Path) -> None:
    """Lost packets and repeated counters: what is left still belongs together."""
    received, answered = read_csi_log(run / RX), read_csi_log(run / TX3)
    lost = CsiLog(answered.header[5::2], answered.csi[5::2])
    twice = CsiLog(np.append(lost.header, lost.header[:50]), np.concatenate([lost.csi, lost.csi[:50]]))
    forward, reverse = pair(received, twice, transmitter_mac="00:21:6a:30:d2:3c")
    assert len(forward) == len(lost.header)
    assert reverse.max() < len(lost.header)  # the first of a repeated counter
    np.testing.assert_array_equal(
        received.header["frame_count"][forward], twice.header["frame_count"][reverse]
    )


def test_command_prints_and_draws(run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([str(run), "--out", str(tmp_path / "new" / "folder")]) == 0
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


def test_pictures_do_not_decide_and_ctrl_c_is_one_line(run: Path, tmp_path: Path) -> None:
    """A notebook's back-end, python -OO; then an interruption while profiles are worked out."""
    once = ["-OO", "-m", "wifipgo.radio.recordings", str(run), "--out", str(tmp_path / "out")]
    env = dict(os.environ) | {"MPLBACKEND": "module://matplotlib_inline.backend_inline"}
    done = subprocess.run([sys.executable, *once], capture_output=True, text=True, check=False, env=env)
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "out" / "synthetic.png").is_file()
    stop = "import wifipgo.radio.recordings as r\ndef stop(*_):\n    raise KeyboardInterrupt\n"
    stop += "r.bearing = stop\nraise SystemExit(r.main())"
    command = [sys.executable, "-c", stop, str(run), "--out", str(tmp_path / "out")]
    ended = subprocess.run(command, capture_output=True, text=True, check=False)
    assert ended.returncode == 130
    assert ended.stderr.count("\n") == 1


@pytest.mark.parametrize("name", [RX, TX3])
def test_a_cut_log_is_refused(name: str, damaged: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = damaged / name
    path.write_bytes(path.read_bytes()[:70_001])
    line = refusal(damaged, capsys)
    assert f"{name}: at byte {70_001 // 233 * 233}: expected a whole record (233 bytes)" in line


@pytest.mark.parametrize("name", [RX, TX3])
def test_a_log_cut_at_a_block_is_refused(
    name: str, damaged: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Byte by byte such a log is whole; it ends before the motion does."""
    path = damaged / name
    path.write_bytes(path.read_bytes()[: 20 * BLOCK_BYTES])
    line = refusal(damaged, capsys)
    assert f"{name}: at byte {20 * BLOCK_BYTES // 233 * 233}: expected packets of the whole motion" in line


@pytest.mark.parametrize("name", [TRAJECTORY, TRUTH])
def test_a_missing_file_is_named(name: str, damaged: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (damaged / name).unlink()
    assert name.split("_.", maxsplit=1)[0] in refusal(damaged, capsys)


def test_a_run_without_transmitters_is_refused(damaged: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for log in damaged.glob("csi_tx*"):
        log.unlink()
    assert "csi_tx*" in refusal(damaged, capsys)


@pytest.mark.parametrize("key", ["channel", "true_rx_position", "true_tx_positions"])
def test_a_missing_survey_key_is_named(key: str, damaged: Path, capsys: pytest.CaptureFixture[str]) -> None:
    truth = json.loads((damaged / TRUTH).read_text("utf-8"))
    del truth[key]
    (damaged / TRUTH).write_text(json.dumps(truth), "utf-8")
    assert f"{TRUTH}: no key {key!r}" in refusal(damaged, capsys)


def test_a_survey_without_numbers_is_refused(damaged: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = (damaged / TRUTH).read_text("utf-8")
    (damaged / TRUTH).write_text(text.replace("108", "null"), "utf-8")
    assert "key 'channel' must hold a number in 7..200, got None" in refusal(damaged, capsys)
    (damaged / TRUTH).write_text(text[:-5], "utf-8")
    assert "not JSON" in refusal(damaged, capsys)


def test_an_unknown_transmitter_lists_the_known(damaged: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (damaged / TX3).rename(damaged / f"csi_tx9_{STAMP}.dat")
    text = (damaged / TRUTH).read_text("utf-8")
    (damaged / TRUTH).write_text(text.replace("tx3", "tx9"), "utf-8")
    assert "unknown transmitter 'tx9'; known: rx, tx2, tx3, tx4" in refusal(damaged, capsys)


def test_other_robots_are_named_in_a_file(run: Path, damaged: Path) -> None:
    """The same logs under another name: the same link, once the file says whose address is whose."""
    (damaged / TX3).rename(damaged / f"csi_tx9_{STAMP}.dat")
    text = (damaged / TRUTH).read_text("utf-8")
    (damaged / TRUTH).write_text(text.replace("tx3", "tx9"), "utf-8")
    (damaged / "macs.json").write_text(json.dumps({"tx9": MACS["tx3"].upper()}), "utf-8")
    renamed, original = read_links(damaged)[-1], read_links(run)[1]
    assert renamed.transmitter == "tx9"
    np.testing.assert_array_equal(renamed.forward, original.forward)
    assert renamed.truth_rad == original.truth_rad


@pytest.mark.parametrize("text", ["[]", '{"tx9": 7}', '{"tx9": "00:21:6a"}', "{"])
def test_wrong_addresses_are_refused(text: str, damaged: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (damaged / "macs.json").write_text(text, "utf-8")
    assert "macs.json" in refusal(damaged, capsys)


@pytest.mark.parametrize(
    "text", ["", "seconds,x,y,z\n", "1.0,0.0,0.1,nan,0.2,\n" * 9, "1.0,0.0,0.1,0.1,0.2,\n" * 9]
)
def test_a_trajectory_without_motion_is_refused(
    text: str, damaged: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (damaged / TRAJECTORY).write_text(text, "utf-8")
    assert TRAJECTORY in refusal(damaged, capsys)


def test_the_stock_layout_cannot_be_paired(damaged: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = read_csi_log(damaged / TX3)
    header = np.zeros(len(log.header), STOCK)
    for field in STOCK.names or ():
        header[field] = log.header[field]
    (damaged / TX3).write_bytes(encode_csi_log(CsiLog(header, log.csi)))
    assert "expected host-stamped records" in refusal(damaged, capsys)


def pack_of(run: Path) -> dict[str, np.ndarray]:
    """The arrays of a pack with the first link of a run."""
    link = read_links(run)[0]
    about = {"set": "S", "loc": 1, "stamp": STAMP, "tx": "tx2", "bearing_mean": np.rad2deg(link.truth_rad)}
    parts = [np.stack([h.real, h.imag], axis=-1).astype(np.int8) for h in (link.forward, link.reverse)]
    return {"f0": parts[0], "r0": parts[1], "p0": link.displacement_m, "meta": np.array(json.dumps([about]))}


def test_a_pack_gives_the_links_of_its_run(run: Path, tmp_path: Path) -> None:
    np.savez(tmp_path / "pack.npz", **pack_of(run))  # type: ignore[arg-type]
    (packed,), raw = read_links(tmp_path), read_links(run)[0]
    np.testing.assert_array_equal(packed.forward, raw.forward)
    np.testing.assert_array_equal(packed.reverse, raw.reverse)
    assert packed.truth_rad == pytest.approx(raw.truth_rad)
    assert bearing(packed).azimuth_rad == bearing(raw).azimuth_rad


@pytest.mark.parametrize("key", ["meta", "f0", "r0", "p0"])
def test_a_missing_pack_key_is_named(
    key: str, run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arrays = pack_of(run)
    del arrays[key]
    np.savez(tmp_path / "pack.npz", **arrays)  # type: ignore[arg-type]
    assert f"pack.npz: no key {key!r}" in refusal(tmp_path / "pack.npz", capsys)


def test_a_damaged_pack_is_refused(run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, arrays = tmp_path / "pack.npz", pack_of(run)
    np.savez(path, **arrays)  # type: ignore[arg-type]
    whole = path.read_bytes()
    for raw in (whole[:-100], whole[:1000], b"", b"no pack", whole[:40_000] + bytes(500) + whole[40_500:]):
        path.write_bytes(raw)
        said = refusal(path, capsys)
        assert "expected a whole .npz pack" in said or "no .npz, damaged or cut" in said
    np.savez(path, **{**arrays, "r0": arrays["r0"][1:]})  # type: ignore[arg-type]
    assert "do not fit" in refusal(path, capsys)
    np.savez(path, **{**arrays, "meta": np.array("[]")})  # type: ignore[arg-type]
    assert "no links" in refusal(path, capsys)


@pytest.mark.parametrize(
    "text", ["1e999", "NaN", "-1000", "-2000", "0", "1e12", "true", '"108"', "108.5", "1" + "0" * 400]
)
def test_a_channel_that_is_none_is_refused(
    text: str, damaged: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    truth = (damaged / TRUTH).read_text("utf-8")
    (damaged / TRUTH).write_text(truth.replace("108", text), "utf-8")
    said = refusal(damaged, capsys)
    assert TRUTH in said
    assert "'channel'" in said


@pytest.mark.parametrize("text", ["1e999", "-1e300", "NaN", "false", '"2.5"', "[]"])
def test_a_survey_of_no_place_is_refused(
    text: str, damaged: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    truth = (damaged / TRUTH).read_text("utf-8")
    (damaged / TRUTH).write_text(truth.replace("-2.6", text), "utf-8")
    said = refusal(damaged, capsys)
    assert TRUTH in said
    assert "'tx3.y'" in said


@pytest.mark.parametrize("text", ['{"channel": 1, "channel": 2}', "[" * 100_000, "\udcff", "\0"])
def test_a_survey_that_is_no_json_is_refused(
    text: str, damaged: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (damaged / TRUTH).write_bytes(text.encode("utf-8", "surrogateescape"))
    assert TRUTH in refusal(damaged, capsys)


def test_any_editor_may_have_saved_the_texts(run: Path, damaged: Path) -> None:
    """A byte order mark, Windows ends and a form feed: the same links, to the bit."""
    (damaged / "macs.json").write_text(json.dumps({"tx3": MACS["tx3"]}), "utf-8")
    for name in (TRUTH, TRAJECTORY, "macs.json"):
        text = (damaged / name).read_text("utf-8").replace("\n", "\r\n")
        (damaged / name).write_bytes(b"\xef\xbb\xbf" + text.encode() + b"\f\r\n")
    for marked, plain in zip(read_links(damaged), read_links(run), strict=True):
        np.testing.assert_array_equal(marked.displacement_m, plain.displacement_m)
        np.testing.assert_array_equal(marked.forward, plain.forward)
        assert marked.truth_rad == plain.truth_rad


@pytest.mark.parametrize("mark", [",", ";"])
def test_decimal_commas_are_refused(mark: str, damaged: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = (damaged / TRAJECTORY).read_text("utf-8").replace(",", mark).replace(".", ",")
    (damaged / TRAJECTORY).write_text(text, "utf-8")
    said = refusal(damaged, capsys)
    assert f"{TRAJECTORY}:1: " in said
    assert "decimal point" in said


@pytest.mark.parametrize(
    "changes", [{"bearing_mean": 1e999}, {"bearing_mean": True}, {"toolbox_azimuths": "1"}]
)
def test_a_pack_with_no_angles_is_refused(
    changes: dict[str, object], run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arrays = pack_of(run)
    about = json.loads(str(arrays["meta"]))[0] | changes
    np.savez(tmp_path / "pack.npz", **arrays | {"meta": np.array(json.dumps([about]))})  # type: ignore[arg-type]
    assert next(iter(changes)) in refusal(tmp_path / "pack.npz", capsys)


@pytest.mark.parametrize("name", ["f0", "p0"])
@pytest.mark.parametrize("value", [np.nan, 1e300, True, "1"])
def test_a_pack_with_no_numbers_is_refused(
    name: str, value: object, run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arrays = pack_of(run)
    arrays[name] = np.full(arrays[name].shape, value)
    np.savez(tmp_path / "pack.npz", **arrays)  # type: ignore[arg-type]
    assert f"pack.npz: {name} must be finite numbers" in refusal(tmp_path / "pack.npz", capsys)


def test_a_log_alone_says_what_it_holds(damaged: Path, capsys: pytest.CaptureFixture[str]) -> None:
    said = refusal(damaged / TX3, capsys)
    assert "expected the folder of a run" in said
    assert "a log of 600 records, host-stamped layout; antenna A in 600, B in 600, C in 600" in said
    assert f"senders {MACS['rx']} of 600" in said
    (damaged / TX3).write_bytes((damaged / TX3).read_bytes()[:-1])
    assert "at byte" in refusal(damaged / TX3, capsys)


def test_no_such_path_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert "no such file or folder" in refusal(tmp_path / "nowhere", capsys)
