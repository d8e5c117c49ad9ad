"""Play what is not there yet, with a bar on standard error."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from baselines.evaluation.executors import Executor
from baselines.evaluation.jobs import EpisodesFailedError, Failure, missing, run_all
from baselines.reproduce import _folder


def played(
    label: str, tasks: Sequence[Any], *, out: Path, executor: Executor, console: Console
) -> list[Failure]:
    """Run what is missing of some items; what failed of it.

    Args:
        label: Of the bar.
        tasks: All that is needed, each an `baselines.evaluation.jobs.Item`.
        out: Folder of the reproduction.
        executor: Where.
        console: Quiet if nothing is to be shown.
    """
    _folder.note(out, [task.path for task in tasks])
    items = missing(tasks)
    columns = (TextColumn(f"{label:6s}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True, quiet=console.quiet)) as progress:
        bar = progress.add_task("", total=len(items))
        return run_all(items, executor=executor, on_done=lambda n: progress.advance(bar, n))


def raise_if_failed(failures: Sequence[Failure], out: Path) -> None:
    """Write down why items failed, and raise.

    Raises:
        EpisodesFailedError: There are failures.
    """
    (out / _folder.FAILURES).unlink(missing_ok=True)
    if failures:
        (out / _folder.FAILURES).write_text("\n".join(f.trace for f in failures), encoding="utf-8")
        raise EpisodesFailedError([failure.line for failure in failures], out)
