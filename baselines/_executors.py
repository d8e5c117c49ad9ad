"""Where work is carried out: in this process, in processes of its own, or on Ray.

All three give the same results, because every item carries its seed. A process that dies
takes nothing with it: its item is tried once more, then reported, and the rest goes on.
"""

import importlib
import multiprocessing
import os
import sys
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, Generic, TypeVar

from wifipgo.errors import MissingExtraError, pick, require
from wifipgo.processes import THREADS, one_thread_each, settle_in

EXECUTORS: Mapping[str, str] = MappingProxyType(
    {
        "process": "a process for each job; one job runs in this process",
        "serial": "in this process, one after the other",
        "ray": "on an existing Ray cluster (--ray-address), or a local one",
    }
)
_ATTEMPTS = 2  # of an item whose process dies

Item = TypeVar("Item")
Result = TypeVar("Result")
Outcome = tuple[Item, BaseException | None]


class WorkerDiedError(RuntimeError):
    """The process that worked on an item ended without a word, each time it was tried."""


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
    """

    name: str = "process"
    jobs: int = 0
    ray_address: str = ""

    def __post_init__(self) -> None:
        """Refuse, before anything runs, what could not run."""
        pick(EXECUTORS, self.name, "executor")
        require(self.jobs >= 0, "jobs", ">= 0", self.jobs)
        fits = not self.ray_address or self.name == "ray"
        require(fits, "ray-address", "given with --executor ray only", self.ray_address)
        if self.name == "ray":
            _ray()

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


def _apart(work: Work[Item, Any], items: Sequence[Item], n: int) -> Iterator[Outcome[Item]]:
    """One pool for each job, so that a process that dies is known by its item and breaks no other."""
    waiting = deque((item, 1) for item in items)
    idle = [_pool() for _ in range(n)]
    running: dict[Future[None], tuple[ProcessPoolExecutor, Item, int]] = {}
    with one_thread_each():
        try:
            while waiting or running:
                while waiting and idle:
                    item, attempt = waiting.popleft()
                    pool = idle.pop()
                    running[pool.submit(work.carry_out, item)] = pool, item, attempt
                for future in wait(running, return_when=FIRST_COMPLETED).done:
                    pool, item, attempt = running.pop(future)
                    problem = future.exception()
                    died = isinstance(problem, BrokenProcessPool)
                    idle.append(_replaced(pool) if died else pool)
                    if died and attempt < _ATTEMPTS:
                        waiting.appendleft((item, attempt + 1))
                    else:
                        yield item, WorkerDiedError(_DIED) if died else problem
        finally:  # after Ctrl-C: those that run end and are kept
            for pool in {*idle, *(pool for pool, _, _ in running.values())}:
                pool.shutdown(cancel_futures=True)


_DIED = f"the process died, {_ATTEMPTS} times"


def _pool() -> ProcessPoolExecutor:
    spawn = multiprocessing.get_context("spawn")
    return ProcessPoolExecutor(1, spawn, initializer=settle_in)


def _replaced(pool: ProcessPoolExecutor) -> ProcessPoolExecutor:
    pool.shutdown()
    return _pool()


def _ray() -> Any:
    """The Ray library, loaded only when it is asked for."""
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    try:
        return importlib.import_module("ray")
    except ImportError as problem:
        raise MissingExtraError("executor ray needs Ray: install the extra 'ray' (wifipgo[ray])") from problem


def _on_ray(work: Work[Item, Any], items: Sequence[Item], n: int, address: str) -> Iterator[Outcome[Item]]:
    """Compute on Ray, keep here: the computers of a cluster need not share a file system."""
    ray = _ray()
    local: dict[str, Any] = {"num_cpus": n, "include_dashboard": False}
    where = {"address": address} if address else local
    threads = {"env_vars": dict.fromkeys(THREADS, "1")}
    ray.init(**where, runtime_env=threads, log_to_driver=False, logging_level="error")
    try:
        compute = ray.remote(num_cpus=1, max_retries=_ATTEMPTS - 1)(work.compute)
        running = {compute.remote(item): item for item in items}
        while running:
            for future in ray.wait(list(running))[0]:
                item = running.pop(future)
                yield item, _kept(ray, work, item, future)
    finally:
        ray.shutdown()


def _kept(ray: Any, work: Work[Item, Any], item: Item, future: Any) -> BaseException | None:
    """Fetch a result and keep it; what went wrong, if anything did."""
    try:
        work.keep(item, ray.get(future))
    except ray.exceptions.WorkerCrashedError:
        return WorkerDiedError(_DIED)
    except Exception as problem:
        return problem
    return None
