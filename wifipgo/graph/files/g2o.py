"""Pose graphs of one or several robots in g2o files, in the plane and in space.

A file or a folder of files ``0.g2o, 1.g2o, ...``, one a robot, is one graph. Keys say whose pose
is meant, see `wifipgo.graph.files._g2o_keys`. In a folder a measurement between two robots stands in both
files and counts once. Poses named by FIX are known. Landmarks are kept apart, as they were
written. A graph of measurements alone begins from its odometry. Information is read as that of
(x, y, z, rotation vector), as gtsam reads it.
"""

from collections import Counter
from collections.abc import Iterable, Sequence
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int, UInt

from wifipgo.errors import GraphFileError, require
from wifipgo.files.atomic_files import write_text
from wifipgo.graph.files._g2o_keys import INDEX_BITS, LETTERS, Named, ends_named, places, vertices_named
from wifipgo.graph.files._g2o_lines import (
    DIMS,
    FIX,
    FileLines,
    Line,
    edge_lines,
    file_lines,
    fix_lines,
    full,
    pose_lines,
)
from wifipgo.graph.first_guess import first_guess
from wifipgo.graph.posegraph import FREEDOM, PoseGraph, keys_of, pose_graph, rows_of

MOST_ROBOT = 2**31  # as a number in a file's name


class Landmark(NamedTuple):
    """A line of a point, and the robot whose file it was in."""

    robot: int
    text: str


class Reading(NamedTuple):
    """What a file or folder held.

    Attributes:
        graph: The pose graph.
        keys: Key of each pose as it stood in the file.
        skipped: Tags that were not understood, and how many lines of each.
        fixed: Rows of the poses that FIX names: they are known.
        landmarks: Lines of points and of what was measured of them, which play no part.
        guessed: Whether there were measurements only, so that the poses are a first guess of ours.
        left_out: Other files .g2o of the folder, which are no robot's.
        truth: True poses, rows of nan where they are not known; nothing if the file tells none.
        name: What the file calls itself, or its name.
        format: "g2o", or what else the file is.
    """

    graph: PoseGraph
    keys: UInt[np.ndarray, " poses"]
    skipped: dict[str, int]
    fixed: Int[np.ndarray, " fixed"]
    landmarks: tuple[Landmark, ...] = ()
    guessed: bool = False
    left_out: tuple[str, ...] = ()
    truth: Float[np.ndarray, "poses dims"] | None = None
    name: str = ""
    format: str = "g2o"


def read_g2o(path: str | Path, *, lenient: bool = False) -> Reading:
    """Read a g2o file, or a folder with one file a robot.

    Args:
        path: File, or folder of ``<robot>.g2o``.
        lenient: Skip lines with unknown tags and report them.

    Raises:
        GraphFileError: A line is malformed or its tag unknown, an information matrix is not positive
            definite, a pose is there twice or missing, it is not clear whose a pose is, or there is
            no pose at all.
        TextFileError: A file is no text, or a word no number.
        OSError: The file cannot be read.
    """
    path = Path(path)
    paths, left_out = _files(path)
    skipped: Counter[str] = Counter()
    files = [file_lines(file, robot, skipped, lenient=lenient) for file, robot in paths]
    guessed = not any(file.vertices for file in files)
    named = ends_named(files) if guessed else vertices_named(files, by_robot=path.is_dir())
    if not named:
        raise GraphFileError(str(path), 0, "at least one vertex or edge", "none")
    _one_kind(files)
    place = places(named)
    graph = _graph(named, _edges(files), place, guessed=guessed)
    key_of = {where: key for key, where in place.items()}
    return Reading(
        graph=graph,
        keys=np.array([key_of[robot, index] for robot, index in keys_of(graph).tolist()], dtype=np.uint64),
        skipped=dict(skipped),
        fixed=_fixed(graph, files, place),
        landmarks=tuple(Landmark(file.robot or 0, text) for file in files for text in _kept(file)),
        guessed=guessed,
        left_out=left_out,
        name=path.stem,
    )


def _graph(
    named: Sequence[Named], edges: Sequence[Line], place: dict[int, tuple[int, int]], *, guessed: bool
) -> PoseGraph:
    """The graph of all lines, at the poses of the vertices or at a first guess."""
    _all_there(edges, place)
    dims = DIMS[named[0].line.tag]
    robot, index = np.array([place[one.key] for one in named], dtype=np.int64).T
    here = (0.0,) * (dims - 1) + (0.0 if dims == 3 else 1.0,)
    ends = np.array([[place[key] for key in line.keys] for line in edges], dtype=np.int64).reshape(-1, 2, 2)
    values = np.array([line.values for line in edges]).reshape(len(edges), -1 if edges else dims)
    graph = pose_graph(
        robot=robot,
        index=index,
        poses=np.array([here if guessed else one.line.values for one in named]),
        tail=ends[:, 0],
        head=ends[:, 1],
        z=values[:, :dims],
        information=full(values[:, dims:], FREEDOM[dims]),
    )
    return graph.with_poses(first_guess(graph)) if guessed else graph


def _fixed(
    graph: PoseGraph, files: Sequence[FileLines], place: dict[int, tuple[int, int]]
) -> Int[np.ndarray, " fixed"]:
    """Rows of the poses that are known."""
    points = {key for file in files for key in file.points}
    lines = [line for file in files for line in file.fixes]
    _all_there(lines, {**dict.fromkeys(points, (-1, -1)), **place})
    known = [place[key] for line in lines for key in line.keys if key in place]
    return np.unique(rows_of(keys_of(graph), np.array(known, dtype=np.int64).reshape(-1, 2), FIX))


