"""Motion capture and survey files of a recorded run, with errors that name file and key."""

import errno
import re
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from wifipgo.errors import BadInputError, quoted, require
from wifipgo.files.text_files import read_lines

CHANNELS_5_GHZ = (7.0, 200.0)
FARTHEST_M = 1e4  # no room is larger, nor is a survey of one
_LATEST_S = 1e12
_AFTER_A_COMMA = re.compile(r"(?:^|,)\s*[-+]?0\d")  # no number begins so: it is what a decimal comma leaves
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
    lines = read_lines(path)
    _check_commas(lines, path)
    try:
        rows = [line for line in lines if _is_row(line)] or ["no samples"]
        table = np.loadtxt(rows, delimiter=",", usecols=range(5), ndmin=2)
    except ValueError as error:
        raise BadInputError(f"{path}: not a table of time and position: {error}") from error
    for name, columns, most in (("times", slice(0, 2), _LATEST_S), ("positions", slice(2, 5), FARTHEST_M)):
        within = bool((np.abs(table[:, columns]) <= most).all())
        require(within, f"{path}: {name}", f"finite numbers of at most {most:g}", table[:, columns])
    time_s = table[:, 0] + 1e-9 * table[:, 1]
    order = np.argsort(time_s, kind="stable")
    return Motion(time_s[order], table[order, 2:])


def _check_commas(lines: list[str], path: Path) -> None:
    """Refuse decimal commas: between commas they show as numbers that begin with 0, and as more columns."""
    rule = "expected numbers with a decimal point, as many as in other lines, and commas between them"
    width = next((line.count(",") for line in lines if _is_row(line)), 0)
    for at, line in enumerate(lines, 1):
        good = ";" not in line and not _AFTER_A_COMMA.search(line) and line.count(",") == width
        if _is_row(line) and not good:
            raise BadInputError(f"{path}:{at}: {rule}, got {quoted(line)}")


def _is_row(line: str) -> bool:
    """Whether a line is neither blank nor a comment."""
    return line.strip() != "" and not line.lstrip().startswith("#")


def some_files(folder: Path, pattern: str) -> list[Path]:
    """The files of a pattern, at least one."""
    found = sorted(folder.glob(pattern))
    if not found:
        raise FileNotFoundError(errno.ENOENT, "no such file", str(folder / pattern))
    return found


def first_file(folder: Path, pattern: str) -> Path:
    """The first file of a pattern."""
    return some_files(folder, pattern)[0]


def entry(table: Any, key: str, path: Path) -> Any:
    """What a table of a file holds under a key, or an error that names both."""
    if not isinstance(table, dict) or key not in table:
        raise BadInputError(f"{path}: no key {key!r}")
    return table[key]


def number(table: Any, key: str, path: Path, *, low: float, high: float) -> float:
    """A number within limits that a table of a file holds under a key."""
    value = entry(table, key, path)
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    rule = f"hold a number in {low:g}..{high:g}"
    if not is_number or not low <= value <= high:
        raise BadInputError(f"{path}: key {key!r} must {rule}, got {quoted(value)}")
    return float(value)


def surveyed_m(targets: Any, name: str, truth: Path) -> Float[np.ndarray, "3"]:
    """Place of a transmitter, map frame, m; nan if the survey does not name it."""
    if isinstance(targets, dict) and name not in targets:
        return np.full(3, np.nan)
    spot = entry(entry(targets, name, truth), "position", truth)
    told = {f"{name}.{axis}": entry(spot, axis, truth) for axis in "xyz"}
    return np.array([number(told, key, truth, low=-FARTHEST_M, high=FARTHEST_M) for key in told])


def channel_of(about: Any, truth: Path) -> int:
    """Wi-Fi channel that a survey names."""
    low, high = CHANNELS_5_GHZ
    told = {"channel": entry(entry(about, "channel", truth), "value", truth)}
    found = number(told, "channel", truth, low=low, high=high)
    require(found.is_integer(), f"{truth}: key 'channel'", "a whole number", found)
    return int(found)
