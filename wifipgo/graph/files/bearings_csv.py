"""Directions of arrival of a team as a CSV file, a line a peak.

::

    observer,observer_pose,target,target_pose,azimuth_deg
    0,17,1,20,34.5
    0,17,1,20,-120.0

Robot 0, at its pose 17, heard robot 1, which was at its pose 20, from 34.5 degrees left of its own x axis. A
second line with the same poses is the next peak of the same profile, the highest first. Further columns are
not looked at.
"""

import math
from pathlib import Path

import numpy as np

from wifipgo.errors import GraphFileError
from wifipgo.files.text_files import number, read_lines, whole_number
from wifipgo.graph.bearings import Bearings
from wifipgo.graph.outliers.aoa_weights import PAPER_SIGMA_RAD
from wifipgo.graph.posegraph import PoseGraph, keys_of

COLUMNS = ("observer", "observer_pose", "target", "target_pose", "azimuth_deg")

Ends = tuple[int, int, int, int]


def read_bearings(path: str | Path, graph: PoseGraph) -> Bearings:
    """Read directions between poses of a graph.

    Raises:
        GraphFileError: A line is malformed, names a pose that is not there, or a robot that heard itself, or
            there is none; names file and line.
        OSError: The file cannot be read.
    """
    path = Path(path)
    lines, source = read_lines(path), str(path)
    names = [word.strip() for word in lines[0].split(",")] if lines else []
    missing = [name for name in COLUMNS if name not in names]
    if missing:
        raise GraphFileError(source, 1, f"columns {', '.join(COLUMNS)}", f"none named {missing[0]!r}")
    column, known = [names.index(name) for name in COLUMNS], set(map(tuple, keys_of(graph).tolist()))
    peaks: dict[Ends, list[float]] = {}
    for n, line in enumerate(lines[1:], 2):
        words = [word.strip() for word in line.split(",")]
        if not line.strip():
            continue
        if len(words) != len(names):
            raise GraphFileError(source, n, f"{len(names)} values, as the first line", f"{len(words)}")
        ends, azimuth_deg = _peak([words[k] for k in column], known, source, n)
        peaks.setdefault(ends, []).append(math.radians(azimuth_deg))
    if not peaks:
        raise GraphFileError(source, 0, "at least one direction", "none")
    return _bearings(peaks)


def _peak(words: list[str], known: set[tuple[int, ...]], source: str, n: int) -> tuple[Ends, float]:
    """One line, checked."""
    a, i, b, j = (whole_number(word, source, n) for word in words[:4])
    azimuth_deg = number(words[4], source, n)
    for robot, index in ((a, i), (b, j)):
        if (robot, index) not in known:
            raise GraphFileError(source, n, "a pose of the graph", f"pose {index} of robot {robot}")
    if a == b:
        raise GraphFileError(source, n, "another robot as target", f"robot {b} again")
    if not abs(azimuth_deg) <= 360.0:
        raise GraphFileError(source, n, "an azimuth in -360..360 degrees", words[4])
    return (a, i, b, j), azimuth_deg


def _bearings(peaks: dict[Ends, list[float]]) -> Bearings:
    """Rows of as many peaks each: where there are fewer, the highest stands again."""
    most = max(map(len, peaks.values()))
    ends = np.array(list(peaks), dtype=np.int64)
    return Bearings.measured(
        observer=ends[:, :2],
        target=ends[:, 2:],
        azimuth_rad=np.array([found + found[:1] * (most - len(found)) for found in peaks.values()]),
        sigma_rad=PAPER_SIGMA_RAD,
    )
