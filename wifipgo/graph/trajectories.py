"""Trajectories of all robots as TUM and KITTI files, which trajectory tools read."""

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float

from wifipgo import se3
from wifipgo.errors import require
from wifipgo.graph.keyed import PoseGraph, normalised
from wifipgo.whole_files import write_text


def write_tum(folder: Path, graph: PoseGraph, poses: Float[np.ndarray, "poses dims"]) -> None:
    """Write ``<robot>.txt``, a line a pose: ``index x y z qx qy qz qw``.

    The number of the pose stands where TUM has a time stamp; planar poses have z = 0.
    """
    for robot, own, rows in _by_robot(graph, poses):
        lines = (
            " ".join((str(index), *map(repr, row)))
            for index, row in zip(graph.index[own].tolist(), rows.tolist(), strict=True)
        )
        _write(folder / f"{robot}.txt", lines)


def write_kitti(folder: Path, graph: PoseGraph, poses: Float[np.ndarray, "poses dims"]) -> None:
    """Write ``<robot>.txt``, a line a pose: the upper three rows of its 4 x 4 matrix. Numbers are lost."""
    for robot, _, rows in _by_robot(graph, poses):
        matrices = np.concatenate([se3.rotation_matrix(rows[:, 3:]), rows[:, :3, None]], axis=-1)
        _write(folder / f"{robot}.txt", (" ".join(map(repr, m)) for m in matrices.reshape(-1, 12).tolist()))


def read_tum(path: Path) -> tuple[Float[np.ndarray, " poses"], Float[np.ndarray, "poses 7"]]:
    """Time stamps and poses of one TUM file.

    Raises:
        ValueError: A line has no eight finite numbers.
    """
    table = np.loadtxt(path, ndmin=2, dtype=np.float64)
    good = table.shape[1:] == (8,) and bool(np.isfinite(table).all())
    require(good, str(path), "lines of 8 finite numbers", table.shape)
    return table[:, 0], normalised(table[:, 1:])


def _by_robot(
    graph: PoseGraph, poses: Float[np.ndarray, "poses dims"]
) -> Iterator[tuple[int, Bool[np.ndarray, " poses"], Float[np.ndarray, "own 7"]]]:
    """Each robot, which poses are its own, and these in space."""
    rows = se3.lift(poses) if poses.shape[1] == 3 else poses
    for robot in graph.robots.tolist():
        own = graph.robot == robot
        yield robot, own, rows[own]


def _write(path: Path, lines: Iterable[str]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, "".join(f"{line}\n" for line in lines))
