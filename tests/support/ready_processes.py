"""Processes that begin as spawned ones do, but with the libraries loaded.

A spawned process loads numpy, gtsam and the project first: two to three seconds of a core, fifty times in a
test run. Here `multiprocessing` forks it from its fork server instead: a process that was itself started new,
knows nothing of the test run or its type checks, and has loaded them once. Where it matters that a process is
started as a user's is, the fixture `spawned` gives that.
"""

import multiprocessing
from multiprocessing.context import BaseContext

LIBRARIES = ["baselines.evaluate", "train._env_workers"]
as_ever = multiprocessing.get_context


def get_context(method: str | None = None) -> BaseContext:
    """The context of a method, but that of the fork server for `spawn`."""
    return as_ever("forkserver" if method == "spawn" else method)


def install() -> None:
    """From here on processes are started so, where the system has a fork server."""
    if "forkserver" in multiprocessing.get_all_start_methods():
        multiprocessing.set_forkserver_preload(LIBRARIES)
        multiprocessing.get_context = get_context  # type: ignore[assignment]
