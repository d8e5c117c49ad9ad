"""Work that ends its own process, as importable functions: a process that starts has to find them."""

import os
import signal
from pathlib import Path
from typing import NamedTuple


class Errand(NamedTuple):
    """A number to write into a folder; ``deaths`` times the process dies before that."""

    folder: Path
    number: int
    deaths: int


class OddError(Exception):
    """Cannot be rebuilt from its message, so it does not travel between processes."""

    def __init__(self, one: int, two: int) -> None:
        """Make a message of both."""
        super().__init__(f"{one} and {two}")


def fail_oddly(_: object) -> None:
    """Raise it."""
    raise OddError(1, 2)


def compute(errand: Errand) -> int:
    """Die as often as asked for, then square the number."""
    marks = len(list(errand.folder.glob(f"died-{errand.number}-*")))
    if marks < errand.deaths:
        (errand.folder / f"died-{errand.number}-{marks}").touch()
        os.kill(os.getpid(), signal.SIGKILL)
    if errand.number < 0:
        raise ValueError("a number below zero")
    return errand.number**2


def keep(errand: Errand, square: int) -> None:
    """Write the result down."""
    (errand.folder / f"{errand.number}").write_text(str(square))
