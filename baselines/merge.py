"""Join parts of an evaluation, e.g. of a job array: ``wifipgo merge OUT IN...``."""

import shlex
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import tyro
from rich.console import Console

from baselines.evaluation import run_folder
from baselines.evaluation.console_report import report
from baselines.evaluation.pictures import draw, episodes_to_show
from baselines.evaluation.plan import Plan, differences, read_record
from baselines.evaluation.statistics import Summary, summarise
from baselines.policies.registry import recorded_specs
from baselines.suite.merging import are_suites, merge_suites
from wifipgo.command.command_line import exit_code
from wifipgo.command.docstrings import documented
from wifipgo.command.terminal import Terminal
from wifipgo.errors import BadInputError, require
from wifipgo.files import results_folder
from wifipgo.files.folder_lock import held
from wifipgo.scenarios import scenario_from

# What may differ between the parts of one evaluation.
_OF_A_PART = ("command", "reference", "trials", "trials_from")


@dataclass(frozen=True, slots=True, kw_only=True)
class MergeConfig:
    """Join evaluations of the same settings, code and seed that played different trials, or runs of a suite.

    Runs of one version of the suite may differ in policies, scenarios or worlds. The tables of an evaluation
    are those that one run of all trials writes, to the byte, and the pictures are drawn from them.

    Example: wifipgo merge results/all results/job-*

    Attributes:
        out: Folder of the joined results, new or empty.
        parts: Folders that wifipgo evaluate, or wifipgo suite, wrote, in any order; trials follow each other.
    """

    out: Annotated[Path, tyro.conf.Positional]
    parts: Annotated[tuple[Path, ...], tyro.conf.Positional]


class _Part(NamedTuple):
    """Results of some trials."""

    folder: Path
    record: dict[str, Any]

    @property
    def first(self) -> int:
        return int(self.record.get("trials_from", 0))

    @property
    def end(self) -> int:
        return self.first + int(self.record["trials"])


def merge(config: MergeConfig, *, console: Console | None = None) -> Summary:
    """Join the tables of parts and summarise them.

    Raises:
        BadInputError: A folder that is no evaluation, settings that differ, a trial twice or missing.
        OSError: A folder that cannot be written.
    """
    parts = sorted(map(_part, config.parts), key=lambda part: part.first)
    _check(parts)
    plan, out = _plan(parts), config.out.resolve()
    with held(out):
        require(not out.exists() or not any(out.iterdir()), "out", "new or empty", str(out))
        summary = _write(plan, parts, out)
    report(summary, plan, out=str(config.out), console=console or Console(quiet=True))
    return summary


def _part(folder: Path) -> _Part:
    require(
        run_folder.is_complete(folder), "in", "a folder of finished results of an evaluation", str(folder)
    )
    return _Part(folder, read_record(folder / "config.json"))


def _check(parts: Sequence[_Part]) -> None:
    """Refuse parts of different evaluations, and trials that are there twice or not at all."""
    require(len(parts) > 0, "in", "one folder or more", [])
    for before, part in pairwise(parts):
        theirs, ours = ({k: v for k, v in p.record.items() if k not in _OF_A_PART} for p in (before, part))
        for name, old, new in differences(theirs, ours):
            told = f"{old!r} in {before.folder}, {new!r} in {part.folder}"
            raise BadInputError(f"parts must be of the same settings and code, got {name} {told}")
        where = f"{before.folder} ends before trial {before.end}, {part.folder} begins with {part.first}"
        require(part.first >= before.end, "trials", "in one part only", where)
        require(part.first == before.end, "trials", "without a gap", where)


def _plan(parts: Sequence[_Part]) -> Plan:
    """All trials of all parts."""
    record = parts[0].record
    return Plan(
        scenario=scenario_from(record["scenario"], str(parts[0].folder / "config.json")),
        specs=recorded_specs(record["policies"]),
        trials=parts[-1].end - parts[0].first,
        seed=record["seed"],
        trials_from=parts[0].first,
        against=record.get("reference", ""),
    )


def _write(plan: Plan, parts: Sequence[_Part], out: Path) -> Summary:
    """Tables in the order of a single run: policies as given, trials, iterations, robots."""
    partial = results_folder.partial_of(out)
    results_folder.begin(partial, run_folder.KIND)
    results_folder.note(partial, ["results/"])
    staging = run_folder.clean_staging(partial)
    tables = run_folder.joined([run_folder.read_tables(part.folder) for part in parts], plan.policies)
    summary, shown = summarise(tables.episodes, plan), episodes_to_show(plan, tables)
    command = shlex.join(["python", "-m", "baselines.merge", str(out), *(str(p.folder) for p in parts)])
    record = parts[0].record | {"trials": plan.trials, "command": command}
    run_folder.write_tables(staging, tables, summary, record)
    run_folder.keep_episodes(staging, shown, [part.folder / run_folder.MEDIAN for part in parts])
    results_folder.publish(staging, out, run_folder.KIND, later=run_folder.later(shown))
    draw(out, plan, tables)
    results_folder.remove(partial, run_folder.KIND)
    return summary


def main(args: Sequence[str] | None = None) -> int:
    """Run from the command line; the exit code is that of `wifipgo.command.command_line`."""

    def job() -> None:
        config = tyro.cli(documented(MergeConfig), prog="wifipgo merge", args=args)
        if are_suites(config.parts):
            merge_suites(config.out, config.parts, console=Terminal())
        else:
            merge(config, console=Terminal())

    return exit_code(job)


if __name__ == "__main__":
    sys.exit(main())
