"""The benchmark of multi-robot graphs keeps its figures and its manners."""

import json
import shutil
from pathlib import Path

import pytest
from support.data_dir import data_dir
from support.graphs import random_graph

from benchmarks.multi_robot_g2o import G2oConfig, main
from wifipgo.command.command_line import exit_code
from wifipgo.graph.files.g2o import write_g2o


def ended(config: G2oConfig) -> int:
    """Exit code."""
    return exit_code(lambda: main(config))


def test_figures_on_the_published_sets(tmp_path: Path) -> None:
    """Optima within 0.1 %, gaps within 1.7 and 0.6 %, rounds within 1.5 times the reference."""
    source = data_dir("g2o")
    for name in ("example_4robots", "example_16robots"):
        shutil.copytree(source / name, tmp_path / "data" / name)
    out = tmp_path / "figures" / "g2o.json"
    assert ended(G2oConfig(data=tmp_path / "data", json=out, repeats=1)) == 0
    known = json.loads((source / "reference.json").read_text())["datasets"]
    for name, found in json.loads(out.read_text())["datasets"].items():
        for figure in ("chordal_optimum", "gtsam_lm_error", "chordal_cost_two_stage_centralised"):
            assert found[figure] == pytest.approx(known[name][figure], rel=1e-3)
        for threshold, gap in (("0.1", 0.017), ("0.01", 0.006)):
            reference = known[name]["distributed"][threshold]
            allowed = 1.5 * (reference["rounds_rotation"] + reference["rounds_pose"])
            for method in ("distributed", "distributed_two_stage"):
                reached = found[method][threshold]
                assert reached["converged"]
                assert -1e-6 <= reached["gap_to_chordal_optimum"] <= gap
                assert reached["rounds"] <= allowed


def test_sets_without_reference_and_nothing_at_all(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert ended(G2oConfig(data=tmp_path)) == 2
    assert "a folder with folders of g2o files" in capsys.readouterr().err
    write_g2o(tmp_path / "mine", random_graph(0)[1])
    assert ended(G2oConfig(data=tmp_path, repeats=1)) == 0
    (tmp_path / "mine" / "0.g2o").write_text("nonsense")
    assert ended(G2oConfig(data=tmp_path, repeats=1)) == 2
    assert "0.g2o:1: expected one of" in capsys.readouterr().err
