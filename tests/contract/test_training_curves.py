"""Trainings side by side: seeds of one recipe are pooled where all of them are, and nothing else is mixed."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from support.short_training import small

pytest.importorskip("stable_baselines3")

from train._checkpoints import read_state
from train._config import SelectionConfig, TrainConfig
from train._config_files import record_of
from train._curve_scores import curves_of
from train._curves_picture import drawn
from train._yaml import written
from train.curves import lines_of, main, scores_at_the_end
from train.training import Run, train

PLAYED = ("paper-sim-2", "paper-hw-2")
JUDGED = SelectionConfig(scenarios=PLAYED, trials=3, seed=70_000)


def run_of(folder: Path, ends: int, first: float, judged: SelectionConfig = JUDGED) -> Path:
    """A run that is 0.1 better in the second scenario, and by 0.01 every thousand agent-steps."""
    folder.mkdir()
    (folder / "config.yaml").write_text(written(record_of(TrainConfig(selection=judged))))
    each = np.repeat([0.0, 0.1], 3)
    rows = [("rule", 0, 0.3 + each), *(("learned", k, first + k / 1e5 + each) for k in range(0, ends, 1_000))]
    tables = [
        pd.DataFrame(
            {"agent_steps": at, "policy": who, "trial": range(6), "seed": range(6), "mapped_share": s}
        )
        for who, at, s in rows
    ]
    pd.concat(tables).to_parquet(folder / "curve.parquet", index=False)
    return folder


def test_seeds_are_pooled_where_all_of_them_are(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    long, short = run_of(tmp_path / "a", 3_000, 0.5), run_of(tmp_path / "b", 2_000, 0.6)
    curves, scenarios = curves_of([f"mine={long}+{short}"])
    assert scenarios == PLAYED
    scores = scores_at_the_end(curves)
    assert list(scores) == ["mine, 1,000", "rule"]
    np.testing.assert_allclose(scores["mine, 1,000"], [[0.51, 0.61], [0.61, 0.71]])
    assert scores["rule"].to_numpy().tolist() == [pytest.approx([0.3, 0.4])]
    lines = lines_of(scores, scenarios)
    assert [line[1:3] for line in lines[1:]] == [["2", "61.0 [56.0, 66.0]"], ["1", "35.0"]]
    files = ["--out", str(tmp_path / "curves.png"), "--table", str(tmp_path / "table.md")]
    assert main([f"mine={long}+{short}", *files]) == 0
    assert (tmp_path / "table.md").read_text().splitlines()[-1] == "| rule | 1 | 35.0 | 30.0 | 40.0 |"
    assert (tmp_path / "curves.png").read_bytes().startswith(b"\x89PNG")
    assert "paper-hw-2" in capsys.readouterr().out


def test_scores_that_are_kept_stand_for_their_runs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    long, short = run_of(tmp_path / "a", 3_000, 0.5), run_of(tmp_path / "b", 2_000, 0.6)
    kept = tmp_path / "kept.parquet"
    assert main([f"mine={long}+{short}", "--scores", str(kept)]) == 0
    before, _ = curves_of([f"mine={long}+{short}", f"later={short}"])
    again, scenarios = curves_of([str(kept), f"later={short}"])
    pd.testing.assert_frame_equal(again[before.columns], before)
    assert scenarios == PLAYED
    elsewhere = run_of(tmp_path / "c", 2_000, 0.5, replace(JUDGED, seed=1))
    assert main([str(kept), f"other={elsewhere}"]) == 2
    assert "must be of the worlds of the first run, (trials, seed) (3, 70000)" in capsys.readouterr().err
    changed = run_of(tmp_path / "d", 2_000, 0.5, replace(JUDGED, trials=2))
    assert main([f"changed={changed}"]) == 2
    assert "number of trials must be <= 4, as its config.yaml says, got 6" in capsys.readouterr().err
    assert main([str(long / "curve.parquet")]) == 2
    assert "curve.parquet must be a table with the columns recipe, run" in capsys.readouterr().err
    (tmp_path / "none.parquet").write_text("no table")
    assert main([str(tmp_path / "none.parquet")]) == 2
    assert "none.parquet cannot be read, it is no .parquet" in capsys.readouterr().err


def test_what_cannot_be_compared_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    mine = run_of(tmp_path / "a", 2_000, 0.5)
    other = run_of(tmp_path / "b", 2_000, 0.5, replace(JUDGED, seed=70_001))
    assert main([f"mine={mine}", f"other={other}"]) == 2
    assert "must be of the worlds of the first run" in capsys.readouterr().err
    apart = run_of(tmp_path / "c", 2_000, 0.5, replace(JUDGED, scenarios=("paper-sim-50", "radio-hard")))
    assert main([f"mine={mine}", f"apart={apart}"]) == 2
    assert "judged on scenarios in common" in capsys.readouterr().err
    with pytest.raises(SystemExit, match="2"):
        main(["mine"])
    assert "runs must be NAME=FOLDER" in capsys.readouterr().err


def test_scenarios_count_that_all_were_judged_on(tmp_path: Path) -> None:
    """Each by its own place in the order of its run."""
    mine = run_of(tmp_path / "a", 2_000, 0.5)
    other = run_of(tmp_path / "b", 2_000, 0.2, replace(JUDGED, scenarios=("radio-hard", "paper-sim-2")))
    curves, scenarios = curves_of([f"mine={mine}", f"other={other}"])
    assert scenarios == ("paper-sim-2",)
    scores = scores_at_the_end(curves)
    assert [frame.to_numpy().item() for frame in scores.values()] == pytest.approx([0.51, 0.31, 0.3])


def test_a_run_goes_on_where_the_one_it_began_with_was(tmp_path: Path, done: Run) -> None:
    later = small(tmp_path / "later", start=str(done.config.out))
    train(later)
    curves, _ = curves_of([f"first={done.config.out}", f"later={later.out}"])
    ends = curves[curves["policy"] == "learned"].groupby("recipe")["agent_steps"].max()
    best = read_state(done.checkpoints.path("best"))
    assert ends["later"] == best.agent_steps + best.imitated + 160


def test_no_two_recipes_look_alike(tmp_path: Path) -> None:
    """More of them than there are colours; in the large picture, a thick line each."""
    run = run_of(tmp_path / "a", 3_000, 0.5)
    curves, scenarios = curves_of([f"recipe {k}={run}" for k in range(14)])
    lines = [line for line in drawn(curves, scenarios).subfigs[0].axes[0].lines if line.get_linewidth() == 2]
    looks = {(str(line.get_color()), str(line.get_linestyle())) for line in lines}
    assert len(looks) == len(lines) == 14
