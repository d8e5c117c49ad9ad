"""Where the package runs from, and the command lines that belong there: how to install, how to run again."""

import shlex
import shutil
import sys
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

from wifipgo.command.own_packages import ROOT

PROGRAM = "wifipgo"
_PROJECT = "pyproject.toml"


def checkout() -> Path | None:
    """Folder of the checkout that the package runs from; None where it was installed from a wheel."""
    project = ROOT / _PROJECT
    there = project.is_file() and f'name = "{PROGRAM}"' in project.read_text(encoding="utf-8")
    return ROOT if there else None


def install_line(extra: str) -> str:
    """Command line that installs an extra for the Python that runs now."""
    root = checkout()
    what = [f"{PROGRAM}[{extra}]"] if root is None else ["-e", f"{near(root)}[{extra}]"]
    return shlex.join([*_pip(), "install", *what])


def recorded(*words: str) -> str:
    """Command line to write down: the same whoever runs it, from wherever."""
    return shlex.join([PROGRAM, *words])


def runnable(*words: str) -> str:
    """Command line to print: typed in the same folder, it runs this very installation."""
    return shlex.join([*_program(), *words])


def near(path: Path) -> str:
    """A path as one would type it: from the current folder if it lies there."""
    here = Path.cwd()
    return str(path.relative_to(here)) if path.is_relative_to(here) else str(path)


def _program() -> list[str]:
    """What starts this installation: the command where a shell finds it, else its path, else Python."""
    for script in _scripts():
        if script.is_file():
            found = shutil.which(PROGRAM)
            return [PROGRAM if found and Path(found).samefile(script) else near(script)]
    return [_python(), "-m", PROGRAM]


def _scripts() -> Iterator[Path]:
    """Where the console command may be: how this process was started, beside Python."""
    if sys.argv and Path(sys.argv[0]).name == PROGRAM:
        yield Path(sys.argv[0]).absolute()
    yield Path(sys.executable).absolute().with_name(PROGRAM)


def _python() -> str:
    """The interpreter that runs, as one would type it."""
    running = Path(sys.executable).absolute()
    names = (running.name, "python")
    found = ((name, shutil.which(name)) for name in names)
    same = [name for name, path in found if path and Path(path).absolute() == running]
    return same[-1] if same else near(running)


def _pip() -> list[str]:
    """The installer of the interpreter that runs; environments of uv have none of their own."""
    if find_spec("pip") is None and shutil.which("uv"):
        return ["uv", "pip", "--python", _python()]
    return [_python(), "-m", "pip"]
