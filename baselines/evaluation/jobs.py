"""Run episodes, or other work that ends in a file, wherever the executor says."""

import traceback
from collections.abc import Callable, Hashable, Sequence
from pathlib import Path
from typing import Any, NamedTuple, Protocol

from baselines.evaluation.batches import Batch, batched
from baselines.evaluation.episodes import Episode, run_episodes
from baselines.evaluation.executors import Executor, Work
from baselines.policies.own_errors import OwnPolicyError
from wifipgo.command.command_line import say
from wifipgo.errors import BadInputError, DoubtfulError
from wifipgo.files.atomic_files import read_sealed
from wifipgo.scenarios import Scenario

FAILURES = "failures.txt"


class Item(Protocol):
    """Work that carries its seed and knows the file of its result.

    One that has what `baselines.evaluation.batches.Together` asks for is computed with others of its kind.
    """

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
    spec: str = ""  # of the policy, where its label is another

    @property
    def label(self) -> str:
        """Which episode."""
        return f"policy {self.policy}, trial {self.trial}, seed {self.seed}"

    @property
    def kind(self) -> Hashable:
        """Trials of one policy in one scenario are played together."""
        return self.scenario, self.policy, self.spec

    def compute(self) -> Episode:
        """Run it."""
        return self.compute_all([self])[0]

    def compute_all(self, items: Sequence["Task"]) -> list[Episode]:
        """Run it beside others of its kind."""
        seeds, trials = [item.seed for item in items], [item.trial for item in items]
        spec = self.spec or self.policy
        return run_episodes(self.scenario, spec, seeds, trials=trials, label=self.policy)

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
    def told(self) -> str:
        """Traceback of a policy of the user's own, if that is what raised."""
        own = isinstance(self.problem, OwnPolicyError)
        return "\n".join(str(self.problem).splitlines()[1:]) if own else ""

    @property
    def trace(self) -> str:
        """All that Python says about it, the worker's own trace included."""
        return "".join(traceback.format_exception(self.problem))


class EpisodesFailedError(DoubtfulError):
    """Some episodes raised; the others are kept."""

    def __init__(self, lines: Sequence[str], partial: Path, *, trace: str = "") -> None:
        """Name the first few episodes, show a traceback of the first, if any, and say how to go on."""
        shown = [f"failed: {line}" for line in lines[:3]]
        shown += [f"and {len(lines) - 3} more"] if len(lines) > 3 else []
        shown += [trace] if trace else []
        hint = f"traces: {partial / FAILURES}; the others are kept: --resume runs what is missing"
        super().__init__("\n".join([*shown, hint]))


def run_all(items: Sequence[Any], *, executor: Executor, on_done: Callable[[int], object]) -> list[Failure]:
    """Run every item, those of a kind in batches; one that raises stops no other.

    Args:
        items: What to run, each an `Item`.
        executor: Where, and how many at once.
        on_done: Called with the number of items that are done, or failed.

    Returns:
        What failed.
    """
    failures = []
    todo = batched(items, worlds=executor.worlds, slots=executor.slots(len(items)))
    while todo:
        again: list[Batch] = []
        for batch, problem in executor.outcomes(Work(carry_out, keep), todo):
            if problem and len(batch.items) > 1:
                again += batch.halves()  # until it is known whose problem it is; the rest is kept
                continue
            failures += [Failure(batch.label, problem)] if problem else []
            on_done(len(batch.items))
        todo = again
    return failures


def raise_if_failed(failures: Sequence[Failure], folder: Path) -> None:
    """Write down in a folder why items failed, and raise.

    Raises:
        EpisodesFailedError: There are failures.
    """
    path = folder / FAILURES
    path.unlink(missing_ok=True)
    if failures:
        path.write_text("\n".join(failure.trace for failure in failures), encoding="utf-8")
        raise EpisodesFailedError([failure.line for failure in failures], folder, trace=failures[0].told)


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


def carry_out(batch: Batch) -> Any:
    """Do the work of some items."""
    return batch.compute()


def keep(batch: Batch, results: Any) -> None:
    """Write the results of some items to their files."""
    batch.keep(results)
