"""Floors and wings: an import only goes down, and two libraries stay in one room each."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest
from support.project_files import FLOORS, ROOT, nodes, python_files

ONLY_IMPORTER = {"pymunk": "wifipgo/world/arena.py", "gtsam": "wifipgo/graph/solvers/"}
LEARNING = {"gymnasium", "pettingzoo", "stable_baselines3", "torch", "ray"}
CONTRACTS = (
    "import importlinter.cli as lint; raise SystemExit(lint.lint_imports(no_cache=True, no_logo=True))"
)


def imported(path: Path) -> set[str]:
    """Top-level names of everything that a module imports, wherever in it."""
    found = list(nodes(path))
    plain = {alias.name for node in found if isinstance(node, ast.Import) for alias in node.names}
    whole = {node.module for node in found if isinstance(node, ast.ImportFrom) and node.module}
    return {name.split(".")[0] for name in plain | whole}


def test_import_contracts_hold() -> None:
    """The contracts of pyproject.toml: four floors, three wings."""
    command = [sys.executable, "-c", CONTRACTS]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stdout + run.stderr


@pytest.mark.parametrize("library", ONLY_IMPORTER)
def test_one_place_imports_the_library(library: str) -> None:
    importers = [name for name, path in python_files(*FLOORS).items() if library in imported(path)]
    assert not [name for name in importers if not name.startswith(ONLY_IMPORTER[library])]


def test_library_knows_no_learning() -> None:
    found = {name: LEARNING & imported(path) for name, path in python_files("wifipgo").items()}
    assert not {name: libraries for name, libraries in found.items() if libraries}
