"""What a suite leaves: scores, table and picture in a folder, the table on the terminal."""

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from baselines.suite.definition import SUITES
from baselines.suite.results import FILE, Results, write_results
from baselines.suite.standings import Standing, standings_of
from baselines.suite.table import markdown_table, terminal_tables
from wifipgo.command.terminal import say
from wifipgo.files import results_folder
from wifipgo.files.atomic_files import write_text

KIND = "suite"
TABLE, PICTURE = "table.md", "suite.png"


def publish(results: Results, reference: str, partial: Path, out: Path) -> list[Standing]:
    """Write everything beside its place, then give it its name, then draw.

    Args:
        results: Of one run, or joined.
        reference: Policy that the others are compared with.
        partial: Working folder of this kind.
        out: Folder of the results.
    """
    standings = standings_of(results, reference)
    staging = results_folder.emptied(partial / "results")
    write_results(staging / FILE, results)
    head = title(results, reference)
    write_text(staging / TABLE, f"{head}\n\n{markdown_table(standings)}\n")
    results_folder.publish(staging, out, KIND, later=[PICTURE])
    draw(out / PICTURE, standings, results, reference)
    results_folder.remove(partial, KIND)
    return standings


def draw(path: Path, standings: Sequence[Standing], results: Results, reference: str) -> None:
    """Draw the picture; what fails is a warning."""
    from wifipgo.command.figures import drawing  # noqa: PLC0415 (matplotlib loads slowly, and only here)

    from baselines.suite.picture import draw_suite  # noqa: PLC0415

    with drawing(path):
        draw_suite(path, standings, title=title(results, reference), reference=reference)


def report(
    standings: Sequence[Standing], results: Results, reference: str, out: Path, console: Console
) -> None:
    """Print the table, and where everything is."""
    console.print(terminal_tables(standings, title(results, reference)))
    say(
        console,
        "IQM: interquartile mean of scores between a random walk (0) and near-perfect localisation (1)",
    )
    say(
        console,
        f"P(better): probability of improvement over {reference}; above, below: scenarios that differ",
    )
    say(console, f"results: {out}")


def title(results: Results, reference: str) -> str:
    """What was played."""
    suite = SUITES[results.suite]
    n, of = len(results.scenarios), len(suite.parts)
    part = f"{n} scenarios" if n == of else f"{n} of {of} scenarios"
    worlds = (
        f"worlds {results.first} to {results.numbers[-1]}"
        if results.worlds < suite.worlds
        else f"{suite.worlds} worlds"
    )
    return f"{results.suite}: {part}, {worlds} each; mapped share in %, 95 % intervals; against {reference}"
