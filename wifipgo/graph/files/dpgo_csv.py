"""Measurements of teams as dpgo and Kimera-Multi log them: CSV, one file a robot, in space.

A row is ``robot_src, pose_src, robot_dst, pose_dst, qx, qy, qz, qw, tx, ty, tz, kappa, tau`` and perhaps
more. Its program minimises ``kappa |R_j - R_i R|_F^2 + tau |t_j - t_i - R_i t|^2``; near the optimum the
first is 2 kappa times the squared angle, so the information is taken as tau on each axis and 2 kappa on each
rotation. Columns ``is_known_inlier`` and ``weight`` are another method's answer and are not looked at.
"""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from wifipgo.errors import GraphFileError, require
from wifipgo.files.text_files import number, read_lines, whole_number
from wifipgo.graph.files.g2o import Reading, symbols
from wifipgo.graph.first_guess import first_guess
from wifipgo.graph.posegraph import UNIT_LENGTH_ATOL, pose_graph

ENDS = ("robot_src", "pose_src", "robot_dst", "pose_dst")
POSE = ("tx", "ty", "tz", "qx", "qy", "qz", "qw")
PRECISION = ("kappa", "tau")
COLUMNS = (*ENDS, *POSE, *PRECISION)


class Row(NamedTuple):
    """One measurement: whose poses, what was measured of them, and how sure it is."""

    ends: tuple[int, ...]
    z: tuple[float, ...]
    kappa: float
    tau: float


def read_dpgo_csv(path: str | Path) -> Reading:
    """Read one file, or a folder of them; a measurement that two files have counts once.

    There are no poses in the files: they begin at a first guess along the odometry.

    Args:
        path: File, or folder of ``.csv`` files.

    Raises:
        GraphFileError: A line is malformed, a column is missing, or there is no measurement; names the line.
        OSError: A file cannot be read.
    """
    path = Path(path)
    files = sorted(path.glob("*.csv")) if path.is_dir() else [path]
    require(len(files) > 0, "path", "a folder with .csv files", str(path))
    rows: list[Row] = []
    seen: set[Row] = set()
    for file in files:
        here = _rows(file)
        rows += [row for row in here if row not in seen]
        seen.update(here)
    if not rows:
        raise GraphFileError(str(path), 0, "at least one measurement", "none")
    ends = np.array([row.ends for row in rows]).reshape(-1, 2, 2)
    places = np.unique(ends.reshape(-1, 2), axis=0)
    precision = np.array([(row.tau,) * 3 + (2.0 * row.kappa,) * 3 for row in rows])
    graph = pose_graph(
        robot=places[:, 0],
        index=places[:, 1],
        poses=np.tile([0.0] * 6 + [1.0], (len(places), 1)),
        tail=ends[:, 0],
        head=ends[:, 1],
        z=np.array([row.z for row in rows]),
        information=precision[:, :, None] * np.eye(6),
    )
    graph = graph.with_poses(first_guess(graph))
    none = np.zeros(0, dtype=np.int64)
    return Reading(graph, symbols(graph), {}, none, guessed=True, name=path.stem, format="dpgo CSV")


def _rows(file: Path) -> list[Row]:
    """Measurements of one file."""
    lines, source = read_lines(file), str(file)
    names = [word.strip() for word in lines[0].split(",")] if lines else []
    missing = [name for name in COLUMNS if name not in names]
    if missing:
        raise GraphFileError(source, 1, f"columns {', '.join(COLUMNS)}", f"none named {missing[0]!r}")
    column = [names.index(name) for name in COLUMNS]
    out = []
    for n, line in enumerate(lines[1:], 2):
        words = [word.strip() for word in line.split(",")]
        if line.strip():
            if len(words) != len(names):
                raise GraphFileError(source, n, f"{len(names)} values, as the first line", f"{len(words)}")
            out.append(_row([words[k] for k in column], source, n))
    return out


def _row(words: Sequence[str], source: str, n: int) -> Row:
    """One line, checked."""
    ends = tuple(whole_number(word, source, n) for word in words[:4])
    values = tuple(number(word, source, n) for word in words[4:])
    norm = math.hypot(*values[3:7])
    for holds, expected, got in (
        (min(ends) >= 0, "robots and poses by numbers >= 0", ends),
        (ends[:2] != ends[2:], "a measurement between two poses", f"pose {ends[1]} of robot {ends[0]} twice"),
        (all(map(math.isfinite, values)), "finite numbers", words[4:]),
        (abs(norm - 1.0) <= UNIT_LENGTH_ATOL, "a quaternion of length 1", f"length {norm:.6g}"),
        (min(values[7:]) > 0.0, "kappa and tau > 0", values[7:]),
    ):
        if not holds:
            raise GraphFileError(source, n, expected, str(got))
    return Row(ends, values[:7], *values[7:])
