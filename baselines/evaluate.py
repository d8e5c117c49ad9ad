"""Policies against each other on the same worlds: ``python -m baselines.evaluate --help``."""

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from baselines.evaluation import run_folder
from baselines.evaluation.config import EvaluateConfig, command_of, parsed, plan_of
from baselines.evaluation.console_report import announce, report
from baselines.evaluation.episodes import Episode, run_episode, trial_seed
from baselines.evaluation.executors import Executor
from baselines.evaluation.jobs import EpisodesFailedError, Task, missing, run_all
from baselines.evaluation.plan import Plan
from baselines.evaluation.statistics import Estimate, Paired, Summary, summarise
from wifipgo import results_folder
from wifipgo.command_line import exit_code
from wifipgo.folder_lock import held
from wifipgo.terminal import Terminal

__all__ = [
    "Episode",
    "EpisodesFailedError",
    "Estimate",
    "EvaluateConfig",
    "Paired",
    "Summary",
    "evaluate",
    "main",
    "run_episode",
]


def evaluate(config: EvaluateConfig, *, console: Console | None = None) -> Summary:
    """Run, or continue, an evaluation and write its results.

    With more than one job, call it under ``if __name__ == "__main__":``, as
    every program that starts processes.

    Args:
        config: What to run and where the results go.
        console: Where to print; nowhere if None.

    Raises:
        ValueError: A setting that is refused; nothing was written.
        OSError: A folder that cannot be written.
        EpisodesFailedError: Some episodes raised; the others are kept for ``resume``.
    """
    console = console or Console(quiet=True)
    executor = Executor(name=config.executor, jobs=config.jobs, ray_address=config.ray_address)
    plan, out = plan_of(config), config.out.resolve()
    executor.check_script(plan.trials * len(plan.policies))
    record = plan.record() | {"command": command_of(config)}
    with held(out):
        summary = _finished(plan, out, record) if config.resume else None
        if summary is None:
            names = [task.path.name for task in _tasks(plan, out)]
            partial = run_folder.claim(out, record, names, overwrite=config.overwrite, resume=config.resume)
            _run_missing(plan, partial, executor=executor, console=console)
            summary = _publish(plan, partial, out, record)
    report(summary, plan, out=str(config.out), console=console)
    return summary


def _finished(plan: Plan, out: Path, record: Mapping[str, Any]) -> Summary | None:
    """Summary of results that are there, or None; clears away what a run left that ended after them.

    Raises:
        BadInputError: They are of other settings.
    """
    partial = run_folder.partial_of(out)
    if not run_folder.is_complete(out) or (partial / "config.json").exists():
        return None
    run_folder.refuse_other(out / "config.json", record, "the results there are of other settings")
    if results_folder.is_of(partial, run_folder.KIND):
        results_folder.remove(partial, run_folder.KIND)
    return summarise(pd.read_parquet(out / "episodes.parquet"), plan)


def _run_missing(plan: Plan, partial: Path, *, executor: Executor, console: Console) -> None:
    """Run the episodes that are not there yet.

    Raises:
        EpisodesFailedError: Some raised; their traces are in ``failures.txt``.
    """
    tasks = missing(_tasks(plan, partial))
    announce(plan, jobs=executor.slots(len(tasks)), n_left=len(tasks), console=console)
    columns = (TextColumn("episodes"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True, quiet=console.quiet)) as progress:
        bar = progress.add_task("", total=len(tasks))
        failures = run_all(tasks, executor=executor, on_done=lambda: progress.advance(bar))
    if failures:
        (partial / "failures.txt").write_text("\n".join(f.trace for f in failures), encoding="utf-8")
        raise EpisodesFailedError([failure.line for failure in failures], partial)


def _tasks(plan: Plan, partial: Path) -> list[Task]:
    """Every episode, trial by trial."""
    return [
        Task(plan.scenario, policy, trial, seed, run_folder.episode_path(partial, place, trial))
        for trial, seed in ((k, trial_seed(plan.seed, k)) for k in plan.numbers)
        for place, policy in enumerate(plan.policies)
    ]


def _publish(plan: Plan, partial: Path, out: Path, record: Mapping[str, Any]) -> Summary:
    """Write tables beside the episodes, rename them to ``out``, then draw the pictures."""
    episodes = [Episode.load(task.path) for task in sorted(_tasks(plan, partial), key=lambda t: t.path)]
    summary = summarise(run_folder.episodes_frame(episodes), plan)
    staging = run_folder.clean_staging(partial)
    run_folder.write_tables(staging, episodes, summary, record)
    results_folder.publish(staging, out, run_folder.KIND, later=run_folder.PICTURES)
    _draw(out, plan, episodes)
    results_folder.remove(partial, run_folder.KIND)
    return summary


def _draw(out: Path, plan: Plan, episodes: Sequence[Episode]) -> None:
    """Draw the pictures; one that cannot be drawn is a warning."""
    from baselines.evaluation import plots  # noqa: PLC0415 (matplotlib loads slowly, and only here)
    from wifipgo.figures import drawing  # noqa: PLC0415

    for path, draw in (("err.png", plots.draw_err), ("arena.png", plots.draw_arena)):
        with drawing(out / path):
            draw(out / path, plan, episodes)


def main(args: Sequence[str] | None = None) -> int:
    """Run from the command line; the exit code is that of `wifipgo.command_line`."""
    kept = "interrupted; finished episodes are kept: the same command with --resume continues"
    return exit_code(lambda: evaluate(parsed(args), console=Terminal()), interrupted=kept)


if __name__ == "__main__":
    sys.exit(main())
