"""How every command ends: exit codes, errors in one line, and text that a terminal can take.

====  ==========================================================================
code  meaning
====  ==========================================================================
0     done
1     done, but the answer is doubtful or incomplete (`wifipgo.errors.DoubtfulError`)
2     bad input: `wifipgo.errors.BadInputError`, a path of the user's, the command line
3     a computation failed (`wifipgo.errors.NumericalError`)
70    a defect of this program: with its traceback, worth a report
130   interrupted (Ctrl-C; while modules still load: `wifipgo.command.early_interrupts`)
141   nobody reads standard output any more
====  ==========================================================================

A command is ``main``, which returns the code, and a job, which raises::

    def main(args: Sequence[str] | None = None) -> int:
        return exit_code(lambda: work(parsed(args)))

    if __name__ == "__main__":
        sys.exit(main())

What it prints goes through `say`, or through a `wifipgo.command.terminal.Terminal` where it prints tables.
"""

import os
import sys
import traceback
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext, suppress
from io import TextIOWrapper
from typing import IO, Any
from unicodedata import category

from wifipgo.command.early_interrupts import unwatch
from wifipgo.errors import BadInputError, DoubtfulError, NumericalError
from wifipgo.files.made_files import made_since, mark

# Files that are named when a command is stopped.
_NAMED = 4
DONE, DOUBTFUL, BAD_INPUT, NUMERICAL, DEFECT, INTERRUPTED, UNREAD = 0, 1, 2, 3, 70, 130, 141


def exit_code(
    job: Callable[[], object],
    *,
    interrupted: str = "",
    computes: bool = True,
) -> int:
    """Run a command and say how it ended.

    Args:
        job: Reads the command line and works. `ValueError` and `RuntimeError` other than the
            named ones are defects: what the user gave is refused where it is read.
        interrupted: What to say when the user stops it: what is kept, and how to go on. Without it, which
            files are there.
        computes: Whether linear algebra is done, on one thread; without it numpy is not loaded.
    """
    _replace_what_cannot_be_shown()
    began = mark()
    try:
        threads = _one_thread() if computes else nullcontext()  # loads: before the next line
        unwatch()
        with threads:
            job()
        _flush(sys.stdout)
    except KeyboardInterrupt:
        return _ended(INTERRUPTED, interrupted or f"interrupted; {_kept(began)}")
    except Exception as failure:
        return _ended(*_code_and_message(failure))
    return DONE


def _kept(moment: int) -> str:
    """What a command that was stopped has written since it began."""
    names = [str(path) for path in made_since(moment)]
    more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    return f"whole, and kept: {', '.join(names[:_NAMED])}{more}" if names else "nothing was written"


def _one_thread() -> AbstractContextManager[object]:
    """Block in which linear algebra has one thread."""
    from wifipgo.threads import one_thread  # noqa: PLC0415 (loads numpy and scipy, which help does without)

    return one_thread


def _code_and_message(failure: Exception) -> tuple[int, str]:
    """What a failure means to a shell, and to whoever reads it."""
    match failure:
        case DoubtfulError():
            return DOUBTFUL, str(failure)
        case NumericalError():
            return NUMERICAL, f"error: {failure}"
        case BadInputError():
            return BAD_INPUT, f"error: {failure}"
        case BrokenPipeError() if _nobody_reads():
            return UNREAD, ""
        case OSError() if not isinstance(failure, BrokenPipeError):
            return BAD_INPUT, f"error: {failure.filename or 'system'}: {failure.strerror or failure}"
    trace = "".join(traceback.format_exception(failure))
    return DEFECT, f"{trace}this is a defect of the program, please report it"


def say(text: str, *, error: bool = False) -> None:
    """Print lines as they are, to standard output or standard error."""
    print(printable(text), file=sys.stderr if error else sys.stdout)


def printable(text: str) -> str:
    r"""Text in which control characters are spelled out (``\x1b``), so that no name steers a terminal.

    Line ends and tabs stay. What reorders the line (U+202E and its like) is spelled out too.
    """
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() or c in "\n\t" or category(c) == "Zs" else _spelled(c) for c in text)


def _spelled(character: str) -> str:
    """A character as Python writes it, without the quotes."""
    return character.encode("unicode_escape", "surrogatepass").decode("ascii")


def _replace_what_cannot_be_shown() -> None:
    """Let an encoding without a character show ``?`` for it; results are not lost for a sign."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="replace")


def _ended(code: int, message: str = "") -> int:
    """Say why, leave nothing for the interpreter to stumble over when it flushes, and give the code."""
    if message:
        with suppress(OSError):
            say(message, error=True)
    for stream in (sys.stdout, sys.stderr):
        try:
            _flush(stream)
        except OSError:
            _discard(stream)
    return code


def _flush(stream: IO[str] | Any) -> None:
    """Bring out what was printed; a process may have no such stream."""
    if stream is not None and not stream.closed:
        stream.flush()


def _nobody_reads() -> bool:
    """Whether standard output is the pipe that broke, rather than one to a process of ours."""
    try:
        sys.stdout.write("\n")
        sys.stdout.flush()
    except OSError:
        return True
    return False


def _discard(stream: IO[str] | Any) -> None:
    """Point a stream that takes nothing any more to where everything is taken."""
    with suppress(OSError, ValueError):  # a stream without a file
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)
