"""Play what is not there yet, with a bar on standard error."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rich.console import Console

from baselines.evaluation.executors import Executor
from baselines.evaluation.jobs import Failure, missing
from baselines.evaluation.progress import run_shown
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
    return run_shown(f"{label:6s}", missing(tasks), executor=executor, console=console)
