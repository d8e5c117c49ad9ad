"""Bearings in rooms: the table is written, and opaque boxes make them worse as edges make them better."""

import json
from pathlib import Path

import numpy as np
import pytest

from benchmarks import bearing_errors
from benchmarks.bearing_errors import RADIOS, ROOM, errors
from wifipgo.scenarios import scenario_named


def test_behind_metal_bearings_are_worse_than_behind_wood_and_edges_help() -> None:
    """In the same rooms: which links are in sight is the same, and no fewer of the others are heard."""
    wood, metal, edges = (
        errors(scenario_named("paper-hw-2", **{**ROOM, **RADIOS[name]}), 4)
        for name in (
            "wooden boxes, two reflections",
            "metal boxes, two reflections",
            "metal boxes, and edges",
        )
    )
    np.testing.assert_array_equal(wood.in_sight, metal.in_sight)
    beyond = [found.figures(in_sight=False) for found in (wood, metal, edges)]
    assert beyond[0]["gross"] + 0.3 < beyond[1]["gross"]
    assert beyond[1]["heard"] <= beyond[2]["heard"]
    assert beyond[2]["gross"] < beyond[1]["gross"]


def test_every_radio_has_a_row(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bearing_errors, "RADIOS", dict(list(RADIOS.items())[-2:]))
    out = tmp_path / "errors.json"
    bearing_errors.main(bearing_errors.ErrorsConfig(rooms=1, json=out))
    report = json.loads(out.read_text("utf-8"))
    assert list(report) == list(RADIOS)[-2:]
    assert all(row["in_sight"]["links"] + row["beyond_sight"]["links"] == 132 for row in report.values())
