"""Survey, motion capture and addresses of a run: what is no such text is refused in one line."""

import json
from pathlib import Path

import numpy as np
import pytest
from support.synthetic_run import TRAJECTORY, TRUTH, refusal

from wifipgo.radio.recordings.wsr_dataset import MACS, read_links


@pytest.mark.parametrize("key", ["channel", "true_rx_position"])
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


def test_any_editor_may_have_saved_the_texts(synthetic_run: Path, damaged: Path) -> None:
    """A byte order mark, Windows ends and a form feed: the same links, to the bit."""
    (damaged / "macs.json").write_text(json.dumps({"tx3": MACS["tx3"]}), "utf-8")
    for name in (TRUTH, TRAJECTORY, "macs.json"):
        text = (damaged / name).read_text("utf-8").replace("\n", "\r\n")
        (damaged / name).write_bytes(b"\xef\xbb\xbf" + text.encode() + b"\f\r\n")
    for marked, plain in zip(read_links(damaged), read_links(synthetic_run), strict=True):
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
