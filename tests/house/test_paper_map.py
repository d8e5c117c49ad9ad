"""docs/paper_map.md: every function and every test that it names exists.

A table row is ``| Paper | Function | Test | Departures |``. Functions are backticked
``package.module:name`` references, tests backticked ``tests/.../file.py`` or
``tests/.../file.py::name``; both may be several, separated by commas.
"""

import ast
import importlib
import re
from typing import NamedTuple

import pytest
from support.project_files import ROOT, syntax

COLUMNS = ["Paper", "Function", "Test", "Departures"]
FUNCTION = re.compile(r"(?P<module>(?:wifipgo|envs|baselines|train)(?:\.\w+)*):(?P<name>\w+(?:\.\w+)*)")
TEST = re.compile(r"(?P<path>tests/[\w/]+\.py)(?:::(?P<name>\w+(?:::\w+)*))?")
PAPER = re.compile(r"(?:Eq|Alg|Fig|Sec)\. \d+(?:\.\d+)*")

Named = ast.FunctionDef | ast.ClassDef


class Row(NamedTuple):
    """One line of the table, split into cells."""

    paper: str
    functions: str
    tests: str
    departures: str


def table() -> list[list[str]]:
    """All table lines of the page as lists of cells, without the rules under the headers."""
    page = (ROOT / "docs" / "paper_map.md").read_text(encoding="utf-8")
    lines = [line.strip() for line in page.splitlines() if line.lstrip().startswith("|")]
    cells = [[cell.strip() for cell in re.split(r"(?<!\\)\|", line.strip("|"))] for line in lines]
    return [row for row in cells if not set("".join(row)) <= set("-: ")]


def quoted(cell: str) -> list[str]:
    """What stands in backticks in a cell."""
    return re.findall(r"`([^`]+)`", cell)


ROWS = [Row(*cells) for cells in table() if cells != COLUMNS and len(cells) == len(COLUMNS)]
rows = pytest.mark.parametrize("row", ROWS, ids=lambda row: row.paper)


def test_every_line_has_the_four_columns() -> None:
    lines = table()
    assert lines[0] == COLUMNS
    assert not [line for line in lines if len(line) != len(COLUMNS)]
    assert ROWS


@rows
def test_paper_cell_names_a_place(row: Row) -> None:
    assert all(PAPER.fullmatch(place) for place in row.paper.split(", ")), row.paper


@rows
def test_functions_exist(row: Row) -> None:
    assert quoted(row.functions)
    for reference in quoted(row.functions):
        found = FUNCTION.fullmatch(reference)
        assert found, f"{reference!r} is not package.module:name"
        target: object = importlib.import_module(found["module"])
        for part in found["name"].split("."):
            assert hasattr(target, part), f"{reference}: no {part}"
            target = getattr(target, part)


@rows
def test_tests_exist(row: Row) -> None:
    assert quoted(row.tests)
    for reference in quoted(row.tests):
        found = TEST.fullmatch(reference)
        assert found, f"{reference!r} is not tests/.../file.py::name"
        body = syntax(ROOT / found["path"]).body
        for part in filter(None, (found["name"] or "").split("::")):
            named = {node.name: node.body for node in body if isinstance(node, Named)}
            assert part in named, f"{reference}: no {part}"
            body = named[part]
