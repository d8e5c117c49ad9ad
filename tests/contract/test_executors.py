"""Executors: the same results wherever work is done, and a process that dies takes nothing with it."""

import importlib
import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest
from support.dying import Errand, compute, keep

from baselines.evaluate import EvaluateConfig, evaluate, main
from baselines.evaluation.executors import EXECUTORS, Executor, Work, WorkerDiedError
from wifipgo.errors import MissingExtraError

ROOT = Path(__file__).parents[2]
WORK = Work(compute, keep)


def found(folder: Path) -> dict[str, str]:
    return {path.name: path.read_text() for path in folder.iterdir() if path.name.lstrip("-").isdigit()}


def carried_out(folder: Path, executor: Executor, **deaths: int) -> dict[int, BaseException | None]:
    items = [Errand(folder, n, deaths.get(f"of_{n}", 0)) for n in range(5)]
    return {item.number: problem for item, problem in executor.outcomes(WORK, items)}


@pytest.mark.parametrize("name", ["serial", "process"])
def test_everything_is_done_once(name: str, tmp_path: Path) -> None:
    outcomes = carried_out(tmp_path, Executor(name=name, jobs=2))
    assert outcomes == dict.fromkeys(range(5))
    assert found(tmp_path) == {str(n): str(n**2) for n in range(5)}


@pytest.mark.parametrize("name", ["serial", "process"])
def test_what_raises_is_reported_and_stops_no_other(name: str, tmp_path: Path) -> None:
    items = [Errand(tmp_path, n, 0) for n in (-1, 2, 3)]
    outcomes = {item.number: problem for item, problem in Executor(name=name, jobs=2).outcomes(WORK, items)}
    assert isinstance(outcomes.pop(-1), ValueError)
    assert outcomes == {2: None, 3: None}


def test_a_process_that_dies_once_is_not_noticed(tmp_path: Path) -> None:
    outcomes = carried_out(tmp_path, Executor(jobs=2), of_1=1)
    assert outcomes == dict.fromkeys(range(5))
    assert found(tmp_path) == {str(n): str(n**2) for n in range(5)}
    assert (tmp_path / "died-1-0").exists()


def test_one_that_dies_again_is_reported_and_the_rest_kept(tmp_path: Path) -> None:
    outcomes = carried_out(tmp_path, Executor(jobs=2), of_1=9, of_4=9)
    assert {n for n, problem in outcomes.items() if isinstance(problem, WorkerDiedError)} == {1, 4}
    assert found(tmp_path) == {str(n): str(n**2) for n in (0, 2, 3)}
    assert len(list(tmp_path.glob("died-1-*"))) == 2  # tried twice, not more


def test_nothing_to_do_starts_nothing(tmp_path: Path) -> None:
    assert not list(Executor(jobs=2).outcomes(WORK, []))


@pytest.mark.usefixtures("spawned")
def test_serial_and_process_find_the_same(tmp_path: Path) -> None:
    for name in ("serial", "process"):
        config = EvaluateConfig(
            trials=2, overrides=("n_steps=3",), jobs=2, executor=name, out=tmp_path / name
        )
        evaluate(config)
    one, other = (pd.read_parquet(tmp_path / name / "steps.parquet") for name in ("serial", "process"))
    pd.testing.assert_frame_equal(one, other)


def test_ray_finds_the_same(tmp_path: Path) -> None:
    """In a process of its own: Ray leaves threads and warnings behind."""
    if importlib.util.find_spec("ray") is None:
        pytest.skip("Ray is not installed (extra 'ray')")
    evaluate(EvaluateConfig(trials=2, overrides=("n_steps=3",), executor="serial", out=tmp_path / "serial"))
    options = ["--trials", "2", "--set", "n_steps=3", "--jobs", "1", "--executor", "ray"]
    command = [sys.executable, "-m", "baselines.evaluate", *options, "--out", str(tmp_path / "ray")]
    paths = {"PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        command, cwd=tmp_path, capture_output=True, text=True, check=False, env=os.environ | paths
    )
    assert done.returncode == 0, done.stderr
    one, other = (pd.read_parquet(tmp_path / name / "steps.parquet") for name in ("serial", "ray"))
    pd.testing.assert_frame_equal(one, other)


def test_absent_ray_names_the_extra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def absent(name: str) -> None:
        raise ImportError(name)

    monkeypatch.setattr(importlib, "import_module", absent)
    with pytest.raises(MissingExtraError, match="extra 'ray'"):
        Executor(name="ray")
    assert main(["--executor", "ray", "--out", str(tmp_path / "out")]) == 2
    assert "install the extra 'ray'" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_help_names_every_executor(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["--help"])
    printed = capsys.readouterr().out
    assert all(name in printed for name in EXECUTORS)
