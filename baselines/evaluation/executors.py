"""Where work is carried out: in this process, in processes of its own, or on Ray.

All three give the same results, because every item carries its seed, all run the same code and linear
algebra has one thread. A process that dies takes nothing with it: its item is tried once more, then
reported, and the rest goes on.
"""

import multiprocessing
import os
import signal
import sys
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, Generic, TypeVar

from baselines.evaluation.errands import answer, carried_out, packed
from baselines.evaluation.ray_cluster import far_errand, first_line, joined, load_ray
from wifipgo.command.processes import one_thread_each, settle_in
from wifipgo.errors import pick, require

EXECUTORS: Mapping[str, str] = MappingProxyType(
    {
        "process": "a process for each job; one job runs in this process",
        "serial": "in this process, one after the other",
        "ray": "on a Ray cluster (--ray-address), or one of our own that this computer alone reaches",
    }
)
_ATTEMPTS = 2  # of an item whose process dies

Item = TypeVar("Item")
Result = TypeVar("Result")
Outcome = tuple[Item, BaseException | None]


class WorkerDiedError(RuntimeError):
    """The process that worked on an item ended without a word, each time it was tried."""

    def __init__(self, how: str) -> None:
        """Say how it ended."""
        super().__init__(f"the process died, {_ATTEMPTS} times: {how}")


@dataclass(frozen=True, slots=True)
class Work(Generic[Item, Result]):
    """What is done with an item: computed anywhere, kept where the results are."""

    compute: Callable[[Item], Result]
    keep: Callable[[Item, Result], None]

    def carry_out(self, item: Item) -> None:
        """Compute and keep."""
        self.keep(item, self.compute(item))


@dataclass(frozen=True, slots=True, kw_only=True)
class Executor:
    """A way of carrying work out.

    Attributes:
        name: A name in `EXECUTORS`.
        jobs: Items at once; 0: as many as there are cores. On a cluster, Ray decides.
        ray_address: Of an existing Ray cluster; empty: a local Ray.
        worlds: Most worlds that are played together; 0: by the size of the team.
    """

    name: str = "process"
    jobs: int = 0
    ray_address: str = ""
    worlds: int = 0

    def __post_init__(self) -> None:
        """Refuse, before anything runs, what could not run."""
        pick(EXECUTORS, self.name, "executor")
        require(self.jobs >= 0, "jobs", ">= 0", self.jobs)
        require(self.worlds >= 0, "worlds", ">= 0", self.worlds)
        fits = not self.ray_address or self.name == "ray"
        require(fits, "ray-address", "given with --executor ray only", self.ray_address)
        if self.name == "ray":
            load_ray(self.ray_address)

    def slots(self, n_items: int) -> int:
        """Items that run at once, of so many."""
        return 1 if self.name == "serial" else max(1, min(self.jobs or cores(), n_items))

    def check_script(self, n_items: int) -> None:
        """Refuse processes where they could not load the program again: a script from standard input.

        Raises:
            BadInputError: Says what to do instead.
        """
        script = getattr(sys.modules["__main__"], "__file__", None)
        lost = script is not None and not Path(script).is_file()
        apart = self.name == "process" and self.slots(n_items) > 1
        rule = "1 in a script from standard input, which other processes cannot load; or give it a file"
        require(not (lost and apart), "jobs", rule, self.jobs)

    def outcomes(self, work: Work[Item, Any], items: Sequence[Item]) -> Iterator[Outcome[Item]]:
        """Carry the work out on every item; one that raises stops no other.

        Yields:
            Each item as it ends, and what it raised.
        """
        if not items:
            return iter(())
        if self.name == "ray":
            return _on_ray(work, items, self.slots(len(items)), self.ray_address)
        here = self.slots(len(items)) == 1
        return _here(work, items) if here else _apart(work, items, self.slots(len(items)))


def cores() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _here(work: Work[Item, Any], items: Sequence[Item]) -> Iterator[Outcome[Item]]:
    for item in items:
        try:
            work.carry_out(item)
        except Exception as problem:
            yield item, problem
        else:
            yield item, None


class _Worker:
    """A process that carries out one errand after another; one that died makes room for a new one."""

    def __init__(self) -> None:
        """Prepare; the process starts with the first errand."""
        spawn = multiprocessing.get_context("spawn")
        self._pool = ProcessPoolExecutor(1, spawn, initializer=settle_in)
        self._process: multiprocessing.process.BaseProcess | None = None

    def send(self, work: Callable[[Any], Any], item: object) -> "Future[bytes]":
        """Hand over an errand."""
        before = multiprocessing.active_children()
        future = self._pool.submit(carried_out, packed(work, item))
        started = [child for child in multiprocessing.active_children() if child not in before]
        self._process = started[0] if started else self._process
        return future

    def end(self) -> str:
        """Wait until the process has ended, and tell how."""
        self._pool.shutdown(cancel_futures=True)
        code = None if self._process is None else self._process.exitcode
        if code is None or code >= 0:
            return f"exit code {code}"
        name = signal.Signals(-code).name
        return f"{name}, as when memory runs out" if name == "SIGKILL" else name


def _apart(work: Work[Item, Any], items: Sequence[Item], n: int) -> Iterator[Outcome[Item]]:
    """One pool for each job, so that a process that dies is known by its item and breaks no other."""
    waiting = deque((item, 1) for item in items)
    idle = [_Worker() for _ in range(n)]
    running: dict[Future[bytes], tuple[_Worker, Item, int]] = {}
    with one_thread_each():
        try:
            while waiting or running:
                while waiting and idle:
                    item, attempt = waiting.popleft()
                    worker = idle.pop()
                    running[worker.send(work.carry_out, item)] = worker, item, attempt
                for future in wait(running, return_when=FIRST_COMPLETED).done:
                    worker, item, attempt = running.pop(future)
                    problem = _problem_of(future, worker)
                    died = isinstance(problem, WorkerDiedError)
                    idle.append(_Worker() if died else worker)
                    if died and attempt < _ATTEMPTS:
                        waiting.appendleft((item, attempt + 1))
                    else:
                        yield item, problem
        finally:  # after Ctrl-C: those that run end and are kept
            for worker in (*idle, *(worker for worker, _, _ in running.values())):
                worker.end()


def _problem_of(future: "Future[bytes]", worker: _Worker) -> BaseException | None:
    """What an errand raised, if it did; a process that died is waited for."""
    try:
        answer(future.result())
    except BrokenProcessPool:
        return WorkerDiedError(worker.end())
    except Exception as problem:
        return problem
    return None


def _on_ray(work: Work[Item, Any], items: Sequence[Item], n: int, address: str) -> Iterator[Outcome[Item]]:
    """Compute on Ray, keep here: the computers of a cluster need not share a file system."""
    ray = load_ray(address)
    with joined(ray, address, n_cpus=n):
        compute = ray.remote(num_cpus=1, max_retries=_ATTEMPTS - 1)(far_errand())
        running = {compute.remote(packed(work.compute, item)): item for item in items}
        while running:
            for future in ray.wait(list(running))[0]:
                item = running.pop(future)
                yield item, _kept(ray, work, item, future)


def _kept(ray: Any, work: Work[Item, Any], item: Item, future: Any) -> BaseException | None:
    """Fetch a result and keep it; what went wrong, if anything did."""
    try:
        work.keep(item, answer(ray.get(future)))
    except ray.exceptions.RayError as problem:  # all else comes back as it was raised
        return WorkerDiedError(first_line(problem))
    except Exception as problem:
        return problem
    return None
