"""Raw runs: pairing, and damaged or missing files, which are refused in one line."""

import json
from pathlib import Path

import numpy as np
import pytest
from support.synthetic_run import RX, STAMP, TRAJECTORY, TRUTH, TX3, refusal

from wifipgo.radio.recordings.intel5300 import BLOCK_BYTES, STOCK, CsiLog, encode_csi_log, read_csi_log
from wifipgo.radio.recordings.wsr_dataset import MACS, pair, read_links


def test_pairs_carry_the_same_counter(synthetic_run: Path) -> None:
    """Lost packets and repeated counters: what is left still belongs together."""
    received, answered = read_csi_log(synthetic_run / RX), read_csi_log(synthetic_run / TX3)
    lost = CsiLog(answered.header[5::2], answered.csi[5::2])
    twice = CsiLog(np.append(lost.header, lost.header[:50]), np.concatenate([lost.csi, lost.csi[:50]]))
    forward, reverse = pair(received, twice, transmitter_mac="00:21:6a:30:d2:3c")
    assert len(forward) == len(lost.header)
    assert reverse.max() < len(lost.header)  # the first of a repeated counter
    np.testing.assert_array_equal(
        received.header["frame_count"][forward], twice.header["frame_count"][reverse]
    )


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


def test_an_unknown_transmitter_lists_the_known(damaged: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (damaged / TX3).rename(damaged / f"csi_tx9_{STAMP}.dat")
    text = (damaged / TRUTH).read_text("utf-8")
    (damaged / TRUTH).write_text(text.replace("tx3", "tx9"), "utf-8")
    assert "unknown transmitter 'tx9'; known: rx, tx2, tx3, tx4" in refusal(damaged, capsys)


def test_other_robots_are_named_in_a_file(synthetic_run: Path, damaged: Path) -> None:
    """The same logs under another name: the same link, once the file says whose address is whose."""
    (damaged / TX3).rename(damaged / f"csi_tx9_{STAMP}.dat")
    text = (damaged / TRUTH).read_text("utf-8")
    (damaged / TRUTH).write_text(text.replace("tx3", "tx9"), "utf-8")
    (damaged / "macs.json").write_text(json.dumps({"tx9": MACS["tx3"].upper()}), "utf-8")
    renamed, original = read_links(damaged)[-1], read_links(synthetic_run)[1]
    assert renamed.transmitter == "tx9"
    np.testing.assert_array_equal(renamed.forward, original.forward)
    assert renamed.truth_rad == original.truth_rad


def test_the_stock_layout_cannot_be_paired(damaged: Path, capsys: pytest.CaptureFixture[str]) -> None:
    log = read_csi_log(damaged / TX3)
    header = np.zeros(len(log.header), STOCK)
    for field in STOCK.names or ():
        header[field] = log.header[field]
    (damaged / TX3).write_bytes(encode_csi_log(CsiLog(header, log.csi)))
    assert "expected host-stamped records" in refusal(damaged, capsys)
