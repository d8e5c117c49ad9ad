"""Which learning frameworks train on this environment: a venv each on request, a few updates, a table.

Run: ``python -m benchmarks.frameworks --frameworks sb3,torchrl``; ``--list`` names them. With ``--here`` the
programs run in the environment that this runs in, for what is installed there. Venvs are removed again.
"""

import importlib.metadata
import platform
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, NamedTuple

import tyro
from rich.table import Table

from benchmarks._framework_programs import FRAMEWORKS, whole_program
from wifipgo.command.command_line import exit_code
from wifipgo.command.terminal import Terminal
from wifipgo.errors import pick

_ROOT = Path(__file__).resolve().parents[1]
# Given first and as a constraint, so that no framework pulls a build for graphics cards.
_TORCH = "torch==2.13.0"
_TIMEOUT_S = 1200


@dataclass(frozen=True, slots=True, kw_only=True)
class FrameworksConfig:
    """What is tried."""

    frameworks: Annotated[str, tyro.conf.arg(help="Names, joined by commas; all if empty.")] = ""
    here: Annotated[bool, tyro.conf.arg(help="Install nothing; run with what is there.")] = False
    list: Annotated[bool, tyro.conf.arg(help="Only name the frameworks.")] = False


class Row(NamedTuple):
    """What came of one framework."""

    name: str
    version: str
    result: str
    steps_per_s: str


def tried_here(name: str, python: str = sys.executable) -> Row:
    """Run a framework's program with an interpreter that has it."""
    version = version_of(FRAMEWORKS[name].package, python)
    if not version:
        return Row(name, "-", "not installed", "-")
    began = time.perf_counter()
    try:
        done = subprocess.run(
            [python, "-c", whole_program(name)],
            cwd=_ROOT,
            capture_output=True,
            text=True,
            check=False,
            timeout=_TIMEOUT_S,
        )
    except subprocess.TimeoutExpired:
        return Row(name, version, f"fails: not done after {_TIMEOUT_S} s", "-")
    said = [line for line in done.stdout.splitlines() if line.startswith("agent-steps ")]
    if done.returncode or not said:
        why = (done.stderr.strip().splitlines() or ["no word"])[-1]
        return Row(name, version, f"fails: {why[:120]}", "-")
    n_steps = int(said[-1].split()[1])
    return Row(name, version, "works", f"{n_steps / (time.perf_counter() - began):.0f}")


def version_of(package: str, python: str) -> str:
    """Version of a distribution for an interpreter; empty if it is not there."""
    if python == sys.executable:
        try:
            return importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            return ""
    code = f"import importlib.metadata as m; print(m.version({package!r}))"
    done = subprocess.run([python, "-c", code], capture_output=True, text=True, check=False)
    return done.stdout.strip()


def tried_apart(name: str) -> Row:
    """Make a venv, install, run, and remove it."""
    with TemporaryDirectory(prefix=f"wifipgo-{name}-") as folder:
        python = str(Path(folder) / "bin" / "python")
        constraint = Path(folder) / "constraints.txt"
        made = subprocess.run(
            [sys.executable, "-m", "venv", folder], capture_output=True, text=True, check=False
        )
        constraint.write_text(f"{_TORCH}\n", encoding="utf-8")
        pip = [python, "-m", "pip", "install", "--quiet", "--constraint", str(constraint)]
        for needs in ([_TORCH], [f"{_ROOT}", *FRAMEWORKS[name].needs]):
            if made.returncode:
                return Row(name, "-", "fails: no venv", "-")
            made = subprocess.run([*pip, *needs], capture_output=True, text=True, check=False)
        if made.returncode:
            return Row(name, "-", f"does not install: {made.stderr.strip().splitlines()[-1][:100]}", "-")
        return tried_here(name, python)


def main() -> None:
    """Try the frameworks that are asked for, and print a table."""
    config = tyro.cli(FrameworksConfig, prog="python -m benchmarks.frameworks", description=__doc__)
    console = Terminal()
    names = [name for name in config.frameworks.split(",") if name] or list(FRAMEWORKS)
    for name in names:
        pick(FRAMEWORKS, name, "framework")
    if config.list:
        console.print("\n".join(names))
        return
    table = Table("framework", "version", "python", "result", "agent-steps/s")
    for name in names:
        row = tried_here(name) if config.here else tried_apart(name)
        console.print(f"{row.name}: {row.result}")
        table.add_row(row.name, row.version, platform.python_version(), row.result, row.steps_per_s)
    console.print(table)


if __name__ == "__main__":
    sys.exit(exit_code(main))
