"""Write the leaderboard from committed scores: ``python -m baselines.suite.leaderboard docs [RUN ...]``.

Entries of the runs, folders of ``wifipgo suite``, are added to ``docs/leaderboard.json``, or take the place
of those of the same name; the page and its picture are made anew.
"""

import sys
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from baselines.evaluation.marked_pages import filled
from baselines.suite.definition import SUITES
from baselines.suite.report import draw, title
from baselines.suite.results import FILE, Results, joined, read_results, write_results
from baselines.suite.standings import Standing, decided_between, reference_of, standings_of
from baselines.suite.table import markdown_table, pairs_table
from wifipgo.command.command_line import exit_code
from wifipgo.errors import require
from wifipgo.files.atomic_files import write_text
from wifipgo.files.text_files import read_text

SCORES, PAGE, PICTURE = "leaderboard.json", "leaderboard.md", "pictures/leaderboard.png"
_PICTURE = f"![Scores by scenario, interquartile means, probabilities of improvement]({PICTURE})"
_PAIRS = "Scenarios in which the policy of a row is above, below that of a column, by the paired difference:"
BEGIN, END = "<!-- made by python -m baselines.suite.leaderboard -->", "<!-- end -->"


def renew(docs: Path, runs: Sequence[Path]) -> Results:
    """Take entries up and write scores, page and picture.

    Args:
        docs: Folder of the page.
        runs: Folders of results.

    Raises:
        BadInputError: Another version, or fewer worlds or scenarios than the version has.
    """
    parts = [read_results(run / FILE) for run in runs]
    new = {label for part in parts for label in part.entries}
    if (docs / SCORES).is_file():
        there = read_results(docs / SCORES)
        kept = {label: entry for label, entry in there.entries.items() if label not in new}
        parts = [*([replace(there, entries=kept)] if kept else []), *parts]
    results = joined(parts, same_code=False)
    check_whole(results)
    write_results(docs / SCORES, results)
    write_text(docs / PAGE, with_table(read_text(docs / PAGE), results))
    reference = reference_of(list(results.entries))
    draw(docs / PICTURE, standings_of(results, reference), results, reference)
    return results


def check_whole(results: Results) -> None:
    """Refuse an entry that has not played all of a version.

    Raises:
        BadInputError: Says what is missing.
    """
    suite = SUITES[results.suite]
    rule = f"all {suite.worlds} of {suite.name} for the leaderboard"
    require(results.first == 0 and results.worlds == suite.worlds, "worlds", rule, results.worlds)
    lacking = [name for name in suite.parts if name not in results.scenarios]
    require(
        not lacking, "scenarios", f"all of {suite.name} for the leaderboard", f"none in {', '.join(lacking)}"
    )


def with_table(page: str, results: Results) -> str:
    """The page with what is made from the scores between its marks."""
    reference = reference_of(list(results.entries))
    standings = standings_of(results, reference)
    labels = [one.label for one in standings]
    pairs = f"{_PAIRS}\n\n{pairs_table(labels, partial(decided_between, results))}"
    parts = [title(results, reference), markdown_table(standings), _PICTURE, pairs]
    text = "\n\n".join([*parts, _policies(standings, results)])
    return filled(page, BEGIN, END, text, where=PAGE)


def _policies(standings: Sequence[Standing], results: Results) -> str:
    """Which policy each entry is, and the code that played it."""
    lines = ["| entry | policy | wifipgo | code |", "|---|---|---|---|"]
    for one in standings:
        entry = results.entries[one.label]
        source = f", source {entry.source}" if entry.source else ""
        code, version = entry.versions.get("code_sha256", ""), entry.versions.get("wifipgo", "")
        lines.append(f"| {one.label} | `{entry.policy}`{source} | {version} | {code} |")
    return "\n".join(lines)


def main(args: Sequence[str] | None = None) -> int:
    """Run from the command line; the exit code is that of `wifipgo.command.command_line`."""
    words = list(sys.argv[1:] if args is None else args)

    def job() -> None:
        require(len(words) > 0, "arguments", "the folder of the page, then folders of results", words)
        renew(Path(words[0]), [Path(word) for word in words[1:]])

    return exit_code(job)


if __name__ == "__main__":
    sys.exit(main())
