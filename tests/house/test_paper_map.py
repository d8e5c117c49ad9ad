"""docs/paper_map.md: every equation has its heading, and what it names exists.

A heading names places of the paper, ``## Eq. 1: title`` or ``## Sec. 7.3, Fig. 10: title``. Under it
stand three items: *code* with backticked ``package.module:name``, *tests* with backticked
``tests/.../file.py`` or ``tests/.../file.py::name``, and *departures* in words.
"""

import ast
import importlib
import re
from typing import NamedTuple

import pytest
from support.project_files import ROOT, syntax

PAGE = (ROOT / "docs" / "paper_map.md").read_text(encoding="utf-8")
CODE = re.compile(r"(?P<module>(?:wifipgo|envs|baselines|train)(?:\.\w+)*):(?P<name>\w+(?:\.\w+)*)")
TEST = re.compile(r"(?P<path>tests/[\w/]+\.py)(?:::(?P<name>\w+(?:::\w+)*))?")
PLACE = re.compile(r"(?:Eq|Alg|Fig|Sec)\. \d+(?:\.\d+)*")
NUMBERS = {"Eq": range(1, 14), "Alg": (1, 2), "Fig": (2, 5, 7, 8, 9, 10)}
NEEDED = {f"{kind}. {number}" for kind, numbers in NUMBERS.items() for number in numbers}
LONGEST = 130

Named = ast.FunctionDef | ast.ClassDef


class Entry(NamedTuple):
    """One heading and the items under it, by their name."""

    places: list[str]
    title: str
    items: dict[str, str]


def entry(section: str) -> Entry:
    """Take a section apart."""
    head, _, body = section.partition("\n")
    places, _, title = head.partition(": ")
    parts = re.split(r"^- \*(\w+)\*:", body, flags=re.MULTILINE)
    return Entry(places.split(", "), title, dict(zip(parts[1::2], parts[2::2], strict=True)))


def quoted(text: str) -> list[str]:
    """What stands in backticks."""
    return re.findall(r"`([^`]+)`", text)


ENTRIES = [entry(section) for section in PAGE.split("\n## ")[1:]]
entries = pytest.mark.parametrize("item", ENTRIES, ids=lambda item: f"{item.places[-1]} {item.title}")


def test_every_equation_algorithm_and_figure_has_one_heading() -> None:
    places = [place for item in ENTRIES for place in item.places]
    assert set(places) >= NEEDED
    assert all(places.count(place) == 1 for place in NEEDED)
    assert not [line for line in PAGE.splitlines() if len(line) > LONGEST]


@entries
def test_an_entry_has_its_three_items(item: Entry) -> None:
    assert all(PLACE.fullmatch(place) for place in item.places), item.places
    assert item.title
    assert list(item.items) == ["code", "tests", "departures"]
    assert all(text.strip() for text in item.items.values())


@entries
def test_code_exists(item: Entry) -> None:
    assert quoted(item.items["code"])
    for reference in quoted(item.items["code"]):
        found = CODE.fullmatch(reference)
        assert found, f"{reference!r} is not package.module:name"
        target: object = importlib.import_module(found["module"])
        for part in found["name"].split("."):
            assert hasattr(target, part), f"{reference}: no {part}"
            target = getattr(target, part)


@entries
def test_tests_exist(item: Entry) -> None:
    assert quoted(item.items["tests"])
    for reference in quoted(item.items["tests"]):
        found = TEST.fullmatch(reference)
        assert found, f"{reference!r} is not tests/.../file.py::name"
        body = syntax(ROOT / found["path"]).body
        for part in filter(None, (found["name"] or "").split("::")):
            named = {node.name: node.body for node in body if isinstance(node, Named)}
            assert part in named, f"{reference}: no {part}"
            body = named[part]
