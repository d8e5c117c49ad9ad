"""One rule for threads: linear algebra of an episode, a solve or a decision runs on one.

BLAS sums in another order on two threads than on one, so results would depend on the machine's
cores, on OMP_NUM_THREADS and on who calls. The products here are small: more threads do not pay.
"""

from collections.abc import Callable
from contextlib import ContextDecorator
from functools import cache
from threading import Lock
from typing import Any, NamedTuple

import numpy as np  # noqa: F401 (loads its BLAS, which is looked for below)
import scipy.linalg  # noqa: F401 (scipy brings one of its own)
from threadpoolctl import ThreadpoolController

_LOCK = Lock()
_OPENBLAS = tuple(
    f"{prefix}openblas_{{}}_num_threads{suffix}" for prefix in ("", "scipy_") for suffix in ("", "64_", "_64")
)


class _Blas(NamedTuple):
    """A linear algebra library that the process has loaded."""

    n_threads: Callable[[], int | None]
    use: Callable[[int], object]


class OneThread(ContextDecorator):
    """Inside, every BLAS of the process uses one thread; outside, as many as it did before.

    It may be nested and entered by several threads of a program: the last to leave gives back what was
    found. So the user's own linear algebra between two steps keeps its threads. Costs 2 us where one
    thread is all there is, 10 us otherwise.
    """

    _inside = 0
    _taken: list[tuple[_Blas, int]] = []  # noqa: RUF012 (the process has one)

    def __enter__(self) -> None:
        """Take the threads away."""
        with _LOCK:
            OneThread._inside += 1
            for blas in _loaded():
                n = blas.n_threads()
                if n is not None and n > 1:
                    OneThread._taken.append((blas, n))
                    blas.use(1)

    def __exit__(self, *_: object) -> None:
        """Give them back, if nobody else is inside."""
        with _LOCK:
            OneThread._inside -= 1
            while OneThread._taken and not OneThread._inside:
                blas, n = OneThread._taken.pop()  # the first found last
                blas.use(n)


one_thread = OneThread()


@cache
def _loaded() -> tuple[_Blas, ...]:
    """Every BLAS that the process has loaded by now: looked up once, which takes a millisecond."""
    return tuple(map(_calls, ThreadpoolController().select(user_api="blas").lib_controllers))


def _calls(library: Any) -> _Blas:
    """How to ask and tell a library; OpenBLAS directly, as threadpoolctl heeds one Python thread only."""
    if library.internal_api == "openblas":
        for name in _OPENBLAS:
            if hasattr(library.dynlib, name.format("set")):
                found = (getattr(library.dynlib, name.format(word)) for word in ("get", "set"))
                return _Blas(*found)
    return _Blas(library.get_num_threads, library.set_num_threads)
