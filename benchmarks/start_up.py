"""How long commands take to answer: the help of all, a scenario, and what importing the library costs.

Run: ``wifipgo bench start_up [--repeats N]``. Each command runs in a process of its own; the least of its
repeats counts, processor time beside the clock, as a busy machine delays the clock alone. Exit code 1 if one
takes more processor time than its limit.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from typing import NamedTuple

from rich.table import Table

from wifipgo.command.terminal import Terminal


class Row(NamedTuple):
    """A command, and how long it may take.

    Attributes:
        words: Arguments of the interpreter.
        limit_s: Processor time on an ordinary machine; 0: shown only.
    """

    words: tuple[str, ...]
    limit_s: float = 0.0


ROWS = (
    Row(("-c", "pass")),
    Row(("-m", "wifipgo", "--help"), 0.3),
    Row(("-m", "wifipgo", "describe"), 1.5),
    Row(("-m", "wifipgo", "describe", "--list")),
    Row(("-m", "wifipgo", "evaluate", "--help")),
    Row(("-c", "import wifipgo")),
    Row(("-c", "import wifipgo; wifipgo.Scenario, wifipgo.solve")),
    Row(("-c", "import envs.rendezvous_v0")),
)


def seconds(words: Sequence[str], folder: str) -> tuple[float, float]:
    """Clock and processor time of a process."""
    before, began = os.times(), time.perf_counter()
    subprocess.run([sys.executable, *words], cwd=folder, stdout=subprocess.DEVNULL, check=True)
    clock_s, after = time.perf_counter() - began, os.times()
    used = (getattr(after, name) - getattr(before, name) for name in ("children_user", "children_system"))
    return clock_s, sum(used)


def main(args: Sequence[str] | None = None) -> int:
    """Print the table; 1 if a limit is exceeded."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeats", type=int, default=5)
    repeats = parser.parse_args(args).repeats
    table = Table(title=f"least of {repeats}, seconds", title_justify="left")
    for name in ("command", "clock", "processor", "limit"):
        table.add_column(name, justify="left" if name == "command" else "right")
    slow = False
    with tempfile.TemporaryDirectory() as folder:
        for row in ROWS:
            runs = [seconds(row.words, folder) for _ in range(repeats)]
            clock_s, used_s = (min(each) for each in zip(*runs, strict=True))
            limit = f"{row.limit_s:g}" if row.limit_s else ""
            table.add_row(" ".join(["python", *row.words]), f"{clock_s:.2f}", f"{used_s:.2f}", limit)
            slow |= 0.0 < row.limit_s < used_s
    Terminal().print(table)
    return int(slow)


if __name__ == "__main__":
    sys.exit(main())
