"""Whether commands that are killed, damaged or collided with lose anything.

Run: ``python -m benchmarks.crash_trials`` (30 trials, some minutes).

A trial runs a small evaluation, optimisation or training and disturbs it: kills it at a random
moment, kills one that replaces older results, flips a bit in or empties one of its files, or starts
a second run into its folder. Then the run is taken up (``--resume``, or ``--overwrite`` where there is
nothing to resume), and what it leaves is compared, to the bit, with what an undisturbed run leaves.
A file that is damaged beyond repair may be refused if the message names it; ``--overwrite`` then has
to work. Exit code 1 if anything was lost or is silently different.
"""

import contextlib
import importlib
import multiprocessing
import os
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from multiprocessing.process import BaseProcess
from pathlib import Path

import numpy as np
import tyro
from rich.table import Table

from benchmarks._crash_commands import COMMANDS, Command
from wifipgo.command.command_line import BAD_INPUT, DONE, exit_code, say
from wifipgo.command.terminal import Terminal
from wifipgo.errors import DoubtfulError

KINDS = ("kill", "kill overwrite", "flip", "empty", "collide")
SAME, REFUSED = "same", "refused by name, replaced: same"


@dataclass(frozen=True, slots=True, kw_only=True)
class CrashConfig:
    """What is disturbed how often.

    Attributes:
        trials: Of all kinds together, in turn.
        seed: Of the moments, files and bits.
    """

    trials: int = 30
    seed: int = 0


class Trials:
    """Runs of one command in a folder of their own, and what an undisturbed one leaves."""

    def __init__(self, command: Command, folder: Path, rng: np.random.Generator) -> None:
        """Run once undisturbed."""
        self.command, self.folder, self.rng = command, folder, rng
        folder.mkdir()
        self.run(folder / "warm-up")  # the first process waits for the modules to load
        begin = time.monotonic()
        code, said = self.run(folder / "undisturbed")
        self.seconds = time.monotonic() - begin
        if code:
            raise DoubtfulError(f"{command.name}: the undisturbed run ended with {code}: {said}")
        self.expected = command.left(folder / "undisturbed")

    def start(self, out: Path, *more: str) -> BaseProcess:
        """Start the command in a process of its own, whose modules are loaded already."""
        context = multiprocessing.get_context("forkserver")
        context.set_forkserver_preload([c.module for c in COMMANDS])
        args = [*self.command.arguments(self.folder), "--out", str(out), *more]
        log = out.with_name(f"{out.name}.txt")
        process = context.Process(target=_command, args=(self.command.module, args, log))
        process.start()
        return process

    def run(self, out: Path, *more: str) -> tuple[int, str]:
        """Exit code of the command, and what it said."""
        process = self.start(out, *more)
        process.join()
        return process.exitcode or 0, out.with_name(f"{out.name}.txt").read_text(errors="replace")

    def killed(self, out: Path, *more: str) -> None:
        """Kill the command at a random moment of the time that it takes."""
        process = self.start(out, *more)
        process.join(float(self.rng.uniform(0.0, 1.05)) * self.seconds)
        process.kill()
        process.join()

    def outcome(self, kind: str, out: Path) -> str:
        """Disturb a run, take it up, compare."""
        again, damaged = (self.command.take_up,), ""
        if kind == "collide":
            codes = self._collided(out)
            if codes not in ([DONE, DONE], [DONE, BAD_INPUT]):
                return f"exit codes {codes}"
        elif kind == "kill overwrite":
            self.run(out)
            self.killed(out, "--overwrite")
            again = ("--overwrite",)
        else:
            self.killed(out)
            damaged = self._damaged(out, kind)
        return self._taken_up(out, again, damaged)

    def _taken_up(self, out: Path, again: Sequence[str], damaged: str) -> str:
        """What comes out of a disturbed run in the end."""
        code, said = self.run(out, *again)
        good = SAME
        if code == BAD_INPUT and (self.command.nothing_there in said or (damaged and damaged in said)):
            good = REFUSED if damaged and damaged in said else SAME
            code, said = self.run(out, "--overwrite")
        if code:
            return f"lost: exit code {code}: {said[-200:]}"
        return good if self.command.agrees(self.command.left(out), self.expected) else "silently different"

    def _collided(self, out: Path) -> list[int]:
        """Exit codes of two runs into one folder, the second a little later."""
        first = self.start(out)
        first.join(float(self.rng.uniform(0.0, 1.0)) * self.seconds)
        second = self.run(out, "--overwrite")[0]
        first.join()
        return sorted((first.exitcode or 0, second))

    def _damaged(self, out: Path, kind: str) -> str:
        """Name of a file of the unfinished run that was damaged; empty if the kind damages none."""
        files = self.command.precious(out) if kind in {"flip", "empty"} else []
        if not files:
            return ""
        path = files[int(self.rng.integers(len(files)))]
        content = bytearray(path.read_bytes())
        if kind == "flip" and content:
            content[int(self.rng.integers(len(content)))] ^= 1 << int(self.rng.integers(8))
        path.write_bytes(content if kind == "flip" else b"")
        return path.name


def _command(module: str, args: Sequence[str], log: Path) -> None:
    """Run a command in this process; what it says goes to a file."""
    with log.open("w") as file:
        for stream in (1, 2):
            os.dup2(file.fileno(), stream)
        with contextlib.redirect_stdout(file), contextlib.redirect_stderr(file):
            code = importlib.import_module(module).main(args)
    os._exit(code)


def main(config: CrashConfig) -> None:
    """Disturb, compare, show.

    Raises:
        DoubtfulError: Something was lost or is different.
    """
    rng, found = np.random.default_rng(config.seed), Counter[tuple[str, str, str]]()
    pairs = [(command, kind) for kind in KINDS for command in COMMANDS]
    with tempfile.TemporaryDirectory() as folder:
        trials = {command.name: Trials(command, Path(folder, command.name), rng) for command in COMMANDS}
        for k in range(config.trials):
            command, kind = pairs[k % len(pairs)]
            mine = trials[command.name]
            outcome = mine.outcome(kind, mine.folder / f"{k}")
            say(f"{k + 1} of {config.trials}: {command.name}, {kind}: {outcome}", error=True)
            found[command.name, kind, outcome] += 1
    table = Table("command", "disturbed by", "afterwards", "trials", title="runs that were disturbed")
    for (name, kind, outcome), n in sorted(found.items()):
        table.add_row(name, kind, outcome, str(n))
    Terminal().print(table)
    bad = sum(n for (_, _, outcome), n in found.items() if outcome not in {SAME, REFUSED})
    if bad:
        raise DoubtfulError(f"{bad} of {config.trials} runs were lost or silently different")


if __name__ == "__main__":
    sys.exit(exit_code(lambda: main(tyro.cli(CrashConfig, description=__doc__))))
