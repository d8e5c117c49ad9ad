"""Trials of an evaluation may be played by several jobs: joined, they are the bytes of one run."""

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from baselines.evaluate import EvaluateConfig, evaluate
from baselines.evaluation import jobs, run_folder
from baselines.evaluation.episodes import Episode, run_episodes
from baselines.merge import main
from wifipgo.files.results_folder import partial_of

NAMES_IT = {"config.json", "manifest.jsonl"}  # files that say where they are
TABLES = ("episodes.parquet", "steps.parquet", "summary.json")


def settings(out: Path, first: int, trials: int, *changes: str) -> EvaluateConfig:
    overrides = ("n_steps=3", *changes)
    return EvaluateConfig(trials=trials, trials_from=first, overrides=overrides, executor="serial", out=out)


def played(out: Path, first: int, trials: int, *changes: str) -> Path:
    evaluate(settings(out, first, trials, *changes))
    return out


@pytest.fixture(scope="module")
def parts(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    root = tmp_path_factory.mktemp("parts")
    return [played(root / f"from-{first}", first, trials) for first, trials in ((2, 1), (0, 2))]


def test_parts_joined_are_one_run(parts: list[Path], tmp_path: Path) -> None:
    whole = played(tmp_path / "whole", 0, 3)
    assert main([str(tmp_path / "joined"), *map(str, parts)]) == 0
    for name in (*TABLES, *run_folder.PICTURES):
        assert (whole / name).read_bytes() == (tmp_path / "joined" / name).read_bytes()
    assert {path.name for path in whole.iterdir()} == {path.name for path in (tmp_path / "joined").iterdir()}


def test_what_does_not_fit_is_refused(
    parts: list[Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    late, early = parts
    other, far = played(tmp_path / "other", 3, 1, "sigma_t_m=0.3"), played(tmp_path / "far", 4, 1)
    for given, told in (
        ((early, early), "trials must be in one part only"),
        ((late, far), "trials must be without a gap"),
        ((late, other), "got scenario.sensing.sigma_t_m"),
        ((tmp_path,), "in must be a folder of finished results"),
    ):
        assert main([str(tmp_path / "out"), *map(str, given)]) == 2
        assert told in capsys.readouterr().err
        assert not (tmp_path / "out").exists()


def test_an_interrupted_run_goes_on_with_more_trials(
    parts: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(run_folder, "write_tables", interrupt)
        with pytest.raises(KeyboardInterrupt):
            played(tmp_path / "out", 0, 1)
    evaluate(replace(settings(tmp_path / "out", 0, 2), resume=True))
    for name in TABLES:
        assert (tmp_path / "out" / name).read_bytes() == (parts[1] / name).read_bytes()


def test_a_finished_run_goes_on_with_more_trials(
    parts: list[Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out, trials, run = shutil.copytree(parts[1], tmp_path / "out"), [], run_episodes

    def seen(*args: Any, **kwargs: Any) -> list[Episode]:
        trials.extend(kwargs["trials"])
        if 3 in kwargs["trials"]:
            raise KeyboardInterrupt
        return run(*args, **kwargs)

    monkeypatch.setattr(jobs, "run_episodes", seen)
    evaluate(replace(settings(out, 0, 3), resume=True))
    assert trials == [2, 2]
    whole = played(tmp_path / "whole", 0, 3)
    names = [path.name for path in whole.iterdir() if path.is_file() and path.name not in NAMES_IT]
    assert {*TABLES, *run_folder.PICTURES} == set(names)
    assert all((whole / name).read_bytes() == (out / name).read_bytes() for name in names)
    with pytest.raises(KeyboardInterrupt):
        evaluate(replace(settings(out, 0, 4), resume=True))
    trials.clear()
    evaluate(replace(settings(out, 0, 3), resume=True))  # what is there is shown again
    with pytest.raises(ValueError, match=r"differs in trials \(3 there, 2 now\)"):
        evaluate(replace(settings(out, 0, 2), resume=True))
    assert trials == []
    monkeypatch.setattr(jobs, "run_episodes", run)
    evaluate(replace(settings(out, 0, 4), resume=True))
    assert not partial_of(out).exists()
    assert len(pd.read_parquet(out / "episodes.parquet")) == 8
