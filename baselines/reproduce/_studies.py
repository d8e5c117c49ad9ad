"""Studies: beside the paper's figures, what is not judged as the paper; each has a page of its own."""

import shutil
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console

from baselines.reproduce import _folder
from baselines.reproduce._figures import STUDIES
from wifipgo.command.terminal import say
from wifipgo.files.text_files import read_json


def publish(names: Sequence[str], out: Path, docs: Path | None, console: Console) -> None:
    """Write the page of every study that is there, and put it and its picture into the documentation."""
    for name in names:
        if name in STUDIES and _folder.done(out, name):
            say(console, f"{name}: read {_write(name, out / name, f'{name}.png')}")
            if docs is not None:
                _document(name, out / name, docs)


def _write(name: str, folder: Path, picture: str, to: Path | None = None) -> Path:
    """The page, made of the data beside it."""
    run = read_json(folder / _folder.CLAIMS)["run"]
    path = to or folder / f"{name}.md"
    path.write_text(STUDIES[name].page(folder, run, picture), encoding="utf-8")
    return path


def _document(name: str, folder: Path, docs: Path) -> None:
    (docs / "pictures").mkdir(parents=True, exist_ok=True)
    if (folder / f"{name}.png").is_file():  # not where data are missing
        shutil.copyfile(folder / f"{name}.png", docs / "pictures" / f"{name}.png")
    _write(name, folder, f"pictures/{name}.png", docs / f"{name}.md")
