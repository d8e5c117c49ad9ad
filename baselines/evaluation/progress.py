"""Work that is carried out while a bar on standard error says how far it is."""

from collections.abc import Sequence
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from baselines.evaluation.executors import Executor
from baselines.evaluation.jobs import Failure, run_all


def run_shown(label: str, items: Sequence[Any], *, executor: Executor, console: Console) -> list[Failure]:
    """Run items under a bar; what failed of them.

    Args:
        label: Of the bar.
        items: What to run, each an `baselines.evaluation.jobs.Item`.
        executor: Where.
        console: Quiet if nothing is to be shown.
    """
    columns = (TextColumn(label), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True, quiet=console.quiet)) as progress:
        bar = progress.add_task("", total=len(items))
        return run_all(items, executor=executor, on_done=lambda n: progress.advance(bar, n))
