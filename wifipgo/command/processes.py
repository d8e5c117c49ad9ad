"""Processes that compute: one thread each, Ctrl-C left to the parent, none that outlives it."""

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from multiprocessing.connection import Connection
from typing import TypeVar, cast

from wifipgo.errors import NumericalError

T = TypeVar("T")

# Every library that may sit under numpy reads its own.
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


@contextmanager
def one_thread_each() -> Iterator[None]:
    """Processes that start in here use one thread each for linear algebra."""
    before = {name: os.environ.get(name) for name in THREADS}
    os.environ.update(dict.fromkeys(THREADS, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            os.environ.pop(name)
            os.environ.update({name: value} if value is not None else {})


def settle_in() -> None:
    """Leave Ctrl-C to the parent, and do not outlive it: the first call in a new process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def in_a_process(job: Callable[[], T]) -> T:
    """What a function gives, worked out in a process of its own that Ctrl-C ends at once.

    Native loops that hold Python's lock let no signal through; a parent that only waits hears it.

    Args:
        job: Can be pickled, as can what it returns or raises.

    Raises:
        NumericalError: The process died.
    """
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe(duplex=False)
    worker = context.Process(target=_answer, args=(job, there), daemon=True)
    with one_thread_each():
        worker.start()
    there.close()
    try:
        answer, failure = here.recv()
    except EOFError:
        worker.join()
        raise NumericalError(f"the process that computed died (exit code {worker.exitcode})") from None
    finally:
        worker.kill()
        worker.join()
    if failure is not None:
        raise failure
    return cast("T", answer)


def _answer(job: Callable[[], object], there: Connection) -> None:
    """Send what the job returns, or what it raises."""
    settle_in()
    try:
        there.send((job(), None))
    except Exception as failure:
        there.send((None, failure))


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
