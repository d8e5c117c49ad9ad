"""The documentation site: its menu has every page, its anchors exist, its API has every public name.

`make docs` builds it in strict mode; these are the checks that need nothing installed for it.
"""

import fnmatch
import pkgutil
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml
from support.project_files import ROOT

DOCS = ROOT / "docs"
# Pages that are made of files beside docs/, by docs/theme/hooks.py.
MADE = {
    "changelog.md": ROOT / "CHANGELOG.md",
    "contributing.md": ROOT / "CONTRIBUTING.md",
    **{f"examples/{path.stem}.md": path for path in (ROOT / "examples").glob("*.py")},
}
FACES = (
    *("wifipgo", "wifipgo.world", "wifipgo.radio", "wifipgo.graph"),
    *("envs.rendezvous_v0", "baselines.policies", "baselines.evaluate", "train"),
)
WRITTEN = [
    *sorted(DOCS.rglob("*.md")),
    *(ROOT / f"{name}.md" for name in ("README", "CONTRIBUTING", "CHANGELOG")),
]
DESCRIPTION = "description.md"  # of the installed package
LINK = re.compile(r"(?<!!)\]\((?![a-z]+:)([^)#\s]*)(?:#([^)\s]*))?\)")
FENCE = re.compile(r"^( *)```.*?^\1```$", re.MULTILINE | re.DOTALL)

pages = pytest.mark.parametrize("page", WRITTEN, ids=lambda path: path.relative_to(ROOT).as_posix())


class _Settings(yaml.SafeLoader):
    """mkdocs.yml may have tags of MkDocs' own, which mean nothing here."""


_Settings.add_multi_constructor("", lambda *_: None)


def entries(nav: Any) -> Iterator[str]:
    """Pages of a menu, in order; ``folder/*.md`` is all there are in it."""
    if isinstance(nav, str):
        there = [path.relative_to(DOCS).as_posix() for path in DOCS.glob(nav)]
        yield from [*there, *fnmatch.filter(MADE, nav)] if "*" in nav else [nav]
    else:
        for part in nav.values() if isinstance(nav, dict) else nav:
            yield from entries(part)


def prose(path: Path) -> str:
    """A page without its programs."""
    return FENCE.sub("", path.read_text(encoding="utf-8"))


def anchors(path: Path) -> set[str]:
    """Anchors of a page's headings, as Python-Markdown makes them."""
    found: set[str] = set()
    for heading in re.findall(r"^#+ (.*)$", prose(path), re.MULTILINE):
        plain = re.sub(r"[^\w\s-]", "", re.sub(r"\]\([^)]*\)", "", heading)).strip().lower()
        name = base = re.sub(r"[-\s]+", "-", plain)
        for n in range(1, 99):
            if name not in found:
                break
            name = f"{base}_{n}"
        found.add(name)
    return found


def test_the_menu_has_every_page_once() -> None:
    menu = list(entries(yaml.load((ROOT / "mkdocs.yml").read_text("utf-8"), _Settings)["nav"]))
    written = {path.relative_to(DOCS).as_posix() for path in DOCS.rglob("*.md")} - {DESCRIPTION}
    assert sorted(menu) == sorted(written | set(MADE))


@pages
def test_anchors_exist(page: Path) -> None:
    lost = [
        f"{file}#{anchor}"
        for file, anchor in LINK.findall(prose(page))
        if anchor and anchor not in anchors((page.parent / file) if file else page)
    ]
    assert not lost


@pages
def test_lists_and_tables_are_as_the_site_reads_them(page: Path) -> None:
    """Python-Markdown wants an empty line before a list or table, and four spaces under an item."""
    lines = ["", *prose(page).splitlines()]
    items = [bool(re.match(r" *(?:[-*]|\d+\.) ", line)) for line in lines]
    rows = [line.startswith("|") for line in lines]
    wrong = [line for line in lines if re.match(r"(?: {1,3}| {5,7})(?:[-*]|\d+\.) ", line)]
    for k in range(1, len(lines)):
        text_before = bool(lines[k - 1].strip()) and not lines[k - 1].startswith((" ", "#", "<!--", ">"))
        if text_before and ((items[k] and not items[k - 1]) or (rows[k] and not rows[k - 1])):
            wrong.append(lines[k])
    assert not wrong


def test_every_public_name_is_in_the_api_reference() -> None:
    """A page shows a module by its `__all__`, so naming the module names them all."""
    shown = set(
        re.findall(r"^::: (\S+)$", "".join(p.read_text("utf-8") for p in DOCS.glob("api/*.md")), re.MULTILINE)
    )
    assert shown >= set(FACES)
    assert all(pkgutil.resolve_name(name).__all__ for name in FACES)


def test_the_description_of_the_package_leads_nowhere() -> None:
    """It is read where nothing of the checkout is: a relative link or picture would be dead."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    assert project["readme"] == f"docs/{DESCRIPTION}"
    assert "](" not in (DOCS / DESCRIPTION).read_text("utf-8")
