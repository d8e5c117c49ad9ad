"""How a command ends: what went wrong in one line, and the exit code."""

from collections.abc import Callable

from rich.console import Console

from baselines._report import say
from baselines._workers import EpisodesFailedError


def exit_code(job: Callable[[Console], object], *, interrupted: str) -> int:
    """Run a command; 0 done, 1 episodes failed, 2 refused, 130 interrupted.

    Args:
        job: Takes the console to print to. What it refuses it raises as ValueError or OSError.
        interrupted: What to say when the user stops it: what is kept, and how to go on.
    """
    errors = Console(stderr=True)
    try:
        job(Console())
    except EpisodesFailedError as failure:
        say(errors, str(failure))
        return 1
    except OSError as failure:
        say(errors, f"error: {failure.filename or 'system'}: {failure.strerror or failure}")
        return 2
    except ValueError as failure:
        say(errors, f"error: {failure}")
        return 2
    except KeyboardInterrupt:
        say(errors, interrupted)
        return 130
    return 0
