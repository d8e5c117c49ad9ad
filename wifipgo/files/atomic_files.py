"""Files that are there whole or not at all: written under another name, then renamed."""

import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from hashlib import sha256
from pathlib import Path

from wifipgo.errors import BadInputError
from wifipgo.files.made_files import note_made


@contextmanager
def appearing(path: Path, *, by_suffix: bool = False) -> Iterator[Path]:
    """Give a name to write to; what is there at the end without failure gets the real name.

    Args:
        path: The real name.
        by_suffix: Whether the writer goes by the suffix, which the other name then keeps. Otherwise that
            ends in ``.tmp``, so that nobody who looks for files of a kind finds it.
    """
    name = f".{path.stem}.partial{path.suffix}" if by_suffix else f"{path.name}.tmp"
    unfinished = path.with_name(name)
    try:
        unfinished.unlink(missing_ok=True)
        os.close(os.open(unfinished, _NEW, 0o666))
        yield unfinished
        _on_disk(unfinished)
        os.replace(unfinished, path)
        note_made(path)
    except OSError as failure:
        if str(failure.filename) != str(unfinished):
            raise
        raise OSError(failure.errno, failure.strerror, str(path)) from failure  # the name that was asked for
    finally:
        unfinished.unlink(missing_ok=True)


def _on_disk(path: Path) -> None:
    """Wait until a file has reached the disk: a power cut must not leave the name without the content."""
    with path.open("r+b") as file:
        os.fsync(file.fileno())


def write_text(path: Path, text: str) -> None:
    """Write a text file as UTF-8."""
    with appearing(path) as unfinished:
        unfinished.write_text(text, encoding="utf-8")


def write_json(path: Path, content: object, *, allow_nan: bool = False) -> None:
    """Write a JSON file, and the folder that it is in.

    Args:
        path: Where to.
        content: What `json` can write.
        allow_nan: Whether numbers that JSON does not have are written as Python writes them, not refused.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, json.dumps(content, indent=2, allow_nan=allow_nan) + "\n")


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file of bytes, and the folder that it is in."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with appearing(path) as unfinished:
        unfinished.write_bytes(content)


def write_sealed(path: Path, content: bytes) -> None:
    """Write bytes, and behind them their SHA-256, by which `read_sealed` knows damage."""
    with appearing(path) as unfinished:
        unfinished.write_bytes(content + sha256(content).digest())


def read_sealed(path: Path) -> bytes:
    """Read what `write_sealed` wrote.

    Raises:
        BadInputError: The file was damaged or cut short; names it.
    """
    content = path.read_bytes()
    if sha256(content[:-_SEAL]).digest() != content[-_SEAL:]:
        raise BadInputError(f"{path}: damaged: its digest is of other content")
    return content[:-_SEAL]


_NEW = os.O_CREAT | os.O_EXCL | os.O_WRONLY | getattr(os, "O_NOFOLLOW", 0)  # writes through no link
_SEAL = sha256().digest_size
