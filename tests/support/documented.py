"""Programs, files and commands that README and documentation show, as a reader would copy them."""

import re
import shlex
from pathlib import Path
from typing import NamedTuple

from support.project_files import ROOT

PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
_FENCE = re.compile(r"^```(\w*)([^\n]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_TITLE = re.compile(r'title="([^"]+)"')
_FIRST_LINE = re.compile(r"# (\S+\.toml)\n")
# What a comment at the end of a command says if it is not to be run here: how long, or what it needs.
_LONG = re.compile(r"\b(minutes?|hours?|needs)\b")
_INLINE = re.compile(
    r"`((?:\.venv/bin/)?(?:wifipgo|python -m (?:baselines|envs|train|wifipgo)[^\s`]*) [^`$<]+)`"
)


class Block(NamedTuple):
    """A fenced block of a page.

    Attributes:
        language: As the page names it; empty if it does not.
        file: The file that it is, if it has a name.
        text: What stands in it.
    """

    language: str
    file: str
    text: str


class Command(NamedTuple):
    """A command line.

    Attributes:
        words: Without the comment, and without the folder of the environment.
        long: Whether it is marked as one that takes minutes, or needs what is not here.
    """

    words: tuple[str, ...]
    long: bool


def blocks(page: Path) -> list[Block]:
    """Fenced blocks of a page, in order."""
    found = _FENCE.findall(page.read_text(encoding="utf-8"))
    return [Block(language, _name(head, text), text) for language, head, text in found]


def _name(head: str, text: str) -> str:
    title, first = _TITLE.search(head), _FIRST_LINE.match(text)
    return title[1] if title else first[1] if first else ""


def commands(text: str) -> list[Command]:
    """Command lines of a block."""
    lines = (line for line in text.replace("\\\n", " ").splitlines() if line.strip())
    return [_command(line) for line in lines]


def inline_commands(page: Path) -> list[Command]:
    """Command lines within sentences and tables, none of which is run."""
    prose = _FENCE.sub("", page.read_text(encoding="utf-8"))
    return [_command(" ".join(text.split())) for text in _INLINE.findall(prose)]


def _command(line: str) -> Command:
    words = shlex.split(line, comments=True)
    _, _, comment = line.partition("   #")
    return Command((words[0].removeprefix(".venv/bin/"), *words[1:]), bool(_LONG.search(comment)))
