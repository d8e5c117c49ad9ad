"""``wifipgo reproduce``, also as ``python -m baselines.reproduce``."""

import sys
from collections.abc import Sequence

from baselines.reproduce._config import parsed
from baselines.reproduce._run import reproduce
from wifipgo.command.command_line import exit_code
from wifipgo.command.terminal import Terminal


def main(args: Sequence[str] | None = None) -> int:
    """Run from the command line; the exit code is that of `wifipgo.command.command_line`."""
    kept = "interrupted; what is finished is kept: the same command with --resume goes on"
    return exit_code(lambda: reproduce(parsed(args), console=Terminal()), interrupted=kept)


if __name__ == "__main__":
    sys.exit(main())
