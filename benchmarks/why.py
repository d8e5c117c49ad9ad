"""What a trained policy does that the best rule does not, what of its input it uses, and where it fails.

Run: ``wifipgo bench why --policies team_plan,mine=ppo:path=FILE --out results/why``. All play the same
worlds, on which nothing was trained or chosen.
"""

import sys
from collections.abc import Sequence

from baselines.conduct.config import parsed
from baselines.conduct.run import explain
from wifipgo.command.command_line import exit_code
from wifipgo.command.terminal import Terminal


def main(args: Sequence[str] | None = None) -> int:
    """Run from the command line; the exit code is that of `wifipgo.command.command_line`."""
    kept = "interrupted; what was played is kept: the same command with --resume continues"
    return exit_code(lambda: explain(parsed(args), console=Terminal()), interrupted=kept)


if __name__ == "__main__":
    sys.exit(main())
