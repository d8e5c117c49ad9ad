"""What is said of a policy of the user's own that raises: one sentence, then the traceback of that code."""

import traceback
from collections.abc import Iterator
from contextlib import contextmanager

from wifipgo.errors import BadInputError


class OwnPolicyError(BadInputError):
    """Code of the user's own raised; the first line says what and where, the others are its traceback."""


@contextmanager
def told(what: str) -> Iterator[None]:
    """Raise what happens within as `OwnPolicyError`.

    Args:
        what: Subject of the sentence, e.g. ``act of policy 'mine'``.
    """
    try:
        yield
    except Exception as problem:
        raise OwnPolicyError(_message(what, problem)) from problem


def _message(what: str, problem: Exception) -> str:
    """The sentence, and frames from the user's code on; the first is the one that calls it."""
    frames = problem.__traceback__.tb_next if problem.__traceback__ else None
    trace = "".join(traceback.format_exception(type(problem), problem, frames)).rstrip()
    why = (str(problem).splitlines() or [""])[0]
    said = f"{type(problem).__name__}: {why}" if why else type(problem).__name__
    return f"{what} raised {said}\n{trace}"