def _kept(file: FileLines) -> list[str]:
    """Lines of points, and which of these are known."""
    known = [f"{FIX} {key}" for line in file.fixes for key in line.keys if key in file.points]
    return [*file.landmarks, *known]


def write_g2o(
    path: str | Path,
    graph: PoseGraph,
    *,
    keys: UInt[np.ndarray, " poses"] | None = None,
    fixed: Int[np.ndarray, " fixed"] | None = None,
    landmarks: Sequence[Landmark] = (),
) -> None:
    """Write a graph into one file, or into a folder with one file a robot unless ``path`` ends in .g2o.

    Measurements of weight zero are left out; other weights scale the information. Each
    file is there whole or not at all.

    Args:
        path: File, or folder, which is made.
        graph: What to write.
        keys: Key of each pose; gtsam symbols are made if there are none.
        fixed: Rows of poses that are known: they get a line FIX.
        landmarks: Lines to add as they are.
    """
    path = Path(path)
    keys = symbols(graph) if keys is None else keys
    known = np.isin(np.arange(len(graph.poses)), [] if fixed is None else fixed)
    used = graph.weight > 0.0
    if path.suffix == ".g2o":
        everything = (*pose_lines(graph, keys, known | True), *fix_lines(keys, known))
        _write(path, (*everything, *edge_lines(graph, keys, used), *(mark.text for mark in landmarks)))
        return
    path.mkdir(parents=True, exist_ok=True)
    for robot in sorted({*graph.robots.tolist(), *(mark.robot for mark in landmarks)}):
        own = graph.robot == robot
        touching = used & (own[graph.tail] | own[graph.head])
        of_poses = (*pose_lines(graph, keys, own), *fix_lines(keys, known & own))
        seen = (mark.text for mark in landmarks if mark.robot == robot)
        _write(path / f"{robot}.g2o", (*of_poses, *edge_lines(graph, keys, touching), *seen))


def symbols(graph: PoseGraph) -> UInt[np.ndarray, " poses"]:
    """Gtsam symbols of a graph's poses: robot 0 is 'a'.

    Raises:
        ValueError: There are more robots than letters.
    """
    last = int(graph.robot.max(initial=0))
    require(last < len(LETTERS), "robot", f"below {len(LETTERS)}, the number of letters", last)
    letter = np.array([ord(c) for c in LETTERS], dtype=np.uint64)[graph.robot]
    return (letter << np.uint64(INDEX_BITS)) | graph.index.astype(np.uint64)


def _files(path: Path) -> tuple[list[tuple[Path, int | None]], tuple[str, ...]]:
    """The file, or those of a folder in the order of their numbers, each with its robot; and other .g2o."""
    if not path.is_dir():
        require(path.exists(), "path", "a g2o file or a folder of them", str(path))
        return [(path, _robot(path))], ()
    robots = {file: _robot(file) for file in sorted(path.glob("*.g2o")) if file.is_file()}
    numbered = sorted((robot, file) for file, robot in robots.items() if robot is not None)
    require(len(numbered) > 0, "path", "a folder with files 0.g2o, 1.g2o, ...", str(path))
    for (robot, file), (other, again) in pairwise(numbered):
        if robot == other:
            raise GraphFileError(str(again), 0, f"one file of robot {robot}, {file.name}", "another")
    return [(file, robot) for robot, file in numbered], tuple(f.name for f, r in robots.items() if r is None)


def _robot(file: Path) -> int | None:
    """Robot whose number is the file's name."""
    if not (file.stem.isascii() and file.stem.isdecimal()):
        return None
    small = len(file.stem) < 20 and int(file.stem) < MOST_ROBOT
    require(small, str(file), f"a robot's number, below {MOST_ROBOT}", file.stem)
    return int(file.stem)


def _edges(files: Sequence[FileLines]) -> list[Line]:
    """Measurements of all files; one that an earlier file has counts once."""
    out: list[Line] = []
    earlier: dict[tuple[int, ...], list[Line]] = {}
    for file in files:
        here: dict[tuple[int, ...], list[Line]] = {}
        for line in file.edges:
            here.setdefault(line.keys, []).append(line)
        for keys, found in here.items():
            if keys in earlier:
                _same(earlier[keys], found)
            else:
                out += found
        earlier |= here
    return out


def _same(first: list[Line], second: list[Line]) -> None:
    """Refuse two files that tell different things of one measurement."""
    for line in second:
        if not any(np.allclose(line.values, other.values) for other in first):
            expected = f"the measurement of {first[0].source}:{first[0].number}, which has these keys"
            raise GraphFileError(line.source, line.number, expected, "other numbers")


def _one_kind(files: Sequence[FileLines]) -> None:
    """Refuse a graph that is of the plane and of space."""
    lines = [line for file in files for line in (*file.vertices, *file.edges)]
    for line in lines:
        if DIMS[line.tag] != DIMS[lines[0].tag]:
            expected = f"lines of the plane or of space, as {lines[0].tag} before"
            raise GraphFileError(line.source, line.number, expected, line.tag)


def _all_there(lines: Sequence[Line], place: dict[int, tuple[int, int]]) -> None:
    """Refuse keys of poses that are nowhere."""
    for line in lines:
        missing = [key for key in line.keys if key not in place]
        if missing:
            raise GraphFileError(line.source, line.number, "keys of vertices", f"no vertex {missing[0]}")


def _write(path: Path, lines: Iterable[str]) -> None:
    write_text(path, "".join(f"{line}\n" for line in lines))
