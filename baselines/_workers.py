"""Run episodes, each to a file of its own."""

import traceback
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from baselines._episodes import Episode, run_episode
from baselines._executors import Executor, Work
from wifipgo.scenarios import Scenario


class Task(NamedTuple):
    """One episode to run, and the file that it goes to."""

    scenario: Scenario
    policy: str
    trial: int
    seed: int
    path: Path


class Failure(NamedTuple):
    """An episode that raised."""

    task: Task
    problem: BaseException

    @property
    def line(self) -> str:
        """Which episode, and why, in a line."""
        why = str(self.problem).splitlines() or [""]
        where = f"policy {self.task.policy}, trial {self.task.trial}, seed {self.task.seed}"
        return f"{where}: {type(self.problem).__name__}: {why[0]}"

    @property
    def trace(self) -> str:
        """All that Python says about it, the worker's own trace included."""
        return "".join(traceback.format_exception(self.problem))


def run_all(tasks: Sequence[Task], *, executor: Executor, on_done: Callable[[], None]) -> list[Failure]:
    """Run every task; one that raises stops no other.

    Args:
        tasks: What to run.
        executor: Where.
        on_done: Called after each task.

    Returns:
        What failed.
    """
    failures = []
    for task, problem in executor.outcomes(Work(carry_out, save), tasks):
        failures += [Failure(task, problem)] if problem else []
        on_done()
    return failures


def carry_out(task: Task) -> Episode:
    """Run one episode."""
    return run_episode(task.scenario, task.policy, task.seed, trial=task.trial)


def save(task: Task, episode: Episode) -> None:
    """Keep an episode in its file."""
    episode.save(task.path)
