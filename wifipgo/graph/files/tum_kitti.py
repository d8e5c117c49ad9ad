"""Trajectories of all robots as TUM and KITTI files, which trajectory tools read."""

import math
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float

from wifipgo import se3
from wifipgo.errors import GraphFileError, quoted
from wifipgo.files.atomic_files import write_text
from wifipgo.files.text_files import number, read_lines
from wifipgo.graph.chordal import nearest_rotations
from wifipgo.graph.posegraph import PoseGraph, normalised

ROTATION_ATOL = 0.01  # trajectories are printed with few digits


def write_tum(folder: str | Path, graph: PoseGraph, poses: Float[np.ndarray, "poses dims"]) -> None:
    """Write ``<robot>.txt``, a line a pose: ``index x y z qx qy qz qw``.

    The number of the pose stands where TUM has a time stamp; planar poses have z = 0.
    """
    folder = Path(folder)
    for robot, own, rows in _by_robot(graph, poses):
        lines = (
            " ".join((str(index), *map(repr, row)))
            for index, row in zip(graph.index[own].tolist(), rows.tolist(), strict=True)
        )
        _write(folder / f"{robot}.txt", lines)


def write_kitti(folder: str | Path, graph: PoseGraph, poses: Float[np.ndarray, "poses dims"]) -> None:
    """Write ``<robot>.txt``, a line a pose: the upper three rows of its 4 x 4 matrix. Numbers are lost."""
    folder = Path(folder)
    for robot, _, rows in _by_robot(graph, poses):
        matrices = np.concatenate([se3.rotation_matrix(rows[:, 3:]), rows[:, :3, None]], axis=-1)
        _write(folder / f"{robot}.txt", (" ".join(map(repr, m)) for m in matrices.reshape(-1, 12).tolist()))


def read_tum(path: str | Path) -> tuple[Float[np.ndarray, " poses"], Float[np.ndarray, "poses 7"]]:
    """Time stamps and poses of one TUM file; quaternions are brought to length one.

    Raises:
        GraphFileError: A line has no eight finite numbers or no rotation, or is not later than the line
            before, or there is none; a frame that is lost, with a quaternion of zeros, is named too.
        TextFileError: A word is no number, or the file no text.
    """
    path = Path(path)
    table = np.array(_table(path, 8, _check_stamped()))
    return table[:, 0], normalised(table[:, 1:])


def read_kitti(path: str | Path) -> Float[np.ndarray, "poses 7"]:
    """Poses of one KITTI file, a line a pose: the upper three rows of its 4 x 4 matrix.

    Raises:
        GraphFileError: A line has no twelve finite numbers or no rotation, or there is none.
        TextFileError: A word is no number, or the file no text.
    """
    path = Path(path)
    matrix = np.array(_table(path, 12, _check_rotation)).reshape(-1, 3, 4)
    return np.concatenate([matrix[:, :, 3], se3.quaternion(nearest_rotations(matrix[:, :, :3]))], axis=-1)


def _table(
    path: Path, columns: int, check: Callable[[Float[np.ndarray, " columns"]], tuple[str, str] | None]
) -> list[Float[np.ndarray, " columns"]]:
    """Values of each line that is no comment."""
    out = []
    for n, text in enumerate(read_lines(path), 1):
        words = text.split("#", 1)[0].split()
        if not words:
            continue
        row = np.array([number(word, str(path), n) for word in words])
        if len(row) != columns or not np.isfinite(row).all():
            got = f"{len(row)} words" if len(row) != columns else quoted(" ".join(words))
            raise GraphFileError(str(path), n, f"{columns} finite numbers", got)
        wrong = check(row)
        if wrong is not None:
            raise GraphFileError(str(path), n, *wrong)
        out.append(row)
    if not out:
        raise GraphFileError(str(path), 0, "at least one pose", "none")
    return out


def _check_stamped() -> Callable[[Float[np.ndarray, "8"]], tuple[str, str] | None]:
    """What is wrong with a line of TUM: its quaternion, or a time stamp that does not rise."""
    last = -math.inf

    def check(row: Float[np.ndarray, "8"]) -> tuple[str, str] | None:
        nonlocal last
        length, stamp = math.hypot(*row[4:]), float(row[0])
        if abs(length - 1.0) > ROTATION_ATOL:
            return "a rotation", f"a quaternion of length {length:.6g}"
        if stamp <= last:
            return f"a time stamp after {last!r}, that of the line before", repr(stamp)
        last = stamp
        return None

    return check


def _check_rotation(row: Float[np.ndarray, "12"]) -> tuple[str, str] | None:
    """What is wrong with the left of a 3 x 4 matrix."""
    R = row.reshape(3, 4)[:, :3]
    with np.errstate(over="ignore", invalid="ignore"):
        off = float(np.abs(R @ R.T - np.eye(3)).max())
    if off > 2.0 * ROTATION_ATOL or not np.isfinite(off):
        return "a rotation", f"a matrix whose rows are off length 1 and right angles by {off:.6g}"
    return None if np.linalg.det(R) > 0.0 else ("a rotation", "a mirrored matrix")


def _by_robot(
    graph: PoseGraph, poses: Float[np.ndarray, "poses dims"]
) -> Iterator[tuple[int, Bool[np.ndarray, " poses"], Float[np.ndarray, "own 7"]]]:
    """Each robot, which poses are its own, and these in space."""
    rows = se3.in_space(poses)
    for robot in graph.robots.tolist():
        own = graph.robot == robot
        yield robot, own, rows[own]


def _write(path: Path, lines: Iterable[str]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, "".join(f"{line}\n" for line in lines))
