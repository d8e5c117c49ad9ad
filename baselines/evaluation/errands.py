"""Work that travels to another process or computer, and its answer: as bytes, so that no problem is lost.

What goes wrong on the way (code that is not there, or is another) comes back as what raised,
not as a process that ended without a word.
"""

import pickle
import socket
import traceback
from collections.abc import Callable
from typing import Any

from baselines.evaluation.plan import code_digest
from wifipgo.errors import BadInputError


def packed(work: Callable[[Any], Any], item: Any) -> bytes:
    """An errand: an importable function and what it is called with, and the code that both mean."""
    return pickle.dumps((code_digest(), pickle.dumps((work, item))))


def carried_out(errand: bytes) -> bytes:
    """Run an errand where it arrived; the answer holds the result or the problem."""
    try:
        code, inside = pickle.loads(errand)
        _same(code)
        work, item = pickle.loads(inside)
        return pickle.dumps((True, work(item), ""))
    except Exception as problem:
        return _told(problem)


def answer(reply: bytes) -> Any:
    """Unpack an answer: the result, or the problem is raised, with its own trace as a note."""
    fine, value, trace = pickle.loads(reply)
    if fine:
        return value
    value.add_note(f"There:\n{trace}")
    raise value


def _same(code: str) -> None:
    """Refuse to mix results of two versions of the code."""
    here = code_digest()
    if here != code:
        where = f"on {socket.gethostname()} is {here}, where the run was started {code}"
        raise BadInputError(f"code_sha256 {where}: install the same version everywhere")


def _told(problem: Exception) -> bytes:
    """A problem as bytes; one that does not travel goes as its text."""
    trace = "".join(traceback.format_exception(problem))
    try:
        reply = pickle.dumps((False, problem, trace))
        pickle.loads(reply)
    except Exception:
        reply = pickle.dumps((False, RuntimeError(f"{type(problem).__name__}: {problem}"), trace))
    return reply
