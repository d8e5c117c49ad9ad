"""Tables of numbers in text files: columns by name, `#` before comments, and faults by their line."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from wifipgo.errors import TextFileError
from wifipgo.files.text_files import number, read_lines


class Columns(NamedTuple):
    """Rows of numbers, and where in the file each of them stands.

    Attributes:
        source: The file.
        rows: One row a line that is neither empty nor a comment.
        line: Its number, from 1.
    """

    source: str
    rows: Float[np.ndarray, "rows columns"]
    line: Int[np.ndarray, " rows"]

    def refuse(self, bad: Bool[np.ndarray, " rows"], expected: str) -> None:
        """Raise at the first bad row, if there is one.

        Raises:
            TextFileError: Names its line and what it holds.
        """
        if bad.any():
            at = int(np.flatnonzero(bad)[0])
            got = " ".join(f"{value:.10g}" for value in self.rows[at])
            raise TextFileError(self.source, int(self.line[at]), expected, got)

    def keep(self, rows: Bool[np.ndarray, " rows"]) -> "Columns":
        """Some of the rows."""
        return Columns(self.source, self.rows[rows], self.line[rows])


def read_columns(path: Path, names: Sequence[str]) -> Columns:
    """Numbers of a file, as many in every line as there are names.

    Raises:
        TextFileError: A line has other than as many finite numbers; names the line and the columns.
        OSError: It cannot be read.
    """
    lines = [(k, line) for k, line in enumerate(read_lines(path), 1) if line.partition("#")[0].strip()]
    rows = _quickly([line for _, line in lines])
    if rows is None or rows.shape[1] != len(names):
        rows = np.array([_row(line, names, str(path), k) for k, line in lines]).reshape(-1, len(names))
    found = Columns(str(path), rows, np.array([k for k, _ in lines], dtype=np.int64))
    found.refuse(~np.isfinite(rows).all(axis=1), f"finite numbers: {', '.join(names)}")
    return found


def no_columns(path: Path, names: Sequence[str]) -> Columns:
    """What a file that is not there holds."""
    return Columns(str(path), np.zeros((0, len(names))), np.zeros(0, dtype=np.int64))


def refuse_unsorted(found: Columns) -> None:
    """Refuse time stamps, in the first column, that go back.

    Raises:
        TextFileError: Names the first line that is earlier than the one before.
    """
    back = np.zeros(len(found.rows), dtype=bool)
    back[1:] = np.diff(found.rows[:, 0]) < 0.0
    if back.any():
        before = found.rows[int(np.flatnonzero(back)[0]) - 1, 0]
        found.refuse(back, f"time stamps in ascending order, after {before:.10g}")


def _quickly(lines: list[str]) -> Float[np.ndarray, "rows columns"] | None:
    """All numbers at once, if that is what the lines hold."""
    try:
        return np.loadtxt(lines, ndmin=2) if lines else None
    except ValueError:
        return None


def _row(line: str, names: Sequence[str], source: str, k: int) -> list[float]:
    """Numbers of one line, checked one by one."""
    words = line.partition("#")[0].split()
    if len(words) != len(names):
        raise TextFileError(source, k, f"{len(names)} numbers: {', '.join(names)}", f"{len(words)}")
    return [number(word, source, k) for word in words]
