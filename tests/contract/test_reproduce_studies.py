"""Studies beside the paper's figures: a table, a picture and a page each, and no part of all."""

from pathlib import Path

import pandas as pd
import pytest

from baselines.reproduce import _levers, _rungs, fig_radio, sensitivity
from baselines.reproduce.__main__ import main
from baselines.reproduce._figures import FIGURES, STUDIES, chosen
from baselines.reproduce._runs import Run, Setting, changed
from wifipgo.errors import BadInputError

SHORT = changed("paper-hw-2", n_steps=4, size_m=4.0, err_threshold=2.0)


def short_levers() -> list[_levers.Lever]:
    """As many changes as there are words for the default and the three, in episodes that are soon over."""
    sigmas = enumerate([_levers.DEFAULT, *_levers.THREE])
    return [
        _levers.Lever(label, Run(SHORT, f"noisy_bearing:sigma_deg={k}"), Run(SHORT, "random"))
        for k, label in sigmas
    ]


def test_sensitivity_ranks_and_has_a_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_levers, "levers", short_levers)
    monkeypatch.setattr(sensitivity, "levers", short_levers)
    out, docs = tmp_path / "out", tmp_path / "docs"
    command = ["sensitivity", "--trials", "3", "--roots", "1", "--executor", "serial", "--out", str(out)]
    assert main([*command, "--docs", str(docs)]) == 0
    found = pd.read_parquet(out / "sensitivity" / "sensitivity.parquet")
    assert found.change[0] == _levers.DEFAULT
    assert set(found.change[1:]) == set(_levers.THREE)
    assert found.moves[1:].is_monotonic_decreasing
    assert (found.worlds == 3).all()
    assert {path.name for path in docs.rglob("*.*")} == {"sensitivity.md", "sensitivity.png"}  # no claims
    page = (docs / "sensitivity.md").read_text()
    assert "(pictures/sensitivity.png)" in page
    assert "root 0, 3 worlds each" in page
    assert page == (out / "sensitivity" / "sensitivity.md").read_text().replace(
        "(sensitivity.png)", "(pictures/sensitivity.png)"
    )


def test_every_change_is_one_of_something_else(tmp_path: Path) -> None:
    """No two changes are the same runs, and none but the first is the default's."""
    found = _levers.levers()
    pairs = [(lever.active.key, lever.random.key) for lever in found]
    assert len(set(pairs)) == len({lever.label for lever in found}) == len(found)
    n_tasks = len(_levers.tasks(Setting(trials=1, seed=0, cache=tmp_path)))
    assert n_tasks == len({key for pair in pairs for key in pair})


def test_all_is_the_papers_figures() -> None:
    assert chosen(("all",)) == list(FIGURES)
    assert chosen(("sensitivity", "fig7")) == ["fig7", "sensitivity"]
    assert not STUDIES.keys() & FIGURES.keys()


def test_studies_do_not_take_changed_assumptions(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["sensitivity", "--set", "kappa=6", "--out", str(tmp_path / "out")]) == 2
    assert "--set and --sweep must be for the paper's figures: fig2" in capsys.readouterr().err
    with pytest.raises(BadInputError, match="sensitivity"):
        chosen(("fig3",))


def test_rungs_are_compared_and_have_a_page(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two radios, of which the second adds an error to directions; who follows none plays the same."""
    rungs = (_rungs.Rung("path loss", SHORT), _rungs.Rung("+ real bearings", SHORT, "noisy_bearing", 30.0))
    monkeypatch.setattr(fig_radio, "RUNGS", rungs)
    for module in (_rungs, fig_radio):
        monkeypatch.setattr(
            module, "POLICIES", {name: _rungs.POLICIES[name] for name in ("active", "random")}
        )
    out, docs = tmp_path / "out", tmp_path / "docs"
    command = ["fig-radio", "--trials", "3", "--roots", "1", "--executor", "serial", "--out", str(out)]
    assert main([*command, "--docs", str(docs)]) == 0
    found = pd.read_parquet(out / "fig_radio" / "fig_radio.parquet").set_index(["radio", "policy"])
    assert len(list((out / "episodes").iterdir())) == 3 * 3
    exact, worse = found.xs("active", level="policy").median_deg
    assert exact < 1.0
    assert 8.0 < worse < 40.0  # 20 deg of a normal with sigma of 30
    assert (found.xs("random", level="policy").ratio == 1.0).all()
    assert found.xs("random", level="policy").err.nunique() == 1
    assert {path.name for path in docs.rglob("*.*")} == {"fig_radio.md", "fig_radio.png"}
    assert "| + real bearings |" in (docs / "fig_radio.md").read_text()
