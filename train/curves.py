"""How trainings learn: runs of several seeds and variants side by side, as a picture and a table.

Run: ``python -m train.curves shipped=RUN+RUN "another=RUN" [--out FILE.png]``. A run is the
folder of ``wifipgo train``; those of one name, joined by ``+``, are seeds of one recipe. All must have been
judged on the same worlds, and the scenarios count that all have. The table is at the last agent-steps that
all runs of a name reached. ``--scores FILE.parquet`` keeps the scores, and such a file stands for its runs:
``python -m train.curves docs/training_curves.parquet mine=RUN`` shows the documented ones beside yours.
"""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import pandas as pd
import tyro
from jaxtyping import Float
from rich.table import Table

from train._curve_scores import curves_of, save_scores
from train._curves_picture import drawn
from train._learning_curve import LEARNED
from wifipgo.command.command_line import exit_code
from wifipgo.command.terminal import Terminal
from wifipgo.errors import require
from wifipgo.files.atomic_files import appearing, write_text


@dataclass(frozen=True, slots=True, kw_only=True)
class CurvesConfig:
    """What is compared."""

    runs: tyro.conf.Positional[tuple[str, ...]]
    out: Annotated[Path | None, tyro.conf.arg(help="Draw the curves into this .png file.")] = None
    table: Annotated[Path | None, tyro.conf.arg(help="Write the table, as Markdown, into this file.")] = None
    scores: Annotated[Path | None, tyro.conf.arg(help="Write all scores into this .parquet file.")] = None

    def __post_init__(self) -> None:
        """Refuse what names no run."""
        rule = "NAME=FOLDER, NAME=FOLDER+FOLDER or FILE.parquet"
        require(bool(self.runs), "runs", f"{rule}, one or more", self.runs)
        for text in self.runs:
            name, named, folders = text.partition("=")
            fine = bool(name and folders) if named else text.endswith(".parquet")
            require(fine, "runs", rule, text)


def scores_at_the_end(curves: pd.DataFrame) -> Mapping[str, pd.DataFrame]:
    """By recipe, the mean score of each run by scenario, where the shortest of its runs ends."""
    learned, found = curves[curves["policy"] == LEARNED], {}
    for recipe, mine in learned.groupby("recipe", sort=False):
        end = mine.groupby("run")["agent_steps"].max().min()
        here = mine[mine["agent_steps"] == end]
        found[f"{recipe}, {end:,}"] = here.pivot_table(
            index="run", columns="scenario", values="mapped_share", sort=False
        )
    for policy, rules in curves[curves["policy"] != LEARNED].groupby("policy", sort=False):
        once = rules[rules["run"] == rules["run"].iloc[0]]
        found[str(policy)] = once.pivot_table(
            index="run", columns="scenario", values="mapped_share", sort=False
        )
    return found


def lines_of(by_recipe: Mapping[str, pd.DataFrame], scenarios: Sequence[str]) -> list[list[str]]:
    """Heads, then recipes: mean over seeds, and their range where there are several."""
    lines = [["recipe, agent-steps", "seeds", "all", *scenarios]]
    for name, frame in by_recipe.items():
        scores = frame[list(scenarios)].to_numpy(float)
        columns = np.column_stack([scores.mean(axis=1), scores]).T
        lines.append([name, str(len(frame)), *map(_cell, columns)])
    return lines


def table_of(lines: Sequence[Sequence[str]]) -> Table:
    """The same for a terminal."""
    table = Table(title="mapped share in %, mean over seeds and their range")
    for name in lines[0]:
        table.add_column(name, justify="left" if name == lines[0][0] else "right")
    for line in lines[1:]:
        table.add_row(*line)
    return table


def markdown_of(lines: Sequence[Sequence[str]]) -> str:
    """The same as a pipe table."""
    rule = ["---", *["---:"] * (len(lines[0]) - 1)]
    return "".join(f"| {' | '.join(line)} |\n" for line in (lines[0], rule, *lines[1:]))


def _cell(of_runs: Float[np.ndarray, " runs"]) -> str:
    mean = f"{100.0 * of_runs.mean():.1f}"
    if len(of_runs) == 1:
        return mean
    return f"{mean} [{100.0 * of_runs.min():.1f}, {100.0 * of_runs.max():.1f}]"


def run(config: CurvesConfig) -> None:
    """Print the table, then draw."""
    curves, scenarios = curves_of(config.runs)
    lines = lines_of(scores_at_the_end(curves), scenarios)
    Terminal(width=200).print(table_of(lines))
    if config.table is not None:
        write_text(config.table, markdown_of(lines))
    if config.scores is not None:
        save_scores(curves, config.scores)
    if config.out is not None:
        with appearing(config.out) as unfinished:
            drawn(curves, scenarios).savefig(unfinished, dpi=120, format="png")


def main(args: Sequence[str] | None = None) -> int:
    """Run from the command line."""
    return exit_code(lambda: run(tyro.cli(CurvesConfig, args=args, description=__doc__)))


if __name__ == "__main__":
    sys.exit(main())
