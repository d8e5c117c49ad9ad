"""The suite: its version fixes what is played, runs go on and are joined, what does not fit is refused."""

import json
from dataclasses import replace
from io import StringIO
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pytest
from support.project_files import ROOT

from baselines.evaluate import run_episodes
from baselines.evaluation.intervals import Estimate
from baselines.merge import main as merge
from baselines.suite import definition, leaderboard, run
from baselines.suite.__main__ import main
from baselines.suite.config import SuiteConfig
from baselines.suite.definition import SUITES, Part, Suite, anchors_of, digest_of
from baselines.suite.results import FILE, Results, joined, read_results, write_results
from baselines.suite.run import play_suite
from baselines.suite.standings import Standing, decided_between
from baselines.suite.table import pairs_table, terminal_tables
from wifipgo.command.terminal import Terminal
from wifipgo.scenarios import SCENARIOS

POLICIES = "random,active"


@pytest.fixture(autouse=True)
def _short(monkeypatch: pytest.MonkeyPatch) -> None:
    """A version of two scenarios of two steps and twelve worlds, beside the real ones."""
    parts = {
        name: Part(SCENARIOS["paper-hw-2"].with_overrides(n_steps=2, n_robots=n), 71_000 + n, ())
        for name, n in (("two", 2), ("three", 3))
    }
    short = Suite(name="short", parts=parts, worlds=12)
    monkeypatch.setattr(definition, "SUITES", MappingProxyType({**SUITES, "short": short}))
    for module in ("config", "results", "report", "leaderboard"):
        monkeypatch.setattr(f"baselines.suite.{module}.SUITES", definition.SUITES)
    anchors = definition.Anchors({"two": 0.0, "three": 0.0}, {"two": 0.5, "three": 0.5})
    monkeypatch.setattr("baselines.suite.report.draw", lambda *_: None)
    for module in ("run", "standings"):
        monkeypatch.setattr(f"baselines.suite.{module}.anchors_of", lambda _: anchors)


def settings(out: Path, **changes: object) -> SuiteConfig:
    config = SuiteConfig(policies=POLICIES, suite="short", executor="serial", out=out)
    return replace(config, **changes)  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def whole() -> dict[str, Results]:
    return {}


@pytest.fixture
def done(whole: dict[str, Results], tmp_path: Path) -> Results:
    """One run of everything, played once."""
    if not whole:
        whole["done"] = play_suite(settings(tmp_path / "whole"))
    return whole["done"]


def test_scores_are_those_of_an_evaluation(done: Results) -> None:
    part = definition.SUITES["short"].parts["three"]
    played = run_episodes(part.scenario, "active", part.seeds(range(3, 5)))
    shares = [round(episode.figures["mapped_share"], 6) for episode in played]
    assert list(done.entries["active"].scores["three"][3:5]) == shares


def test_a_file_is_read_as_it_was_written(done: Results, tmp_path: Path) -> None:
    write_results(tmp_path / FILE, done)
    assert read_results(tmp_path / FILE) == done


def test_parts_joined_and_runs_continued_are_one_run(done: Results, tmp_path: Path) -> None:
    play_suite(settings(tmp_path / "a", policies="random"))
    assert play_suite(settings(tmp_path / "a", resume=True)) == done
    play_suite(settings(tmp_path / "b", scenarios=("two",)))
    play_suite(settings(tmp_path / "c", scenarios=("three",)))
    assert merge([str(tmp_path / "all"), str(tmp_path / "c"), str(tmp_path / "b")]) == 0
    assert read_results(tmp_path / "all" / FILE) == done
    assert (tmp_path / "all" / "table.md").read_text() == (tmp_path / "a" / "table.md").read_text()


def test_an_interrupted_run_goes_on(done: Results, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(run, "publish", interrupt)
        with pytest.raises(KeyboardInterrupt):
            play_suite(settings(tmp_path / "out"))
    monkeypatch.setattr("baselines.suite.chunks.run_episodes", interrupt)  # nothing is played again
    assert play_suite(settings(tmp_path / "out", resume=True)) == done


def test_worlds_are_joined_without_gap_or_overlap(done: Results) -> None:
    early, late = cut(done, 0, 5), cut(done, 5, 12)
    assert joined([late, early]) == done
    for parts, told in (((early, cut(done, 4, 12)), "in one part only"), ((early, cut(done, 6, 12)), "gap")):
        with pytest.raises(ValueError, match=told):
            joined(parts)


def cut(results: Results, begin: int, end: int) -> Results:
    entries = {
        label: replace(entry, scores={k: v[begin:end] for k, v in entry.scores.items()})
        for label, entry in results.entries.items()
    }
    return replace(results, first=begin, worlds=end - begin, entries=entries)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--suite", "suite-v0"], "unknown suite 'suite-v0'; known: short, suite-v1"),
        (["--suite", "short", "--scenarios", "tow"], "did you mean 'two'?"),
        (["--suite", "short", "--worlds", "5"], "worlds must be >= 10: a table needs them, got 5"),
        (["--suite", "short", "--worlds", "13"], "worlds must be in 0..12 (short has 12 from 0 on), got 13"),
        (["--suite", "short", "--reference", "ppo"], "unknown reference 'ppo'"),
    ],
)
def test_settings_that_cannot_be_are_refused(
    words: list[str], told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*words, "--policies", POLICIES, "--out", str(tmp_path / "out")]) == 2
    assert told in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


