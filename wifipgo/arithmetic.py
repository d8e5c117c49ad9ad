"""Floating point as this package was written for, whatever ``numpy.seterr`` says in the program around it."""

import functools
from collections.abc import Callable
from contextvars import ContextVar
from typing import ParamSpec, TypeVar

import numpy as np

P = ParamSpec("P")
T = TypeVar("T")

# Whether a function around this one has seen to it: asking numpy each time would cost more than the check.
_SEEN_TO: ContextVar[bool] = ContextVar("_SEEN_TO", default=False)


def plain_arithmetic(function: Callable[P, T]) -> Callable[P, T]:
    """Tails of likelihoods and of weights underflow to 0 by design; everything else warns, as by default."""
    return _within(function, np.errstate(divide="warn", over="warn", under="ignore", invalid="warn"))


def harmless_underflow(function: Callable[P, T]) -> Callable[P, T]:
    """For functions of the library: what underflows is 0, whatever ``np.seterr`` in a user's program says."""
    return _within(function, np.errstate(under="ignore"))


def _within(function: Callable[P, T], state: np.errstate) -> Callable[P, T]:
    """Run in a state of numpy's errors, once for all that is called on the way."""
    guarded = state(function)

    @functools.wraps(function)
    def called(*args: P.args, **kwargs: P.kwargs) -> T:
        if _SEEN_TO.get():
            return function(*args, **kwargs)
        token = _SEEN_TO.set(True)
        try:
            return guarded(*args, **kwargs)
        finally:
            _SEEN_TO.reset(token)

    return called
