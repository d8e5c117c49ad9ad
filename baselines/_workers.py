"""Run episodes one after the other or on all cores, each to a file of its own."""

import multiprocessing
import os
import signal
import threading
import traceback
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from baselines._episodes import run_episode
from wifipgo.scenarios import Scenario

_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


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


def cores() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def run_all(tasks: Sequence[Task], *, jobs: int, on_done: Callable[[], None]) -> list[Failure]:
    """Run every task; one that raises stops no other.

    Args:
        tasks: What to run.
        jobs: Processes; 1 runs in this one.
        on_done: Called after each task.

    Returns:
        What failed.
    """
    n_processes = min(jobs, len(tasks))
    run = _run_here if n_processes <= 1 else _run_apart
    failures = []
    for failure in run(tasks, n_processes):
        failures += [failure] if failure else []
        on_done()
    return failures


def carry_out(task: Task) -> None:
    """Run one episode and save it."""
    run_episode(task.scenario, task.policy, task.seed, trial=task.trial).save(task.path)


def _run_here(tasks: Sequence[Task], n_processes: int) -> Iterator[Failure | None]:
    for task in tasks:
        try:
            carry_out(task)
        except Exception as problem:
            yield Failure(task, problem)
        else:
            yield None


def _run_apart(tasks: Sequence[Task], n_processes: int) -> Iterator[Failure | None]:
    spawn = multiprocessing.get_context("spawn")
    with _one_thread_each(), ProcessPoolExecutor(n_processes, spawn, initializer=_prepare) as pool:
        tasks_of = {pool.submit(carry_out, task): task for task in tasks}
        try:
            for future in as_completed(tasks_of):
                problem = future.exception()
                yield Failure(tasks_of[future], problem) if problem else None
        finally:
            pool.shutdown(cancel_futures=True)  # after Ctrl-C: those that run end and are saved


@contextmanager
def _one_thread_each() -> Iterator[None]:
    """Processes that start in here use one thread each for linear algebra."""
    before = {name: os.environ.get(name) for name in _THREADS}
    os.environ.update(dict.fromkeys(_THREADS, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            os.environ.pop(name)
            os.environ.update({name: value} if value is not None else {})


def _prepare() -> None:
    """Leave Ctrl-C to the parent, and do not outlive it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
