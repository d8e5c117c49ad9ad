"""``python -m baselines.reproduce``."""

import sys
from collections.abc import Sequence

from rich.console import Console

from baselines._report import say
from baselines._workers import EpisodesFailedError
from baselines.reproduce._config import parsed
from baselines.reproduce._run import reproduce


def main(args: Sequence[str] | None = None) -> int:
    """Run from the command line; 0 done, 1 episodes failed, 2 refused, 130 interrupted."""
    console, errors = Console(), Console(stderr=True)
    try:
        reproduce(parsed(args), console=console)
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
        say(errors, "interrupted; what is finished is kept: the same command with --resume goes on")
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
