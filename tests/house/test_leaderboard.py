"""The leaderboard's page is made from the committed scores, and names the scenarios of its version."""

from support.project_files import ROOT

from baselines.suite.definition import SUITES
from baselines.suite.leaderboard import BEGIN, END, PAGE, SCORES, check_whole, with_table
from baselines.suite.results import read_results

TEXT = (ROOT / "docs" / PAGE).read_text("utf-8")


def test_the_page_is_made_from_the_scores() -> None:
    if not (ROOT / "docs" / SCORES).exists():
        assert "No entry yet." in TEXT.partition(BEGIN)[2].partition(END)[0]
        return
    results = read_results(ROOT / "docs" / SCORES)
    check_whole(results)
    assert with_table(TEXT, results) == TEXT


def test_the_page_says_how_to_play_each_scenario_alone() -> None:
    for name, part in SUITES["suite-v1"].parts.items():
        rows = [line for line in TEXT.splitlines() if line.startswith(f"| `{name}` ")]
        assert len(rows) == 1
        assert f"`{' '.join(part.command)}`" in rows[0]
