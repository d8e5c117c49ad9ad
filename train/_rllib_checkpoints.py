"""Checkpoints of RLlib in a folder of ours: which is the last, and whether it is as it was written.

A checkpoint is a folder ``iteration-N`` that RLlib wrote, pickles included, so what is in it can run.
`RllibCheckpoints.last` hands out a folder beside its pointer only, by a plain name, without links, whose
digest is the one that was noted when it was saved. See docs/security.md.
"""

import os
import re
import shutil
from collections.abc import Iterator
from hashlib import sha256
from pathlib import Path
from typing import Any, NamedTuple

from wifipgo.errors import BadInputError, quoted, require
from wifipgo.files.atomic_files import write_json
from wifipgo.files.results_folder import note
from wifipgo.files.text_files import read_json

_NAME = re.compile(r"iteration-([0-9]{9})")
_BLOCK = 1 << 20


class Saved(NamedTuple):
    """A checkpoint: its folder, and how many iterations led to it."""

    folder: Path
    iterations: int


class RllibCheckpoints:
    """Checkpoints of one run.

    Args:
        out: Folder of the run.
    """

    def __init__(self, out: Path) -> None:
        """Nothing is written yet."""
        self.folder = out / "checkpoints"
        self._pointer = self.folder / "last.json"

    def save(self, algorithm: Any, iterations: int) -> Path:
        """Let RLlib write a checkpoint, then point to it, then remove those before it."""
        name = f"iteration-{iterations:09d}"
        unfinished, final = self.folder / f"{name}.partial", self.folder / name
        noted = (f"{unfinished.name}/", f"{name}/", self._pointer.name)
        note(self.folder.parent, [f"checkpoints/{name}" for name in noted])
        for folder in (unfinished, final):
            shutil.rmtree(folder, ignore_errors=True)
        unfinished.mkdir(parents=True)
        algorithm.save_to_path(str(unfinished.resolve()))
        digest = digest_of(unfinished)
        os.replace(unfinished, final)
        write_json(self._pointer, {"checkpoint": name, "sha256": digest})
        for folder in self.folder.glob("iteration-*"):
            if folder.name != name:
                shutil.rmtree(folder, ignore_errors=True)
        return final

    def last(self) -> Saved:
        """The last checkpoint, its digest compared.

        Raises:
            BadInputError: There is none, the pointer leads elsewhere, or a file is not as it was written.
        """
        where = str(self._pointer)
        require(self._pointer.is_file(), where, "there: no checkpoint was saved", "nothing")
        found = read_json(self._pointer)
        name = found.get("checkpoint") if isinstance(found, dict) else None
        plain = _NAME.fullmatch(name) if isinstance(name, str) else None
        if plain is None:
            rule = 'a pointer to a checkpoint beside it, {"checkpoint": "iteration-000000000", "sha256": ...}'
            raise BadInputError(f"{where} must be {rule}, got {quoted(found)}")
        folder = self.folder / plain.string
        there = folder.is_dir() and not folder.is_symlink() and not self.folder.is_symlink()
        require(there, str(folder), "there, a folder and no link", "nothing")
        same = digest_of(folder) == found.get("sha256")
        require(same, str(folder), "as it was written, with the digest in last.json", "other content")
        return Saved(folder, int(plain.group(1)))


def digest_of(folder: Path) -> str:
    """SHA-256 of the names and contents of all files in a folder.

    Raises:
        BadInputError: There is a link, or something that is no file.
    """
    found = sha256()
    for path in sorted(_entries(folder)):
        require(path.is_file() and not path.is_symlink(), str(path), "a file and no link", "something else")
        name = path.relative_to(folder).as_posix().encode()
        found.update(f"{len(name)} {path.stat().st_size} ".encode() + name)
        with path.open("rb") as file:
            while block := file.read(_BLOCK):
                found.update(block)
    return found.hexdigest()


def _entries(folder: Path) -> Iterator[Path]:
    """All that is no folder, links to folders included."""
    for inner, folders, files in os.walk(folder):
        links = [name for name in folders if (Path(inner) / name).is_symlink()]
        yield from (Path(inner) / name for name in files + links)
