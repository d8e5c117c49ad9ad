"""Pose graphs of one or several robots in g2o files, in the plane and in space.

A file or a folder of files ``0.g2o, 1.g2o, ...``, one a robot, is one graph. Keys are gtsam
symbols, a letter for the robot ('a' to 'z', then 'A' to 'Z') in the top byte and the pose's
number below it, or plain numbers, which belong to the robot whose file they are in. In a
folder a measurement between two robots stands in both files and counts once. Information is
read as that of (x, y, z, rotation vector), as gtsam reads it.
"""

from collections import Counter
from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, UInt

from wifipgo.errors import GraphFileError, require
from wifipgo.graph._g2o_lines import (
    INDEX_BITS,
    LETTERS,
    TAGS,
    Line,
    edge_lines,
    full,
    pose_lines,
    read_lines,
)
from wifipgo.graph.keyed import FREEDOM, PoseGraph, pose_graph
from wifipgo.whole_files import write_text


class Reading(NamedTuple):
    """What a file or folder held.

    Attributes:
        graph: The pose graph.
        keys: Key of each pose as it stood in the file.
        skipped: Tags that were not understood, and how many lines of each.
    """

    graph: PoseGraph
    keys: UInt[np.ndarray, " poses"]
    skipped: dict[str, int]


def read_g2o(path: Path, *, lenient: bool = False) -> Reading:
    """Read a g2o file, or a folder with one file a robot.

    Args:
        path: File, or folder of ``<robot>.g2o``.
        lenient: Skip lines with unknown tags and report them.

    Raises:
        GraphFileError: A line is malformed or its tag unknown, an information matrix is not positive
            definite, a pose is there twice or missing, or there is no pose at all.
        OSError: The file cannot be read.
    """
    files = _files(path)
    skipped: Counter[str] = Counter()
    lines = [read_lines(file, skipped, lenient=lenient) for file in files]
    vertices, owner = _vertices(lines, str(path))
    edges = _edges(lines)
    dims = _one_kind([line for part in lines for line in part])
    places = {line.keys[0]: _place(line.keys[0], file) for line, file in zip(vertices, owner, strict=True)}
    _all_there(edges, places)
    order = sorted(range(len(vertices)), key=lambda row: places[vertices[row].keys[0]])
    ends = np.array([[places[key] for key in line.keys] for line in edges], dtype=np.int64).reshape(-1, 2, 2)
    values = np.array([line.values for line in edges]).reshape(len(edges), -1 if edges else dims)
    key = [vertices[row].keys[0] for row in order]
    robot, index = np.array([places[k] for k in key], dtype=np.int64).reshape(-1, 2).T
    graph = pose_graph(
        robot=robot,
        index=index,
        poses=np.array([vertices[row].values for row in order]),
        tail=ends[:, 0],
        head=ends[:, 1],
        z=values[:, :dims],
        information=full(values[:, dims:], FREEDOM[dims]),
    )
    return Reading(graph, np.array(key, dtype=np.uint64), dict(skipped))


def write_g2o(path: Path, graph: PoseGraph, *, keys: UInt[np.ndarray, " poses"] | None = None) -> None:
    """Write a graph into one file, or into a folder with one file a robot unless ``path`` ends in .g2o.

    Measurements of weight zero are left out; other weights scale the information. Each
    file is there whole or not at all.

    Args:
        path: File, or folder, which is made.
        graph: What to write.
        keys: Key of each pose; gtsam symbols are made if there are none.
    """
    keys = symbols(graph) if keys is None else keys
    used = graph.weight > 0.0
    if path.suffix == ".g2o":
        _write(path, graph, keys, np.ones(len(graph.poses), dtype=bool), used)
        return
    path.mkdir(parents=True, exist_ok=True)
    for robot in graph.robots.tolist():
        own = graph.robot == robot
        _write(path / f"{robot}.g2o", graph, keys, own, used & (own[graph.tail] | own[graph.head]))


def symbols(graph: PoseGraph) -> UInt[np.ndarray, " poses"]:
    """Gtsam symbols of a graph's poses: robot 0 is 'a'.

    Raises:
        ValueError: There are more robots than letters.
    """
    last = int(graph.robot.max(initial=0))
    require(last < len(LETTERS), "robot", f"below {len(LETTERS)}, the number of letters", last)
    letter = np.array([ord(c) for c in LETTERS], dtype=np.uint64)[graph.robot]
    return (letter << np.uint64(INDEX_BITS)) | graph.index.astype(np.uint64)


def _files(path: Path) -> list[Path]:
    """The file, or the numbered files of a folder in the order of their numbers."""
    if not path.is_dir():
        require(path.is_file(), "path", "a g2o file or a folder of them", str(path))
        return [path]
    files = sorted((f for f in path.glob("*.g2o") if f.stem.isdecimal()), key=lambda f: int(f.stem))
    require(len(files) > 0, "path", "a folder with files 0.g2o, 1.g2o, ...", str(path))
    return files


def _vertices(lines: list[list[Line]], source: str) -> tuple[list[Line], list[int]]:
    """Poses of all files, and which file each is from."""
    seen: dict[int, Line] = {}
    owner = []
    for file, part in enumerate(lines):
        for line in part:
            if len(line.keys) == 1:
                first = seen.setdefault(line.keys[0], line)
                if first is not line:
                    got = f"vertex {line.keys[0]} again, as in {first.source}:{first.number}"
                    raise GraphFileError(line.source, line.number, "each vertex once", got)
                owner.append(file)
    if not seen:
        raise GraphFileError(source, 0, "at least one vertex", "none")
    return list(seen.values()), owner


def _edges(lines: list[list[Line]]) -> list[Line]:
    """Measurements of all files; one that an earlier file has counts once."""
    out: list[Line] = []
    earlier: dict[tuple[int, ...], list[Line]] = {}
    for part in lines:
        here: dict[tuple[int, ...], list[Line]] = {}
        for line in part:
            if len(line.keys) == 2:
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


def _one_kind(lines: list[Line]) -> int:
    """Numbers of a pose row, the same in all lines."""
    dims = TAGS[lines[0].tag][1]
    for line in lines:
        if TAGS[line.tag][1] != dims:
            expected = f"lines of the plane or of space, as {lines[0].tag} before"
            raise GraphFileError(line.source, line.number, expected, line.tag)
    return dims


def _place(key: int, file: int) -> tuple[int, int]:
    """(robot, index) of a key; plain numbers belong to the robot of their file."""
    letter, index = key >> INDEX_BITS, key & ((1 << INDEX_BITS) - 1)
    if letter == 0:
        return file, index
    return LETTERS.index(chr(letter)), index


def _all_there(edges: list[Line], places: dict[int, tuple[int, int]]) -> None:
    """Refuse measurements of poses that are nowhere."""
    for line in edges:
        missing = [key for key in line.keys if key not in places]
        if missing:
            raise GraphFileError(line.source, line.number, "keys of vertices", f"no vertex {missing[0]}")


def _write(
    path: Path,
    graph: PoseGraph,
    keys: UInt[np.ndarray, " poses"],
    poses: Bool[np.ndarray, " poses"],
    edges: Bool[np.ndarray, " edges"],
) -> None:
    """Write the poses and edges of two masks."""
    text = "".join(f"{line}\n" for line in (*pose_lines(graph, keys, poses), *edge_lines(graph, keys, edges)))
    write_text(path, text)
