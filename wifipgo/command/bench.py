"""``wifipgo bench``: the benchmarks of a checkout, by name."""

import ast
import runpy
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from wifipgo.command.checkout import checkout
from wifipgo.command.command_line import exit_code, say
from wifipgo.errors import BadInputError, pick

_GUARD = 'if __name__ == "__main__"'  # what modules that benchmarks share do not have
_HELP = """usage: wifipgo bench NAME [OPTIONS]

Run a benchmark of this checkout; `wifipgo bench NAME --help` lists its options.

Benchmarks:
"""


def benchmarks(root: Path) -> dict[str, str]:
    """Names of the benchmarks of a checkout, and what each measures in a line."""
    files = sorted((root / "benchmarks").glob("[!_]*.py"))
    return {path.stem: _first_line(path) for path in files if _GUARD in path.read_text(encoding="utf-8")}


def _first_line(path: Path) -> str:
    """First line of a module's docstring, without loading the module."""
    text = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
    return text.partition("\n")[0]


def main(args: Sequence[str] | None = None) -> int:
    """Run from the command line; the exit code is that of the benchmark."""
    words = list(sys.argv[1:] if args is None else args)
    return exit_code(lambda: _run(words), interrupted="interrupted", computes=False)


def _run(words: Sequence[str]) -> None:
    """List the benchmarks, or become one of them: they ask for BLAS threads before numpy is loaded."""
    root = checkout()
    if root is None:
        raise BadInputError("the benchmarks come with a checkout of wifipgo, not with the installed package")
    known = benchmarks(root)
    if not words or words[0] in ("-h", "--help"):
        say(_HELP + listed(known))
        return
    pick(known, words[0], "benchmark")
    sys.path.insert(0, str(root))
    sys.argv = [f"wifipgo bench {words[0]}", *words[1:]]
    runpy.run_module(f"benchmarks.{words[0]}", run_name="__main__", alter_sys=True)


def listed(rows: Mapping[str, str]) -> str:
    """Names and what they are, in two columns."""
    width = max(map(len, rows))
    return "\n".join(f"  {name:{width}}  {what}" for name, what in rows.items())
