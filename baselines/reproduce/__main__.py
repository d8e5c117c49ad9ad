"""``python -m baselines.reproduce``."""

import sys
from collections.abc import Sequence

from baselines._command import exit_code
from baselines.reproduce._config import parsed
from baselines.reproduce._run import reproduce


def main(args: Sequence[str] | None = None) -> int:
    """Run from the command line; 0 done, 1 episodes failed, 2 refused, 130 interrupted."""
    kept = "interrupted; what is finished is kept: the same command with --resume goes on"
    return exit_code(lambda console: reproduce(parsed(args), console=console), interrupted=kept)


if __name__ == "__main__":
    sys.exit(main())
