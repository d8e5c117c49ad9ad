"""The benchmark on real recordings: what it promises of any packs and runs that it is given."""

import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tyro
from support.data_dir import data_dir
from support.synthetic_run import write_run

from benchmarks import real_csi
from wifipgo.command.command_line import exit_code

ROOT = Path(__file__).resolve().parents[2]
SPOTS_M = {"tx2": (-2.4, 2.6, 0.7), "tx3": (2.5, -2.6, 0.5)}


def run(*arguments: str | Path) -> "subprocess.CompletedProcess[str]":
    command = [sys.executable, "-m", "benchmarks.real_csi", *map(str, arguments)]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)


def test_the_pack_and_its_raw_run(tmp_path: Path) -> None:
    """Links that are in both count once; figures follow from the links; targets are reached."""
    written, picture = tmp_path / "new" / "out.json", tmp_path / "out.png"
    done = run("--data", data_dir("wsr"), "--json", written, "--picture", picture)
    assert done.returncode == 0, done.stderr
    assert "mean aperture position" in done.stdout
    content: dict[str, Any] = json.loads(written.read_text("utf-8"))
    assert [path.name for path in written.parent.iterdir()] == ["out.json"]
    assert 20_000 < picture.stat().st_size < 150_000
    links = content["links"]
    assert len(links) == 30
    assert sum(link["rejected"] for link in links) == 3
    for entry in content["groups"]:
        chosen = [
            link
            for link in links
            if entry["group"] in {link["set_name"], "all"}
            and not (entry["confident_only"] and link["rejected"])
        ]
        if chosen:
            errors = [link["error_deg"] for link in chosen]
            assert entry["links"] == len(chosen)
            assert entry["top"] == pytest.approx(
                [np.median(errors), np.mean(errors), np.sqrt(np.mean(np.square(errors)))]
            )
            assert entry["top_mean_interval"][0] <= entry["top"][1] <= entry["top_mean_interval"][1]
            assert all(link["closest_error_deg"] <= link["error_deg"] + 1e-9 for link in chosen)
    assert len(content["targets"]) == 3
    assert all(target["reached"] for target in content["targets"])


def run_here(*arguments: str | Path) -> int:
    """Exit code; what it says goes to this process's streams."""
    return exit_code(lambda: tyro.cli(real_csi.main, args=[*map(str, arguments)]))


def test_runs_without_a_toolbox_and_two_links(tmp_path: Path) -> None:
    """No ratio, no interval of two links, nothing to reject: dashes, and null in the JSON."""
    write_run(tmp_path / "data" / "my_run", transmitters_m=SPOTS_M, seed=3)
    asked = ("--json", tmp_path / "out.json", "--picture", tmp_path / "p.png")
    assert run_here("--data", tmp_path / "data", *asked) == 0
    content = json.loads((tmp_path / "out.json").read_text("utf-8"))
    assert content["targets"] == []
    assert [link["toolbox_error_deg"] for link in content["links"]] == [None, None]
    assert all(link["error_deg"] < 1.0 and not link["rejected"] for link in content["links"])
    assert {entry["group"] for entry in content["groups"]} == {"my_run", "all"}


def test_bad_input_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    damaged = tmp_path / "damaged"
    damaged.mkdir()
    (damaged / "pack.npz").write_bytes(b"no pack")
    empty = tmp_path / "empty"
    empty.mkdir()
    for path, word in ((tmp_path / "nowhere", "no such"), (empty, "no .npz pack"), (damaged, "pack.npz")):
        assert run_here("--data", path, "--json", tmp_path / "out.json") == 2
        said = capsys.readouterr().err
        assert said.startswith("error: ")
        assert said.count("\n") == 1
        assert word in said
    assert not (tmp_path / "out.json").exists()
    shutil.rmtree(damaged)
