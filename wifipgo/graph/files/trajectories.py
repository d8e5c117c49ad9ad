"""Trajectories of whole teams from any file that has them, and which poses of two teams belong together.

======================  =================================================================================
what is there           trajectories
======================  =================================================================================
``.txt``, ``.tum``, ..  TUM (8 numbers a line: time stamp, position, quaternion) or KITTI (12, no stamps)
folder of these         one a robot, whose number is the file's name: ``0.txt``, ``1.txt``
folder with ``tum``     that folder: results of ``wifipgo optimise``
g2o, file or folder     the poses; their numbers stand for time stamps
``.jrl``                the true poses; their numbers stand for time stamps
``.jrr``                what each robot found for its own poses
======================  =================================================================================
"""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from wifipgo import se3
from wifipgo.errors import BadInputError, require
from wifipgo.files.text_files import read_lines
from wifipgo.graph.files.graph_files import read_graph
from wifipgo.graph.files.jrl_writing import read_jrr
from wifipgo.graph.files.tum_kitti import read_kitti, read_tum
from wifipgo.graph.posegraph import PoseGraph

GRAPHS = (".g2o", ".jrl")
KITTI_WORDS = 12  # a line has so many numbers, of TUM eight
TOLERANCE_S = 0.01  # as evo's


class Trajectory(NamedTuple):
    """Poses of one robot in space, and when it had them; a file of KITTI does not say when."""

    stamp_s: Float[np.ndarray, " poses"] | None
    poses: Float[np.ndarray, "poses 7"]
    source: str


Team = Mapping[int, Trajectory]


def read_team(path: str | Path) -> Team:
    """Trajectories by robot, see the table above.

    Raises:
        BadInputError: A file is not what its name says, or there is none; names the line or field.
        OSError: It cannot be read.
    """
    path = Path(path)
    require(path.exists(), "path", "a file or folder that exists", str(path))
    if path.is_dir() and (path / "tum").is_dir():
        return read_team(path / "tum")
    if path.is_dir() and not any(path.glob("*.g2o")):
        files = {robot_of(file): file for file in sorted(path.iterdir()) if robot_of(file) is not None}
        require(len(files) > 0, "path", "a folder with 0.txt, 1.txt, ... or 0.g2o, ...", str(path))
        return {robot: _lone(file) for robot, file in sorted(files.items()) if robot is not None}
    if path.suffix.lower() == ".jrr" or path.name.lower().endswith(".jrr.cbor"):
        return _found(path)
    if path.is_dir() or path.suffix.lower() in (*GRAPHS, ".cbor"):
        return _of_graph(path)
    return {robot_of(path) or 0: _lone(path)}


def robot_of(file: Path) -> int | None:
    """Robot whose number is the file's name."""
    is_number = file.stem.isascii() and file.stem.isdecimal() and len(file.stem) < 10
    return int(file.stem) if is_number else None


def associated(
    reference: Trajectory, estimate: Trajectory, *, tolerance_s: float = TOLERANCE_S
) -> tuple[Int[np.ndarray, " pairs"], Int[np.ndarray, " pairs"]]:
    """Rows of the two that belong together.

    Each pose goes with the one of the other trajectory that is nearest in time, if each is the other's
    nearest and they are no further apart than the tolerance; so none counts twice. Where one of the two has
    no time stamps, line k goes with line k.

    Raises:
        BadInputError: There are no time stamps, and not as many poses.
    """
    a, b = reference.stamp_s, estimate.stamp_s
    if a is None or b is None:
        sizes = (len(reference.poses), len(estimate.poses))
        where = f"{reference.source} and {estimate.source}, one of which has no time stamps,"
        require(sizes[0] == sizes[1], where, "as long as each other", sizes)
        return np.arange(sizes[0]), np.arange(sizes[1])
    there, back = _nearest(a, b), _nearest(b, a)
    mutual = back[there] == np.arange(len(b))
    rows = np.flatnonzero(mutual & (np.abs(a[there] - b) <= tolerance_s))
    return there[rows], rows


def _nearest(among: Float[np.ndarray, " n"], of: Float[np.ndarray, " m"]) -> Int[np.ndarray, " m"]:
    """Row of the nearest of ascending values; of two as near the first."""
    after = np.clip(np.searchsorted(among, of), 1, max(len(among) - 1, 1))
    before = after - 1
    after = np.minimum(after, len(among) - 1)
    return np.where(of - among[before] <= among[after] - of, before, after)


def _lone(file: Path) -> Trajectory:
    """One robot's trajectory; the format is told by the first line that is no comment."""
    lines = (line.split("#", 1)[0].split() for line in read_lines(file))
    first = next((words for words in lines if words), [])
    if len(first) == KITTI_WORDS:
        return Trajectory(None, read_kitti(file), str(file))
    return Trajectory(*read_tum(file), str(file))


def _of_graph(path: Path) -> Team:
    """Poses of a graph; of a data set the true ones."""
    reading = read_graph(path, lenient=True)
    graph, poses = reading.graph, reading.graph.poses
    if reading.format == "JRL":
        if reading.truth is None:
            raise BadInputError(f"{path}: expected true poses, the field 'groundtruth', got none")
        poses = reading.truth
    elif reading.guessed:
        raise BadInputError(f"{path}: expected poses, got measurements alone")
    return team_of(graph, poses, str(path))


def team_of(graph: PoseGraph, poses: Float[np.ndarray, "poses dims"], source: str) -> Team:
    """Trajectories of a graph's robots; rows of nan are left out, numbers of poses are the time stamps."""
    there = np.isfinite(poses).all(axis=1)
    rows = np.zeros((len(poses), 7))
    rows[there] = se3.in_space(poses[there])
    return {
        robot: Trajectory(graph.index[own].astype(np.float64), rows[own], source)
        for robot in graph.robots.tolist()
        if (own := there & (graph.robot == robot)).any()
    }


def _found(path: Path) -> Team:
    """What robots found for their own poses."""
    team = {}
    for robot, held in read_jrr(path).items():
        own = sorted((index, row) for (whose, index), row in held.items() if whose == robot)
        if own:
            rows = se3.in_space(np.array([row for _, row in own]))
            team[robot] = Trajectory(np.array([float(index) for index, _ in own]), rows, str(path))
    return team
