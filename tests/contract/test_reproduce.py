"""The reproduction keeps its word: figures whole or not at all, nothing run twice, claims judged."""

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from baselines.evaluation import jobs
from baselines.evaluation.batches import Batch
from baselines.evaluation.episodes import Episode, trial_seed
from baselines.evaluation.intervals import mean_of
from baselines.evaluation.jobs import EpisodesFailedError
from baselines.reproduce import (
    _assumptions,
    _changed,
    _figures,
    _folder,
    _rules,
    _run,
    fig9,
)
from baselines.reproduce.__main__ import main
from baselines.reproduce._claims import Claim, Sentence, judged, row
from baselines.reproduce._config import ReproduceConfig
from baselines.reproduce._measures import column
from baselines.reproduce._page import page
from baselines.reproduce._run import reproduce
from baselines.reproduce._runs import Run, Setting, changed, tasks_of

PNG = b"\x89PNG\r\n\x1a\n"
SHORT = changed("paper-sim-2", n_steps=3)


def small(policies: Sequence[str]) -> SimpleNamespace:
    """A figure of short episodes."""
    runs, sentence = [Run(SHORT, policy) for policy in policies], Sentence("small", "It moves.", "-")

    def claims(setting: Setting) -> list[Claim]:
        found = [
            row("short", lambda of: mean_of(column(of, "distance_m")), run.episodes(setting)) for run in runs
        ]
        return [judged(sentence, quantity="distance", rule=_rules.above(0.0), found=found)]

    def make(setting: Setting, folder: Path) -> list[Claim]:
        found = claims(setting)
        (folder / "figure.txt").write_text(str(found[0].findings[0].value))
        return found

    return SimpleNamespace(
        TITLE="small",
        TRIALS=60,
        SENTENCES=[sentence],
        tasks=lambda setting: tasks_of(runs, setting),
        make=make,
        claims=claims,
    )


