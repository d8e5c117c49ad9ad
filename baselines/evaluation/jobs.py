"""Run episodes, or other work that ends in a file, wherever the executor says."""

import traceback
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple, Protocol

from baselines.evaluation.episodes import Episode, run_episode
from baselines.evaluation.executors import Executor, Work
from wifipgo.command.command_line import say
from wifipgo.errors import BadInputError, DoubtfulError
from wifipgo.files.atomic_files import read_sealed
from wifipgo.scenarios import Scenario


class Item(Protocol):
    """Work that carries its seed and knows the file of its result."""

    @property
    def path(self) -> Path:
        """File of the result, which is there whole or not at all."""

    @property
    def label(self) -> str:
        """What it is, in a few words."""

    def compute(self) -> Any:
        """Do the work; touches no file."""

    def keep(self, result: Any) -> None:
        """Write the result to its file."""


class Task(NamedTuple):
    """One episode to run, and the file that it goes to."""

    scenario: Scenario
    policy: str
    trial: int
    seed: int
    path: Path

    @property
    def label(self) -> str:
        """Which episode."""
        return f"policy {self.policy}, trial {self.trial}, seed {self.seed}"

    def compute(self) -> Episode:
        """Run it."""
        return run_episode(self.scenario, self.policy, self.seed, trial=self.trial)

    def keep(self, result: Episode) -> None:
        """Write it down."""
        result.save(self.path)


class Failure(NamedTuple):
    """Work that raised."""

    label: str
    problem: BaseException

    @property
    def line(self) -> str:
        """What failed, and why, in a line."""
        why = str(self.problem).splitlines() or [""]
        return f"{self.label}: {type(self.problem).__name__}: {why[0]}"

    @property
    def trace(self) -> str:
        """All that Python says about it, the worker's own trace included."""
        return "".join(traceback.format_exception(self.problem))


class EpisodesFailedError(DoubtfulError):
    """Some episodes raised; the others are kept."""

    def __init__(self, lines: Sequence[str], partial: Path) -> None:
        """Name the first few episodes and say how to go on."""
        shown = [f"failed: {line}" for line in lines[:3]]
        shown += [f"and {len(lines) - 3} more"] if len(lines) > 3 else []
        hint = f"traces: {partial / 'failures.txt'}; the others are kept: --resume runs what is missing"
        super().__init__("\n".join([*shown, hint]))


def run_all(items: Sequence[Any], *, executor: Executor, on_done: Callable[[], None]) -> list[Failure]:
    """Run every item; one that raises stops no other.

    Args:
        items: What to run, each an `Item`.
        executor: Where.
        on_done: Called after each.

    Returns:
        What failed.
    """
    failures = []
    for item, problem in executor.outcomes(Work(carry_out, keep), items):
        failures += [Failure(item.label, problem)] if problem else []
        on_done()
    return failures


def missing(items: Sequence[Any]) -> list[Any]:
    """Items whose results are not there yet, or are damaged, which is said on standard error."""
    return [item for item in items if not _is_there(item.path)]


def _is_there(path: Path) -> bool:
    """Whether a result was written whole and is as it was written."""
    try:
        read_sealed(path)
    except FileNotFoundError:
        return False
    except BadInputError as problem:
        say(f"warning: {problem}; it is done again", error=True)
        return False
    return True


def carry_out(item: Any) -> Any:
    """Do the work of an `Item`."""
    return item.compute()


def keep(item: Any, result: Any) -> None:
    """Write the result of an `Item` to its file."""
    item.keep(result)
