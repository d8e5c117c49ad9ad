"""Policies against each other on the same worlds: ``python -m baselines.evaluate --help``."""

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from baselines import _results
from baselines._config import EvaluateConfig, command_of, parsed, plan_of
from baselines._episodes import Episode, run_episode, trial_seed
from baselines._executors import Executor
from baselines._plan import Plan
from baselines._report import announce, report
from baselines._statistics import Estimate, Paired, Summary, summarise
from baselines._workers import EpisodesFailedError, Task, run_all
from wifipgo.command_line import exit_code
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
    record = plan.record() | {"command": command_of(config)}
    if config.resume and _results.is_complete(out) and not _results.partial_of(out).exists():
        _results.refuse_other(out / "config.json", record, "the results there are of other settings")
        summary = summarise(pd.read_parquet(out / "episodes.parquet"), plan)
    else:
        partial = _results.claim(out, record, overwrite=config.overwrite, resume=config.resume)
        _run_missing(plan, partial, executor=executor, console=console)
        summary = _publish(plan, partial, out, record)
    report(summary, plan, out=str(config.out), console=console)
    return summary


def _run_missing(plan: Plan, partial: Path, *, executor: Executor, console: Console) -> None:
    """Run the episodes that are not there yet.

    Raises:
        EpisodesFailedError: Some raised; their traces are in ``failures.txt``.
    """
    tasks = [task for task in _tasks(plan, partial) if not _results.is_done(task.path)]
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
        Task(plan.scenario, policy, trial, seed, _results.episode_path(partial, place, trial))
        for trial, seed in enumerate(trial_seed(plan.seed, k) for k in range(plan.trials))
        for place, policy in enumerate(plan.policies)
    ]


def _publish(plan: Plan, partial: Path, out: Path, record: Mapping[str, Any]) -> Summary:
    """Write tables and pictures beside the episodes, then rename them to ``out``."""
    from baselines import _pictures  # noqa: PLC0415 (matplotlib loads slowly, and only here)

    episodes = [Episode.load(task.path) for task in sorted(_tasks(plan, partial), key=lambda t: t.path)]
    summary = summarise(_results.episodes_frame(episodes), plan)
    staging = _results.clean_staging(partial)
    _results.write_tables(staging, episodes, summary, record)
    _pictures.draw_err(staging / "err.png", plan, episodes)
    _pictures.draw_arena(staging / "arena.png", plan, episodes)
    _results.publish(staging, out)
    return summary


def main(args: Sequence[str] | None = None) -> int:
    """Run from the command line; the exit code is that of `wifipgo.command_line`."""
    kept = "interrupted; finished episodes are kept: the same command with --resume continues"
    return exit_code(lambda: evaluate(parsed(args), console=Terminal()), interrupted=kept)


if __name__ == "__main__":
    sys.exit(main())
