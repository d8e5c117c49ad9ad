"""Packs hold the links of their run; damaged ones are refused in one line."""

import json
from pathlib import Path

import numpy as np
import pytest
from support.synthetic_run import STAMP, refusal

from wifipgo.radio.recordings.recorded_link import bearing
from wifipgo.radio.recordings.wsr_dataset import read_links


def pack_of(synthetic_run: Path) -> dict[str, np.ndarray]:
    """The arrays of a pack with the first link of a run."""
    link = read_links(synthetic_run)[0]
    about = {"set": "S", "loc": 1, "stamp": STAMP, "tx": "tx2", "bearing_mean": np.rad2deg(link.truth_rad)}
    parts = [np.stack([h.real, h.imag], axis=-1).astype(np.int8) for h in (link.forward, link.reverse)]
    return {"f0": parts[0], "r0": parts[1], "p0": link.displacement_m, "meta": np.array(json.dumps([about]))}


def test_a_pack_gives_the_links_of_its_run(synthetic_run: Path, tmp_path: Path) -> None:
    np.savez(tmp_path / "pack.npz", **pack_of(synthetic_run))  # type: ignore[arg-type]
    (packed,), raw = read_links(tmp_path), read_links(synthetic_run)[0]
    np.testing.assert_array_equal(packed.forward, raw.forward)
    np.testing.assert_array_equal(packed.reverse, raw.reverse)
    assert packed.truth_rad == pytest.approx(raw.truth_rad)
    assert bearing(packed).azimuth_rad == bearing(raw).azimuth_rad


@pytest.mark.parametrize("key", ["meta", "f0", "r0", "p0"])
def test_a_missing_pack_key_is_named(
    key: str, synthetic_run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arrays = pack_of(synthetic_run)
    del arrays[key]
    np.savez(tmp_path / "pack.npz", **arrays)  # type: ignore[arg-type]
    assert f"pack.npz: no key {key!r}" in refusal(tmp_path / "pack.npz", capsys)


def test_a_damaged_pack_is_refused(
    synthetic_run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, arrays = tmp_path / "pack.npz", pack_of(synthetic_run)
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
    "changes", [{"bearing_mean": 1e999}, {"bearing_mean": True}, {"toolbox_azimuths": "1"}]
)
def test_a_pack_with_no_angles_is_refused(
    changes: dict[str, object], synthetic_run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arrays = pack_of(synthetic_run)
    about = json.loads(str(arrays["meta"]))[0] | changes
    np.savez(tmp_path / "pack.npz", **arrays | {"meta": np.array(json.dumps([about]))})  # type: ignore[arg-type]
    assert next(iter(changes)) in refusal(tmp_path / "pack.npz", capsys)


@pytest.mark.parametrize("name", ["f0", "p0"])
@pytest.mark.parametrize("value", [np.nan, 1e300, True, "1"])
def test_a_pack_with_no_numbers_is_refused(
    name: str, value: object, synthetic_run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arrays = pack_of(synthetic_run)
    arrays[name] = np.full(arrays[name].shape, value)
    np.savez(tmp_path / "pack.npz", **arrays)  # type: ignore[arg-type]
    assert f"pack.npz: {name} must be finite numbers" in refusal(tmp_path / "pack.npz", capsys)
