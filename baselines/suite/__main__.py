"""``wifipgo suite``, also as ``python -m baselines.suite``."""

import sys
from collections.abc import Sequence

from baselines.suite.config import parsed
from baselines.suite.run import play_suite
from wifipgo.command.command_line import exit_code
from wifipgo.command.terminal import Terminal


def main(args: Sequence[str] | None = None) -> int:
    """Run from the command line; the exit code is that of `wifipgo.command.command_line`."""
    kept = "interrupted; what was played is kept: the same command with --resume continues"
    return exit_code(lambda: play_suite(parsed(args), console=Terminal()), interrupted=kept)


if __name__ == "__main__":
    sys.exit(main())