@pytest.fixture
def two(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two small figures that share the episodes of one policy."""
    figures = {"figA": small(["random"]), "figB": small(["random", "active"])}
    for module in (_figures, _run, _changed, _assumptions):
        monkeypatch.setattr(module, "FIGURES", figures)


def asked(out: Path, **changes: Any) -> ReproduceConfig:
    config = ReproduceConfig(trials=2, roots=1, executor="serial", worlds=1, out=out)
    return replace(config, **changes)


def ran(whole: dict[str, Any]) -> list[str]:
    """Figures that are there; all others say that they were not run."""
    for of in whole["figures"].values():
        assert of["run"] or {claim["verdict"] for claim in of["claims"]} == {"not run"}
    return [name for name, of in whole["figures"].items() if of["run"]]


def by_conditions(out: Path, name: str) -> dict[str, str]:
    """Verdict of every row of a claim."""
    figures = json.loads((out / "claims.json").read_text())["figures"].values()
    (claim,) = [claim for of in figures for claim in of["claims"] if claim["name"] == name]
    return {finding["conditions"]: finding["verdict"] for finding in claim["findings"]}


def counted(
    monkeypatch: pytest.MonkeyPatch, *, fail_at: int | None = None, by: type[BaseException] = RuntimeError
) -> list[Any]:
    """Every item that is carried out; the one at ``fail_at`` raises."""
    real = jobs.carry_out
    seen: list[Any] = []

    def carry_out(batch: Batch) -> Any:
        seen.extend(batch.items)
        if len(seen) - 1 == fail_at:
            raise by
        return real(batch)

    monkeypatch.setattr(jobs, "carry_out", carry_out)
    return seen


@pytest.mark.usefixtures("two")
def test_what_figures_share_is_run_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    seen = counted(monkeypatch)
    whole = reproduce(asked(tmp_path / "out"))
    assert len(seen) == 2 * 2  # two trials of two policies
    assert list(whole["figures"]) == ["figA", "figB"]
    assert json.loads((tmp_path / "out" / "claims.json").read_text()) == whole
    assert "It moves." in (tmp_path / "out" / "claims.md").read_text()


@pytest.mark.usefixtures("two")
def test_an_interrupted_run_goes_on_and_a_finished_figure_is_not_made_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "out"
    with monkeypatch.context() as patch:
        counted(patch, fail_at=3, by=KeyboardInterrupt)
        with pytest.raises(KeyboardInterrupt):
            reproduce(asked(out))
    assert (out / "figA" / "claims.json").is_file()
    assert not (out / "figB").exists()
    made = (out / "figA" / "figure.txt").stat().st_mtime_ns
    with pytest.raises(ValueError, match="--resume goes on, --overwrite starts over"):
        reproduce(asked(out))
    with pytest.raises(ValueError, match=r"differs in trials \(2 there, 3 now\)"):
        reproduce(asked(out, trials=3, resume=True))
    seen = counted(monkeypatch)
    whole = reproduce(asked(out, resume=True))
    assert len(seen) == 1
    assert (out / "figA" / "figure.txt").stat().st_mtime_ns == made
    assert list(whole["figures"]) == ["figA", "figB"]


@pytest.mark.usefixtures("two")
def test_figures_are_added_and_a_run_is_replaced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path / "out"
    assert ran(reproduce(asked(out, figures=("figA",)))) == ["figA"]
    seen = counted(monkeypatch)
    assert ran(reproduce(asked(out, figures=("figB",), resume=True))) == ["figA", "figB"]
    assert len(seen) == 2
    assert ran(reproduce(asked(out, figures=("figB",), overwrite=True, seed=1))) == ["figB"]
    assert len(seen) == 2 + 4


@pytest.mark.usefixtures("two")
def test_what_raises_costs_its_figure_only(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path / "out"
    with monkeypatch.context() as patch:
        counted(patch, fail_at=3, by=RuntimeError)
        with pytest.raises(EpisodesFailedError, match=r"policy active, trial 1, seed \d+: RuntimeError"):
            reproduce(asked(out))
    whole = json.loads((out / "claims.json").read_text())
    assert ran(whole) == ["figA"]
    assert [claim["verdict"] for claim in whole["figures"]["figB"]["claims"]] == ["not run"]
    assert "### small: not run" in (out / "claims.md").read_text()
    assert "RuntimeError" in (out / "failures.txt").read_text()
    assert ran(reproduce(asked(out, resume=True))) == ["figA", "figB"]
    assert not (out / "failures.txt").exists()


@pytest.mark.usefixtures("two")
def test_roots_are_added_to_the_pool(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Worlds of the first root are not played again; all other seeds are those that each root has alone."""
    out = tmp_path / "out"
    one = reproduce(asked(out, figures=("figA",), trials=6))["figures"]["figA"]
    assert one["claims"][0]["verdict"] == "too few trials"
    seen = counted(monkeypatch)
    two = reproduce(asked(out, figures=("figA",), trials=6, roots=2, resume=True))["figures"]["figA"]
    assert [task.trial for task in seen] == list(range(6, 12))
    assert [task.seed for task in seen] == [trial_seed(1, k) for k in range(6)]
    assert (two["run"]["roots"], two["claims"][0]["findings"][0]["n"]) == ([0, 1], 12)
    assert two["claims"][0]["verdict"] == "reproduced"
    pool = [Episode.load(path).figures["distance_m"] for path in (out / "episodes").iterdir()]
    assert two["claims"][0]["findings"][0]["value"] == pytest.approx(np.mean(pool))


@pytest.mark.usefixtures("two")
def test_a_sweep_stands_beside_the_default_and_plays_only_what_it_touches(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out, docs = tmp_path / "out", tmp_path / "docs"
    whole = reproduce(asked(out, docs=docs))
    published = (docs / "claims.json").read_text()
    seen = counted(monkeypatch)
    sweep = asked(out, sweep=("n_steps=3,6",), resume=True)
    columns = reproduce(sweep)["columns"]
    assert list(columns) == ["default", "n_steps=3", "n_steps=6"]
    assert {task.scenario.n_steps for task in seen} == {6}  # the default is there, and 3 is the default
    assert len(seen) == 2 * 2
    assert columns["default"] == {name: of["claims"] for name, of in whole["figures"].items()}
    assert columns["n_steps=3"] == {}
    short, long = (columns[label]["figA"][0]["findings"][0]["value"] for label in ("default", "n_steps=6"))
    assert long > 1.2 * short
    page = (out / "changed_claims.md").read_text()
    assert "|  |  | default | n_steps=3 | n_steps=6 |" in page
    assert "Figures 1, 3, 4 and 6 of the paper are not redone" in page
    assert "wifipgo reproduce all --trials 2 --roots 1 --seed 0 --sweep n_steps=3,6" in page
    assert (docs / "claims.json").read_text() == published
    assert not (docs / "changed_claims.json").exists()
    assert json.loads((out / "claims.json").read_text()) == whole
    reproduce(replace(sweep, docs=docs))
    assert (docs / "changed_claims.md").read_text() == page
    assert (docs / "claims.json").read_text() == published


def test_what_a_scenario_refuses_is_a_row_that_says_so(tmp_path: Path) -> None:
    """Robots that solve at every step have no distributed back-end."""
    setting = Setting(trials=2, seed=0, cache=tmp_path, changes={"backend": "distributed"}, sensitivity=False)
    run = Run(changed("paper-hw-2", estimator="every_step"), "random")
    assert not run.tasks(setting)
    assert not run.episodes(setting)
    assert len(Run(changed("paper-hw-2"), "random").tasks(setting)) == 2
    found = row("a", mean_of, run.episodes(setting))
    assert (found.n, found.estimate.value) == (0, None)


@pytest.mark.usefixtures("two")
def test_serial_and_process_find_the_same(tmp_path: Path) -> None:
    found = [
        reproduce(asked(tmp_path / name, executor=name, jobs=2))["figures"] for name in ("serial", "process")
    ]
    assert found[0] == found[1]


@pytest.mark.parametrize("overwrite", [True, False])
def test_a_folder_that_is_no_reproduction_is_left_alone(overwrite: bool, tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("all of it")
    with pytest.raises(
        ValueError, match=r"also holds 'thesis\.tex'|new, empty, or the folder of a reproduction"
    ):
        reproduce(asked(tmp_path, overwrite=overwrite))
    (tmp_path / _folder.CONFIG).write_text(json.dumps({"kind": "reproduce"}))
    with pytest.raises(ValueError, match=r"also holds|--resume goes on|new, empty"):
        reproduce(asked(tmp_path, overwrite=overwrite))
    assert (tmp_path / "thesis.tex").read_text() == "all of it"


def test_profile_and_dark_from_the_command_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two real figures, without recordings: pictures, data, and claims whose verdicts follow from numbers."""
    monkeypatch.setenv("WIFIPGO_DATA", str(tmp_path))
    monkeypatch.setattr(fig9, "ROOMS", {"without obstacles": "paper-hw-2"})
    out = tmp_path / "out"
    docs = tmp_path / "docs"
    options = ["--trials", "2", "--roots", "1", "--executor", "serial"]
    options += ["--out", str(out), "--docs", str(docs)]
    assert main(["fig2", "fig9", *options]) == 0
    assert "fig9.dark" in capsys.readouterr().out
    for name in ("fig2", "fig9"):
        assert (out / name / f"{name}.png").read_bytes().startswith(PNG)
        assert (docs / "pictures" / f"{name}.png").is_file()
    assert len(pd.read_parquet(out / "fig2" / "simulated.parquet")) == 2
    real = "real recordings, moving antenna, motion-capture truth"
    assert by_conditions(out, "fig2.azimuth")[real] == "not run"
    steps = pd.read_parquet(out / "fig9" / "steps.parquet")
    assert set(steps.iteration) == set(range(1, 51))
    claims = json.loads((docs / "claims.json").read_text())
    by_name = {claim["name"]: claim for of in claims["figures"].values() for claim in of["claims"]}
    for finding in by_name["fig9.dark"]["findings"]:
        if finding["role"] == "headline":
            assert finding["value"] == 0.0
            assert finding["note"] == "every trajectory is the same to the bit"
    assert (docs / "claims.md").read_text() == page(claims, _run.documented_picture)
    older = claims["figures"].pop("fig9")
    (docs / "claims.json").write_text(
        json.dumps({"figures": {"fig9": older | {"title": "old"}, "fig7": older}})
    )
    assert main(["fig9", *options, "--resume"]) == 0
    merged = json.loads((docs / "claims.json").read_text())["figures"]
    assert [name for name, of in merged.items() if of["run"]] == ["fig2", "fig7", "fig9"]
    assert [name for name, of in merged.items() if of["title"] == older["title"]] == ["fig7", "fig9"]
