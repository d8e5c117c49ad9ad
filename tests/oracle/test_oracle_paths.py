"""The comparison with a ray tracer finds nothing wrong where nothing is, and what is wrong where it is."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.data_dir import data_dir

from benchmarks.oracle_paths import OracleConfig, main
from benchmarks.reference_files import read_references
from benchmarks.reference_paths import compare
from wifipgo.command.command_line import exit_code


def fixture(name: str = "room_6x5_4_metal_boxes", folder: str = "sionna") -> dict[str, Any]:
    """One file of the reference data."""
    content: dict[str, Any] = json.loads((data_dir(folder) / f"{name}.json").read_text("utf-8"))
    return content


def written(folder: Path, content: object) -> Path:
    path = folder / "fixture.json"
    path.write_text(content if isinstance(content, str) else json.dumps(content), "utf-8")
    return path


def ended(config: OracleConfig) -> int:
    """Exit code."""
    return exit_code(lambda: main(config))


def test_every_fixture_is_reached(tmp_path: Path) -> None:
    """All paths of order 0 to 2, one to one, within the tolerances; JSON and picture are written."""
    out = tmp_path / "deep" / "out.json"
    assert ended(OracleConfig(data=data_dir("sionna"), json=out)) == 0
    report = json.loads(out.read_text("utf-8"))
    assert all(row["reached"] for row in report["files"].values())
    assert report["total"]["known_by_order"] == report["total"]["ours_by_order"]
    assert report["total"]["missed"] == report["total"]["extra"] == 0
    assert sorted(path.name for path in out.parent.iterdir()) == ["out.json", "out.png"]


def test_diffractions_are_reached_in_rooms_and_at_wedges(tmp_path: Path) -> None:
    out = tmp_path / "out.json"
    assert ended(OracleConfig(data=data_dir("sionna_diffraction"), json=out)) == 0
    report = json.loads(out.read_text("utf-8"))["files"]
    assert all(row["reached"] for row in report.values())
    assert report["room_10x8_3_metal_boxes"]["known_by_order"][3] == 75
    assert report["wedge_5ghz"]["known_by_order"][3] == 4 * 61
    for row in report.values():
        assert row["known_by_order"] == row["ours_by_order"]
        assert row["max_abs"]["gain_db"] < 0.05
        assert row["max_abs"]["phase_deg"] < 0.3
        assert row["max_total_of_free_space"] < 1e-3


def test_a_wedge_that_is_turned_and_moved_is_the_same_wedge(tmp_path: Path) -> None:
    """So nothing hangs on where the edge is, or on which face comes first."""
    content = fixture("wedge_5ghz", "sionna_diffraction")
    content["wedge"]["edge_m"] = [7.0, -3.0]
    for case in content["cases"]:
        case["tx_m"] = turned(case["tx_m"], moved=True)
        for name in ("face_0", "face_n"):
            case[name] = {key: turned(way, moved=False) for key, way in case[name].items()}
        for position in case["positions"]:
            position["rx_m"] = turned(position["rx_m"], moved=True)
    found = compare(read_references(written(tmp_path, content)))
    assert found.missed == found.extra == 0
    assert np.abs(found.deviations[:, 3]).max() < 0.05


def turned(at_m: list[float], *, moved: bool) -> list[float]:
    """By 30 degrees about the origin, and then on to another place."""
    there = complex(*at_m) * np.exp(1j * np.pi / 6.0) + (7.0 - 3.0j) * moved
    return [there.real, there.imag]


def test_comparison_counts_what_is_missing_and_what_is_wrong(tmp_path: Path) -> None:
    """One known path left out is one extra of ours; one moved by 0.02 ns and 3 dB is matched and shows."""
    content = fixture()
    del content["pairs"][0]["paths"][0]
    moved = content["pairs"][1]["paths"][0]
    moved["delay_s"] += 2e-11
    moved["gain_re"], moved["gain_im"] = moved["gain_re"] * 0.5, moved["gain_im"] * 0.5
    content["pairs"][2]["paths"].append(content["pairs"][2]["paths"][0] | {"azimuth_rx_rad": 0.1234})
    found = compare(read_references(written(tmp_path, content)))
    assert (found.matched, found.missed, found.extra) == (162, 1, 1)
    assert np.abs(found.deviations[:, 2]).max() == pytest.approx(0.02, abs=1e-4)
    assert np.abs(found.deviations[:, 3]).max() == pytest.approx(20.0 * np.log10(2.0), abs=1e-2)


def test_materials_are_those_of_the_file(tmp_path: Path) -> None:
    """A material by another name is known by its constants."""
    content = fixture("room_20x20_4_mixed_boxes")
    text = json.dumps(content).replace('"concrete"', '"panel of our own"')
    found = compare(read_references(written(tmp_path, text)))
    assert (found.missed, found.extra) == (0, 0)
    assert np.abs(found.deviations[:, 3]).max() < 0.05


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("{", "Expecting property name"),
        ([1, 2], "list indices"),
        ({}, "'format' is missing"),
        ({"format": "wifi-paths-3d/1"}, "unknown format 'wifi-paths-3d/1'; known: wifi-paths-2d/1"),
        ({"format": "wifi-paths-2d/1", "room": {}}, "'walls' is missing"),
    ],
)
def test_malformed_file_is_one_line_with_its_name(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], change: object, message: str
) -> None:
    written(tmp_path, change)
    assert ended(OracleConfig(data=tmp_path)) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "fixture.json:" in said
    assert message in said


@pytest.mark.parametrize(
    ("keys", "value", "message"),
    [
        (("boxes", 0, "material"), "cheese", "unknown material 'cheese'"),
        (("boxes", 0, "thickness_m"), -1.0, "thickness_m must be in 1e-06..10"),
        (("pairs", 0, "tx_m"), [float("nan"), 1.0], "tx_m must be finite"),
        (("pairs", 0, "tx_m"), [99.0, 1.0], "tx_m must be inside the room"),
        (("pairs", 0, "paths", 0, "delay_s"), float("nan"), "must be finite"),
        (("pairs", 0, "paths", 0, "gain_re"), float("inf"), "gain must be finite"),
        (("pairs", 0, "paths", 0, "order"), -1, "order must be 0, 1 or 2"),
        (("carrier_hz",), 0.0, "carrier_hz must be in 1000..1e+15"),
        (("carrier_hz",), None, "float"),
        (("pairs",), 3, "not iterable"),
    ],
)
def test_impossible_values_are_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], keys: tuple[Any, ...], value: object, message: str
) -> None:
    content = fixture()
    place: Any = content
    for key in keys[:-1]:
        place = place[key]
    place[keys[-1]] = value
    written(tmp_path, content)
    assert ended(OracleConfig(data=tmp_path)) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "fixture.json:" in said
    assert message in said


def test_missing_and_empty_folders_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert ended(OracleConfig(data=tmp_path / "nowhere")) == 2
    assert "nowhere is no folder" in capsys.readouterr().err
    assert ended(OracleConfig(data=tmp_path)) == 2
    assert "holds no fixture" in capsys.readouterr().err
