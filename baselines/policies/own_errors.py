"""What is said of a policy of the user's own that raises: one sentence, then the traceback of that code."""

import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

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
    except (Exception, SystemExit) as problem:  # a program ends by itself; here an evaluation would
        raise OwnPolicyError(_message(what, problem)) from problem


def _message(what: str, problem: BaseException) -> str:
    """The sentence, and frames from the user's code on."""
    frames = problem.__traceback__
    while frames is not None and _is_on_the_way(frames.tb_frame.f_code.co_filename):
        frames = frames.tb_next
    trace = "".join(traceback.format_exception(type(problem), problem, frames)).rstrip()
    why = (str(problem).splitlines() or [""])[0]
    said = f"{type(problem).__name__}: {why}" if why else type(problem).__name__
    last = traceback.extract_tb(frames)[-1:]
    place = "".join(f" ({Path(frame.filename).name}, line {frame.lineno})" for frame in last)
    return f"{what} raised {said}{place}\n{trace}"


def _is_on_the_way(file: str) -> bool:
    """Whether a frame is ours, or Python's own that loads modules."""
    return Path(file).parent == Path(__file__).parent or "importlib" in file
