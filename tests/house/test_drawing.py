"""Whoever draws does so with a matplotlib that loads whatever a user's settings are."""

import ast

import pytest
from support.project_files import FLOORS, python_files, syntax

PROJECT = {
    name: path
    for name, path in python_files(*FLOORS, "benchmarks", "examples").items()
    if name != "wifipgo/command/figures.py"  # the one that loads it
}


def imported(node: ast.AST) -> list[str]:
    """Modules that a statement imports."""
    if isinstance(node, ast.ImportFrom):
        return [node.module or ""]
    return [alias.name for alias in node.names] if isinstance(node, ast.Import) else []


@pytest.mark.parametrize("name", PROJECT)
def test_settings_come_before_matplotlib(name: str) -> None:
    """A back-end that is not there (MPLBACKEND of a notebook) stops whoever imports matplotlib first."""
    order = [module for node in ast.walk(syntax(PROJECT[name])) for module in imported(node)]
    first = [k for k, module in enumerate(order) if module.split(".")[0] == "matplotlib"]
    assert not first or "wifipgo.command.figures" in order[: first[0]]


@pytest.mark.parametrize("name", PROJECT)
def test_no_window(name: str) -> None:
    """Figures are files; pyplot would choose a back-end, keep every figure, and open windows."""
    modules = [module for node in ast.walk(syntax(PROJECT[name])) for module in imported(node)]
    assert "matplotlib.pyplot" not in modules
