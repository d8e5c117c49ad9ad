"""Names in the documentation: what stands in backticks as a module, a function or a file exists."""

import ast
import importlib
import re
from pathlib import Path
from types import ModuleType

import pytest
from support.project_files import ROOT

PAGES = sorted(
    path.relative_to(ROOT).as_posix()
    for path in (*(ROOT / "docs").rglob("*.md"), ROOT / "README.md", ROOT / "CONTRIBUTING.md")
)
NAME = re.compile(r"`((?:wifipgo|envs|baselines|train)(?:\.\w+)+)(?:[:(][^`]*)?`")
FILE = re.compile(r"`((?:wifipgo|envs|baselines|train|benchmarks|examples|tests)/[\w/.-]+\.\w+)(?:::\w+)?`")
LINK = re.compile(r"\]\((?!https?:)([^)#]+)(?:#[^)]*)?\)")
# Settings of a training file, whose tables are called as packages are; files that a training writes.
SETTINGS = {
    *(
        "envs.endless",
        "envs.interface",
        "envs.n_envs",
        "envs.n_phases",
        "envs.n_workers",
        "envs.others",
        "envs.overrides",
    ),
    "training.npz",
}
GLOSSARY = (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8")

pages = pytest.mark.parametrize("page", PAGES)


def found(name: str) -> object:
    """What a dotted name means: the longest part that is a module, then attributes of it."""
    parts = name.split(".")
    module: ModuleType | None = None
    for n in range(1, len(parts) + 1):
        try:
            module = importlib.import_module(".".join(parts[:n]))
        except ModuleNotFoundError:
            break
    file = ROOT / f"{'/'.join(parts[:-1])}.py"
    if module is not None and module.__name__ not in {name, ".".join(parts[:-1])} and file.is_file():
        return defined_in(file, parts[-1])
    thing: object = module
    for part in [] if module is None else parts[len(module.__name__.split(".")) :]:
        thing = getattr(thing, part, None)
    return thing


def defined_in(path: Path, name: str) -> object:
    """A class or function of a module that does not load here, for want of a package."""
    body = ast.parse(path.read_text("utf-8")).body
    defined = (node for node in body if isinstance(node, ast.ClassDef | ast.FunctionDef))
    return next((node for node in defined if node.name == name), None)


@pages
def test_names_exist(page: str) -> None:
    names = set(NAME.findall((ROOT / page).read_text(encoding="utf-8"))) - SETTINGS
    assert not [name for name in sorted(names) if found(name) is None]


@pages
def test_files_and_links_exist(page: str) -> None:
    text = (ROOT / page).read_text(encoding="utf-8")
    assert not [name for name in FILE.findall(text) if not (ROOT / name).is_file()]
    assert not [name for name in LINK.findall(text) if not ((ROOT / page).parent / name).exists()]


def test_the_glossary_is_in_order_and_says_where() -> None:
    rows = [
        [cell.strip() for cell in line.strip("|").split("|")] for line in GLOSSARY.splitlines() if "|" in line
    ]
    terms = rows[2:]
    assert all(len(row) == 4 and row[0] and row[2] and NAME.search(row[3]) for row in terms)
    names = [row[0] for row in terms]
    assert names == sorted(names, key=str.casefold)