DISCRETE = "class Steps:\n    def act(self, observations):\n        return dict.fromkeys(observations, 3)\n"
TWO = (
    "import numpy as np\nclass Two:\n    def act(self, observations):\n"
    "        return {name: np.zeros(3) for name in ('robot_0', 'robot_1')}\n"
)


@pytest.mark.parametrize(
    ("code", "told"),
    [
        (
            DISCRETE,
            "cannot play two of short: action of policy 'Steps' for robot_0 must be of shape (3,)",
        ),
        (TWO, "policy Two cannot play three of short: policy 'Two' must give robot_2 an action"),
    ],
)
def test_a_policy_that_cannot_play_is_refused(
    code: str, told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "own.py").write_text(code)
    name = code.partition("class ")[2].partition(":")[0]
    policy = f"{name}={tmp_path / 'own.py'}:{name}"
    assert main(["--suite", "short", "--policies", policy, "--out", str(tmp_path / "out")]) == 2
    assert told in capsys.readouterr().err


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"suite": "suite-v1"}, "must be of the same version of the suite, got digest"),
        ({"digest": "0" * 16}, "must be of the same version of the suite, got digest"),
        ({"worlds": 11}, "must be 11 scores, one a world, got 12"),
        ({"entries": {}}, "entries must be one or more"),
        (
            {"entries": {"mine": {"scores": {}}}},
            "mine must be a table with policy, source, versions",
        ),
        ({"first": -1}, "first must be an int in 0..12, got -1"),
    ],
)
def test_files_that_do_not_fit_are_refused(
    done: Results, change: dict[str, object], told: str, tmp_path: Path
) -> None:
    write_results(tmp_path / FILE, done)
    said = json.loads((tmp_path / FILE).read_text())
    (tmp_path / FILE).write_text(json.dumps(said | change))
    with pytest.raises(ValueError, match=r"suite\.json") as problem:
        read_results(tmp_path / FILE)
    assert told in str(problem.value)


def test_the_leaderboard_takes_whole_runs_only(done: Results) -> None:
    leaderboard.check_whole(done)
    with pytest.raises(ValueError, match="worlds must be all 12 of short for the leaderboard, got 10"):
        leaderboard.check_whole(cut(done, 0, 10))


def test_entries_of_the_leaderboard_are_added_and_replaced(done: Results, tmp_path: Path) -> None:
    docs, run_folder = tmp_path / "docs", tmp_path / "run"
    for folder in (docs / "pictures", run_folder):
        folder.mkdir(parents=True)
    (docs / "leaderboard.md").write_text(f"# Ranks\n\n{leaderboard.BEGIN}\n{leaderboard.END}\n\nHow.\n")
    write_results(docs / "leaderboard.json", replace(done, entries={"random": done.entries["random"]}))
    write_results(run_folder / FILE, done)
    assert leaderboard.renew(docs, [run_folder]).entries == done.entries
    page = (docs / "leaderboard.md").read_text()
    assert page.startswith("# Ranks\n")
    assert page.endswith("How.\n")
    assert "| active |" in page
    assert (docs / "pictures" / "leaderboard.png").read_bytes().startswith(b"\x89PNG")
    assert leaderboard.with_table(page, done) == page


def test_every_policy_is_compared_with_every_other() -> None:
    lines = pairs_table(["a", "b"], lambda row, column: (3, 1) if (row, column) == ("a", "b") else (1, 3))
    assert lines.splitlines()[2:] == ["| a |  | 3, 1 |", "| b | 1, 3 |  |"]


def test_who_is_above_follows_from_paired_differences(done: Results) -> None:
    """A shift of every world is seen however wide the scores of worlds are spread."""
    entry = done.entries["active"]
    better = {
        name: tuple(score + 0.01 * (k % 2 + 1) for k, score in enumerate(of))
        for name, of in entry.scores.items()
    }
    entries = {**done.entries, "better": replace(entry, scores=better)}
    found = replace(done, entries=entries)
    n = len(done.scenarios)
    assert decided_between(found, "better", "active") == (n, 0)
    assert decided_between(found, "active", "better") == (0, n)
    assert decided_between(found, "active", "active") == (0, 0)


def test_tables_fit_into_eighty_columns() -> None:
    """Whatever a policy is called: every number is there, on one line with its column."""
    score = Estimate(1.0, 0.9, 1.0)
    scores = dict.fromkeys(SUITES["suite-v1"].parts, score)
    one = Standing(
        "a_policy_with_a_rather_long_name", score, score, 10, 0, scores, dict.fromkeys(scores, 1.0)
    )
    console = Terminal(width=80, record=True, file=StringIO())
    console.print(terminal_tables([one], "title"))
    text = console.export_text()
    assert "…" not in text
    assert text.count("100.0") == text.count("±5.0") == len(scores)
    assert text.count("1.000 [0.900, 1.000]") == 2


def test_versions_are_what_was_published() -> None:
    """Whoever changes a scenario of a version has to make another version."""
    for name in SUITES:
        anchors = anchors_of(name)
        floor, ceiling = (np.array([of[part] for part in SUITES[name].parts]) for of in anchors)
        assert (floor + 0.2 < ceiling).all()
    assert digest_of("suite-v1") == json.loads((ROOT / "baselines/suite/suite-v1.json").read_text())["digest"]
