"""A policy beside a rule: worlds as of an evaluation, nothing twice, and a page that no hand changes."""

import json
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pandas as pd
import pytest

from baselines.conduct import config, run
from baselines.conduct.config import WhyConfig
from baselines.conduct.page import BEGIN, END, is_as_made
from baselines.conduct.run import CURVES, NUMBERS, TABLES, explain
from baselines.evaluate import run_episodes
from baselines.evaluation.progress import run_shown
from baselines.suite import chunks
from baselines.suite.definition import CLOSE_UP, ROOTS, Part, Suite
from benchmarks.why import main
from wifipgo.scenarios import SCENARIOS

WORLDS = 10


@pytest.fixture(autouse=True)
def _short(monkeypatch: pytest.MonkeyPatch) -> None:
    """A scenario of two steps, without pictures."""
    scenario = SCENARIOS["paper-sim-2"].with_overrides(n_steps=2, n_robots=3)
    words = ("--scenario", "paper-sim-2", "--set", "n_robots=3", "n_steps=2", "--seed", "1")
    parts = MappingProxyType({"three": Part(scenario, 1, words)})
    short = Suite(name="suite-v1", parts=parts, worlds=100)
    monkeypatch.setattr(config, "SUITES", MappingProxyType({"suite-v1": short}))
    monkeypatch.setattr(run, "_draw", lambda *_: None)


def settings(out: Path, **changes: object) -> WhyConfig:
    config = WhyConfig(scenarios=("three",), worlds=WORLDS, without=("calls",), executor="serial", out=out)
    return replace(config, **changes)  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("why") / "out"


@pytest.fixture
def done(folder: Path) -> Path:
    """One run of everything, played once."""
    if not folder.exists():
        explain(settings(folder))
    return folder


def test_figures_are_those_of_an_evaluation(done: Path) -> None:
    part = settings(done).suite.parts["three"]
    assert part.root == CLOSE_UP
    seeds = part.seeds(range(WORLDS))
    rule, silent = (
        np.array([100.0 * e.figures["mapped_share"] for e in run_episodes(part.scenario, policy, seeds)])
        for policy in ("team_plan", "ppo:without=calls")
    )
    found = json.loads((done / NUMBERS).read_text())["scenarios"]["three"]["ppo without calls"]["score"]
    assert found["mean"][0] == pytest.approx(silent.mean())
    assert found["less_rule"][0] == pytest.approx((silent - rule).mean())
    assert "| ppo without calls | " in (done / TABLES).read_text()
    curves = pd.read_parquet(done / CURVES).set_index(["policy", "iteration"])
    mapped = curves["mapped"].to_dict()["team_plan", 2]
    assert 100.0 * mapped == pytest.approx(rule.mean())


def test_a_run_goes_on_without_playing_twice(done: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = (done / TABLES).read_text()
    played: list[str] = []

    def seen(label: str, items: list[object], **options: object) -> list[object]:
        played.extend(item.name for item in items)  # type: ignore[attr-defined]
        return run_shown(label, items, **options)  # type: ignore[arg-type,return-value]

    monkeypatch.setattr(chunks, "run_shown", seen)
    explain(settings(done, resume=True))
    assert not played
    assert (done / TABLES).read_text() == before
    explain(settings(done, resume=True, policies="team_plan,ppo,random"))
    assert set(played) == {"random"}


def test_the_documentation_is_filled_and_sealed(done: Path, tmp_path: Path) -> None:
    page = tmp_path / "training.md"
    page.write_text(f"# Before\n\n{BEGIN}\n\nwhat stood there\n\n{END}\n\nafter\n", encoding="utf-8")
    explain(settings(done, resume=True, docs=tmp_path))
    text = page.read_text(encoding="utf-8")
    assert text.startswith(f"# Before\n\n{BEGIN}\n\n`wifipgo bench why --policies team_plan,ppo")
    assert text.endswith(f"{END}\n\nafter\n")
    assert "what stood there" not in text
    assert is_as_made(text)
    assert not is_as_made(text.replace("| three |", "| tree |", 1))
    page.write_text("a page without marks", encoding="utf-8")
    with pytest.raises(ValueError, match=r"training.md must be with <!-- made by"):
        explain(settings(done, resume=True, docs=tmp_path))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--worlds", "3"], "worlds must be >= 10"),
        (["--scenarios", "sim"], "unknown scenario of suite-v1: 'sim'; known: three"),
        (["--policies", "ppo"], "policies must be a rule and a policy"),
        (["--policy", "team_plan"], "policy must be another than the rule"),
        (["--policy", "nobody"], "unknown policy 'nobody'; known: ppo, team_plan"),
        (["--reference", "nobody"], "unknown reference 'nobody'"),
        (
            ["--without", "lidar"],
            "unknown ablation in without: 'lidar'; known: calls, camera, memory, profile",
        ),
        (["--without", "camera", "camera"], "policies and without must be all different"),
        (["--resume", "--overwrite"], "one of them at most"),
        (["--policies", "team_plan,nobody"], "unknown policy 'nobody'"),
    ],
)
def test_what_cannot_run_is_refused_in_a_line(
    arguments: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    given = [] if "--scenarios" in arguments else ["--scenarios", "three"]
    assert main(["--out", str(out), "--executor", "serial", *given, *arguments]) == 2
    said = capsys.readouterr().err
    assert message in said
    assert said.count("\n") == 1
    assert not out.exists()


def test_a_folder_of_something_else_stays(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "mine.txt").write_text("mine")
    for option in ("--resume", "--overwrite"):
        assert main(["--out", str(tmp_path), "--scenarios", "three", option]) == 2
        assert "mine.txt" in capsys.readouterr().err
    assert (tmp_path / "mine.txt").read_text() == "mine"


def test_nothing_is_trained_or_chosen_on_its_worlds() -> None:
    assert CLOSE_UP in ROOTS
    assert ROOTS.count(CLOSE_UP) == 1
    assert WhyConfig().seed == CLOSE_UP
