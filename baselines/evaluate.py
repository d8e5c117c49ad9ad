"""Policies against each other on the same worlds: ``wifipgo evaluate --help``."""

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console

from baselines.evaluation import run_folder
from baselines.evaluation.config import EvaluateConfig, changed_sources, command_of, parsed, plan_of
from baselines.evaluation.console_report import announce, report
from baselines.evaluation.episodes import Episode, run_episode, run_episodes, trial_seed
from baselines.evaluation.executors import Executor
from baselines.evaluation.jobs import EpisodesFailedError, Task, missing, raise_if_failed
from baselines.evaluation.paper_tables import check_tables, write_paper_tables
from baselines.evaluation.pictures import draw, episodes_to_show
from baselines.evaluation.plan import Plan
from baselines.evaluation.progress import run_shown
from baselines.evaluation.statistics import Estimate, Paired, Summary, summarise
from wifipgo.command.command_line import exit_code
from wifipgo.command.terminal import Terminal, say
from wifipgo.files import results_folder
from wifipgo.files.folder_lock import held

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
    "run_episodes",
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
    executor = config.where
    plan, out = plan_of(config), config.out.resolve()
    check_tables(config.table, out, overwrite=config.overwrite)
    executor.check_script(plan.trials * len(plan.policies))
    record = plan.record() | {"command": command_of(config)}
    for label in changed_sources(config.config, record):
        say(console, f"warning: the source of {label} is another than when {config.config} was written")
    with held(out):
        there = run_folder.trials_there(out, record, overwrite=config.overwrite) if config.resume else 0
        if there < plan.trials:
            left = plan.after(there)
            names = [task.path.name for task in _tasks(left, out)]
            may = config.overwrite or there > 0
            partial = run_folder.claim(out, record, names, overwrite=may, resume=config.resume)
            _run_missing(left, partial, plan=plan, executor=executor, console=console)
            summary = _publish(plan, left, partial, out, record)
        else:
            run_folder.clear_away(out, record)
            tables = run_folder.read_tables(out)
            summary = summarise(tables.episodes, plan)
            run_folder.compare_anew(out, summary, record)
            if not all((out / name).is_file() for name in run_folder.PICTURES):
                draw(out, plan, tables)
        results_folder.note(out, [path.name for path in config.table if path.resolve().parent == out])
        write_paper_tables(config.table, summary, plan)
    report(summary, plan, out=str(config.out), console=console)
    return summary


def _run_missing(left: Plan, partial: Path, *, plan: Plan, executor: Executor, console: Console) -> None:
    """Run the episodes that are not there yet.

    Args:
        left: Trials that finished results do not hold.
        partial: Folder of their files.
        plan: All trials.
        executor: Where they run.
        console: Where to say so.

    Raises:
        EpisodesFailedError: Some raised; their traces are in ``failures.txt``.
    """
    tasks = missing(_tasks(left, partial))
    announce(plan, jobs=executor.slots(len(tasks)), n_left=len(tasks), console=console)
    raise_if_failed(run_shown("episodes", tasks, executor=executor, console=console), partial)


def _tasks(plan: Plan, partial: Path) -> list[Task]:
    """Every episode, trial by trial."""
    return [
        Task(plan.scenario, of.label, trial, seed, run_folder.episode_path(partial, place, trial), str(of))
        for trial, seed in ((k, trial_seed(plan.seed, k)) for k in plan.numbers)
        for place, of in enumerate(plan.specs)
    ]


def _publish(plan: Plan, left: Plan, partial: Path, out: Path, record: Mapping[str, Any]) -> Summary:
    """Write tables beside the episodes, rename them to ``out``, then draw the pictures.

    Args:
        plan: All trials.
        left: Those that were played now; ``out`` holds those before.
        partial: Folder of their files.
        out: Folder of the results.
        record: What decides them.
    """
    files = sorted(task.path for task in _tasks(left, partial))
    tables = run_folder.tables_of([Episode.load(path) for path in files])
    if left.trials < plan.trials:
        tables = run_folder.joined([run_folder.read_tables(out), tables], plan.policies)
    summary, shown = summarise(tables.episodes, plan), episodes_to_show(plan, tables)
    staging = run_folder.clean_staging(partial)
    run_folder.write_tables(staging, tables, summary, record)
    run_folder.keep_episodes(staging, shown, [partial, out / run_folder.MEDIAN])
    results_folder.publish(staging, out, run_folder.KIND, later=run_folder.later(shown))
    draw(out, plan, tables)
    results_folder.remove(partial, run_folder.KIND)
    return summary


def main(args: Sequence[str] | None = None) -> int:
    """Run from the command line; the exit code is that of `wifipgo.command.command_line`."""
    kept = "interrupted; finished episodes are kept: the same command with --resume continues"
    return exit_code(lambda: evaluate(parsed(args), console=Terminal()), interrupted=kept)


if __name__ == "__main__":
    sys.exit(main())
