"""What the reproduction refuses, and what its figures are made of."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from support.data_dir import data_dir

from baselines.reproduce import _figures, _recordings
from baselines.reproduce.__main__ import main
from baselines.reproduce._figures import FIGURES, STUDIES
from baselines.reproduce._outlier_trials import METHODS, OutlierTrial
from baselines.reproduce._runs import Run, changed


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["figure7"], f"unknown figure 'figure7'; known: {', '.join(sorted(['all', *FIGURES, *STUDIES]))}"),
        (["fig6"], "got 'fig6'. Figures 1, 3, 4 and 6 of the paper are not redone: they show the idea (1)"),
        (["fig7", "--sweep", "kappa=2,3,2"], "--sweep kappa must be values that differ, got 'kappa=2,3,2'"),
        (["fig7", "--sweep", "err_threshold=5,5.0"], "--sweep err_threshold must be values that differ"),
        (["fig7", "--sweep", "err_threshold=5,nan"], "err_threshold must be of type float, got 'nan'"),
        (["fig2", "--trials", "0"], "trials must be >= 1, got 0"),
        (["fig2", "--trials", "-3"], "trials must be >= 1, got -3"),
        (["fig2", "--seed", "-1"], "seed must be >= 0"),
        (["fig2", "--roots", "0"], "roots must be in 1..10000, got 0"),
        (["fig2", "--jobs", "-1"], "jobs must be >= 0"),
        (["fig2", "--executor", "slurm"], "unknown executor 'slurm'"),
        (["fig7", "--set", "kappa"], "a setting must be KEY=VALUE, got 'kappa'"),
        (["fig7", "--set", "err_treshold=5"], "unknown scenario field 'err_treshold'; known: "),
        (["all", "--sweep", "err_treshold=5,10"], "unknown scenario field 'err_treshold'; known: "),
        (["fig7", "--sweep", "err_threshold=low,10"], "err_threshold must be of type float, got 'low'"),
        (["fig7", "--sweep", "err_threshold=10,-1"], "RendezvousConfig.err_threshold must be in 1e-09.."),
        (["fig7", "--sweep", "err_threshold=5"], "--sweep err_threshold must be FIELD=A,B,...: two values"),
        (
            ["fig7", "--sweep", "kappa=1,2", "--set", "kappa=3"],
            "--sweep kappa must be a field that --set leaves",
        ),
        (
            ["fig2", "--set", "kappa=2"],
            "--set and --sweep must be for a figure that plays episodes: fig5, fig7",
        ),
        (["fig2", "--resume", "--overwrite"], "--resume and --overwrite must be one of them at most"),
    ],
)
def test_what_cannot_run_is_refused_in_a_line(
    arguments: Sequence[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*arguments, "--out", str(tmp_path / "out")]) == 2
    printed = capsys.readouterr()
    assert message in printed.err
    assert printed.err.count("\n") == 1
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", _figures.FIGURES)
def test_a_figure_has_what_a_run_asks_of_it(name: str) -> None:
    figure = _figures.FIGURES[name]
    assert figure.TITLE
    assert figure.TRIALS >= 1
    assert all(sentence.name.startswith(name.partition("_")[0]) for sentence in figure.SENTENCES)
    assert all(callable(getattr(figure, of)) for of in ("tasks", "make", "claims"))


def test_recordings_are_judged_where_they_are(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("WIFIPGO_DATA", str(data_dir("wsr").parent))
    links = _recordings.recorded()
    assert len(links) == 30
    assert np.abs(_recordings.recorded_errors(links[:1]).azimuth_error_deg).max() < 20.0


def test_a_trial_with_outliers_solves_one_graph_by_every_method(tmp_path: Path) -> None:
    trial = OutlierTrial(changed("paper-outliers"), 0, 3, tmp_path / "trial.npz")
    trial.keep(trial.compute())
    found = trial.load()
    assert found["errors"].shape == (len(METHODS),)
    assert np.isfinite(found["errors"]).all()
    assert 9 <= len(found["off_rad"]) <= 10
    assert 0 < found["is_outlier"].sum() < len(found["off_rad"])
    np.testing.assert_array_equal(found["errors"], trial.compute()["errors"])
    calm = OutlierTrial(changed("paper-outliers", outlier_share=0.0), 0, 3, tmp_path / "calm.npz")
    assert not calm.compute()["is_outlier"].any()


def test_runs_of_one_key_are_those_with_one_result() -> None:
    dark, light = Run(changed("paper-hw-2-dark"), "random"), Run(changed("paper-hw-2"), "random")
    assert dark.key != light.key
    assert Run(changed("paper-hw-2", visual_range_m=0.0), "random").key == dark.key
    assert Run(changed("paper-hw-2"), "active").key != light.key
