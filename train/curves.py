"""How trainings learn: runs of several seeds and variants side by side, as a picture and a table.

Run: ``python -m train.curves shipped=RUN+RUN "another=RUN" [--out FILE.png]``. A run is the
folder of ``wifipgo train``; those of one name, joined by ``+``, are seeds of one recipe. All must have been
judged on the same worlds, and the scenarios count that all have. The table is at the last agent-steps that
all runs of a name reached.
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
from rich.console import Console
from rich.table import Table

from baselines.policies.learned.network import load_network
from baselines.policies.learned.run_files import POLICY
from train._checkpoints import Checkpoints
from train._config import TrainConfig
from train._config_files import read_yaml
from train._curves_picture import drawn
from train._learning_curve import LEARNED
from wifipgo.command.command_line import exit_code
from wifipgo.errors import require
from wifipgo.files.atomic_files import appearing, write_text


@dataclass(frozen=True, slots=True, kw_only=True)
class CurvesConfig:
    """What is compared."""

    runs: tyro.conf.Positional[tuple[str, ...]]
    out: Annotated[Path | None, tyro.conf.arg(help="Draw the curves into this .png file.")] = None
    table: Annotated[Path | None, tyro.conf.arg(help="Write the table, as Markdown, into this file.")] = None

    def __post_init__(self) -> None:
        """Refuse what names no run."""
        require(bool(self.runs), "runs", "NAME=FOLDER or NAME=FOLDER+FOLDER, one or more", self.runs)
        for text in self.runs:
            name, _, folders = text.partition("=")
            require(bool(name and folders), "runs", "NAME=FOLDER or NAME=FOLDER+FOLDER", text)


def curves_of(texts: Sequence[str]) -> tuple[pd.DataFrame, tuple[str, ...]]:
    """Scores of all runs, with the columns ``recipe``, ``run`` and ``scenario`` beside those of a curve.

    A run that began with the network of another goes on where that one was.

    Returns:
        The scores, and the scenarios that all runs were judged on, in the order of the first.

    Raises:
        ValueError: A run was judged on other worlds than the first.
        OSError: A folder without a curve.
    """
    named = [
        (name, Path(each)) for name, _, rest in (t.partition("=") for t in texts) for each in rest.split("+")
    ]
    configs = {folder: read_yaml(folder / "config.yaml") for _, folder in named}
    first = configs[named[0][1]]
    for folder, config in configs.items():
        worlds, wanted = ((c.selection.trials, c.selection.seed) for c in (config, first))
        rule = f"of the worlds of the first run, (trials, seed) {wanted}"
        require(worlds == wanted, f"selection of {folder}", rule, worlds)
    shared = set.intersection(*(set(played_of(config)) for config in configs.values()))
    scenarios = tuple(name for name in played_of(first) if name in shared)
    require(
        bool(scenarios), "runs", "judged on scenarios in common", [played_of(c) for c in configs.values()]
    )
    parts = [_scores(folder, configs[folder]).assign(recipe=name, run=str(folder)) for name, folder in named]
    scores = pd.concat(parts, ignore_index=True)
    return scores[scores["scenario"].isin(scenarios)], scenarios


def _in_common(configs: Mapping[Path, TrainConfig]) -> tuple[str, ...]:
    """Scenarios that all runs were judged on, in the same worlds."""
    first, *_ = configs.values()
    for folder, config in configs.items():
        worlds, wanted = ((each.selection.trials, each.selection.seed) for each in (config, first))
        rule = f"of the worlds of the first run, (trials, seed) {wanted}"
        require(worlds == wanted, f"selection of {folder}", rule, worlds)
    played = [played_of(config) for config in configs.values()]
    found = tuple(name for name in played[0] if all(name in each for each in played))
    require(bool(found), "runs", "judged on scenarios in common", played)
    return found


def _scores(folder: Path, config: TrainConfig) -> pd.DataFrame:
    """Of one run, with the scenario of each."""
    table, played = pd.read_parquet(folder / "curve.parquet"), played_of(config)
    scenario = [played[trial // config.selection.trials] for trial in table["trial"]]
    before = played_before(folder) if config.start else 0
    return table.assign(scenario=scenario, agent_steps=table["agent_steps"] + before)


def played_before(folder: Path) -> int:
    """Agent-steps of the trainings whose network a run began with."""
    origin, steps = load_network(Checkpoints(folder).path() / POLICY).origin.get("begun_with"), 0
    while origin:
        steps += origin["agent_steps"] + origin["imitated"]
        origin = origin.get("begun_with")
    return steps


def played_of(config: TrainConfig) -> tuple[str, ...]:
    """Scenarios that checkpoints are judged on."""
    return config.selection.scenarios or (config.envs.scenario,)


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
    Console(width=200).print(table_of(lines))
    if config.table is not None:
        write_text(config.table, markdown_of(lines))
    if config.out is not None:
        with appearing(config.out) as unfinished:
            drawn(curves, scenarios).savefig(unfinished, dpi=120, format="png")


def main(args: Sequence[str] | None = None) -> int:
    """Run from the command line."""
    return exit_code(lambda: run(tyro.cli(CurvesConfig, args=args, description=__doc__)))


if __name__ == "__main__":
    sys.exit(main())
