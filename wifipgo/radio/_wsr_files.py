"""Motion capture and survey files of a recorded run, with errors that name file and key."""

import json
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from wifipgo.errors import BadInputError

MOVED_M = 0.006  # the receiver moves from when to when any coordinate is this far from its rest


class Motion(NamedTuple):
    """Motion capture of the receiver while it moves, map frame."""

    time_s: Float[np.ndarray, " samples"]
    position_m: Float[np.ndarray, "samples 3"]


def read_motion(path: Path) -> Motion:
    """Motion capture of a run, cut to the moving interval.

    Columns: seconds, nanoseconds to add, x, y, z in metres. The interval starts with the
    first sample that is more than 6 mm from the first one in any coordinate, and ends
    before the last sample that is that far from the last one.
    """
    time_s, position_m = _trajectory(path)
    left = np.flatnonzero(np.any(np.abs(position_m - position_m[:1]) > MOVED_M, axis=1))
    arriving = np.flatnonzero(np.any(np.abs(position_m - position_m[-1:]) > MOVED_M, axis=1))
    if len(left) == 0 or arriving[-1] <= left[0]:
        raise BadInputError(f"{path}: the receiver never moves more than {1e3 * MOVED_M:.0f} mm")
    return Motion(time_s[left[0] : arriving[-1]], position_m[left[0] : arriving[-1]])


def _trajectory(path: Path) -> Motion:
    """All samples of a trajectory file, in order of time."""
    lines = path.read_text("utf-8").splitlines()
    try:
        table = np.loadtxt(lines or ["no samples"], delimiter=",", usecols=range(5), ndmin=2)
    except ValueError as error:
        raise BadInputError(f"{path}: not a table of time and position: {error}") from error
    if not np.isfinite(table).all():
        raise BadInputError(f"{path}: times and positions must be finite numbers")
    time_s = table[:, 0] + 1e-9 * table[:, 1]
    order = np.argsort(time_s, kind="stable")
    return Motion(time_s[order], table[order, 2:])


def some_files(folder: Path, pattern: str) -> list[Path]:
    """The files of a pattern, at least one."""
    found = sorted(folder.glob(pattern))
    if not found:
        raise FileNotFoundError(f"{folder / pattern}: no such file")
    return found


def first_file(folder: Path, pattern: str) -> Path:
    """The first file of a pattern."""
    return some_files(folder, pattern)[0]


def from_json(text: str, path: Path) -> Any:
    """JSON of a file, or an error that names it."""
    try:
        return json.loads(text)
    except json.JSONDecodeError as error:
        raise BadInputError(f"{path}: not JSON: {error}") from error


def entry(table: Any, key: str, path: Path) -> Any:
    """What a table of a file holds under a key, or an error that names both."""
    if not isinstance(table, dict) or key not in table:
        raise BadInputError(f"{path}: no key {key!r}")
    return table[key]


def number(table: Any, key: str, path: Path) -> float:
    """A number that a table of a file holds under a key."""
    value = entry(table, key, path)
    if not isinstance(value, int | float):
        raise BadInputError(f"{path}: key {key!r} must hold a number, got {value!r}")
    return float(value)
