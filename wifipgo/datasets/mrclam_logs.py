"""Files of one run of UTIAS MRCLAM, as they are: odometry, sightings and motion capture of each robot.

K. Y. K. Leung, Y. Halpern, T. D. Barfoot, H. H. T. Liu, *The UTIAS multi-robot cooperative localization and
mapping dataset*, IJRR 2011. Stamps are kept as they are, in s.
"""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from wifipgo.datasets.columns import Columns, no_columns, read_columns, refuse_unsorted
from wifipgo.errors import TextFileError, require

ODOMETRY = ("time (s)", "forward velocity (m/s)", "angular velocity (rad/s)")
SIGHTINGS = ("time (s)", "barcode", "range (m)", "bearing (rad)")
TRUTH = ("time (s)", "x (m)", "y (m)", "orientation (rad)")
_BARCODES = ("subject", "barcode")
_LANDMARKS = ("subject", "x (m)", "y (m)", "x std-dev (m)", "y std-dev (m)")
_FILE = re.compile(r"Robot(\d+)_(?:Odometry|Measurement|Groundtruth)\.dat")


class RobotLog(NamedTuple):
    """What one robot recorded, and what was recorded of it.

    Attributes:
        number: Its subject number.
        odometry: Columns `ODOMETRY`; at least two rows.
        sightings: Columns `SIGHTINGS`; no rows where there is no file.
        truth: Columns `TRUTH`, each stamp once; no rows where there is no file.
        n_twice: Rows of odometry and of truth whose stamp the row before has, too.
    """

    number: int
    odometry: Columns
    sightings: Columns
    truth: Columns
    n_twice: tuple[int, int]


class Logs(NamedTuple):
    """A run.

    Attributes:
        robots: In the order of their numbers.
        left_out: Numbers of robots that have files and were not asked for.
        subject_of: Subject number of each barcode.
        landmarks: Columns subject, x, y, and their deviations; no rows where there is no file.
    """

    robots: tuple[RobotLog, ...]
    left_out: tuple[int, ...]
    subject_of: Mapping[int, int]
    landmarks: Columns


def read_logs(folder: Path, robots: Sequence[int] | None = None) -> Logs:
    """Read a run.

    Args:
        folder: Where its files are.
        robots: Subject numbers of the robots to read; all that have a file if left out.

    Raises:
        BadInputError: There are no such robots, one has no odometry, or a file says what cannot be; names
            the file and the line.
    """
    require(folder.is_dir(), "folder", "a folder with the .dat files of an MRCLAM run", str(folder))
    there = sorted({int(m[1]) for path in folder.iterdir() if (m := _FILE.fullmatch(path.name))})
    require(bool(there), str(folder), "a folder with files RobotN_Odometry.dat", _names(folder))
    wanted = there if robots is None else sorted(robots)
    known = len(set(wanted)) == len(wanted) > 0 and set(wanted) <= set(there)
    require(known, "robots", f"some of {there}, each once", robots)
    return Logs(
        tuple(_robot(folder, n) for n in wanted),
        tuple(n for n in there if n not in wanted),
        _subject_of(_needed(folder / "Barcodes.dat", _BARCODES, "subject numbers of barcodes")),
        _optional(folder / "Landmark_Groundtruth.dat", _LANDMARKS),
    )


def _names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())[:10]


def _robot(folder: Path, n: int) -> RobotLog:
    """Files of one robot."""
    file = folder / f"Robot{n}_Odometry.dat"
    odometry = _needed(file, ODOMETRY, f"odometry of robot {n}; robots= leaves robots out")
    if len(odometry.rows) < 2 or odometry.rows[0, 0] == odometry.rows[-1, 0]:
        raise TextFileError(str(file), 0, "two or more times of odometry", f"{len(odometry.rows)} rows")
    sightings = _optional(folder / f"Robot{n}_Measurement.dat", SIGHTINGS)
    sightings.refuse(sightings.rows[:, 2] <= 0.0, "a range > 0 m")
    sightings.refuse(sightings.rows[:, 1] != np.rint(sightings.rows[:, 1]), "a whole number as barcode")
    truth = _optional(folder / f"Robot{n}_Groundtruth.dat", TRUTH)
    for log in (odometry, sightings, truth):
        refuse_unsorted(log)
    once, n_truth = _each_once(truth)
    return RobotLog(n, odometry, sightings, once, (int((np.diff(odometry.rows[:, 0]) == 0.0).sum()), n_truth))


def _each_once(truth: Columns) -> tuple[Columns, int]:
    """Rows of truth without those that say the same twice, and how many these are.

    Raises:
        TextFileError: Two say something else of one time.
    """
    twice, other = np.zeros((2, len(truth.rows)), dtype=bool)
    twice[1:] = np.diff(truth.rows[:, 0]) == 0.0
    other[1:] = (truth.rows[1:] != truth.rows[:-1]).any(axis=1)
    truth.refuse(twice & other, "one pose at a time, not another one at the stamp before")
    return truth.keep(~twice), int(twice.sum())


def _subject_of(table: Columns) -> dict[int, int]:
    """Subject number of each barcode.

    Raises:
        TextFileError: A number is not whole, or a barcode or a subject is there twice.
    """
    table.refuse((table.rows != np.rint(table.rows)).any(axis=1), "whole numbers: subject, barcode")
    for column, name in enumerate(_BARCODES):
        again = np.ones(len(table.rows), dtype=bool)
        again[np.unique(table.rows[:, column], return_index=True)[1]] = False
        table.refuse(again, f"each {name} once")
    return {int(barcode): int(subject) for subject, barcode in table.rows.tolist()}


def _needed(path: Path, names: Sequence[str], what: str) -> Columns:
    """A file that has to be there."""
    if not path.is_file():
        raise TextFileError(str(path), 0, what, "no such file")
    return read_columns(path, names)


def _optional(path: Path, names: Sequence[str]) -> Columns:
    """A file that may be missing."""
    return read_columns(path, names) if path.is_file() else no_columns(path, names)
