"""Trials of an evaluation may be played by several jobs: joined, they are the bytes of one run."""

from dataclasses import replace
from pathlib import Path

import pytest

from baselines.evaluate import EvaluateConfig, evaluate
from baselines.evaluation import run_folder
from baselines.merge import main

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
    for name in TABLES:
        assert (whole / name).read_bytes() == (tmp_path / "joined" / name).read_bytes()


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
