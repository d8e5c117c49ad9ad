"""Lines of g2o files: what each means, checked where it stands."""

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, UInt

from wifipgo.errors import GraphFileError, quoted
from wifipgo.files.text_files import number, read_lines, whole_number
from wifipgo.graph.posegraph import FREEDOM, UNIT_LENGTH_ATOL, PoseGraph, is_information


class Form(NamedTuple):
    """What stands after a tag: so many keys, and so many numbers."""

    keys: int
    numbers: int


# Numbers of a pose row by tag.
VERTICES: Mapping[str, int] = MappingProxyType({"VERTEX_SE2": 3, "VERTEX_SE3:QUAT": 7})
EDGES: Mapping[str, int] = MappingProxyType({"EDGE_SE2": 3, "EDGE_SE3:QUAT": 7})
DIMS: Mapping[str, int] = MappingProxyType({**VERTICES, **EDGES})
FIX = "FIX"  # its keys are of poses that are known and stay
# Points and what was measured of them, which no solver here reads. The first key is the pose's.
LANDMARKS: Mapping[str, Form] = MappingProxyType(
    {
        "VERTEX_XY": Form(1, 2),
        "EDGE_SE2_XY": Form(2, 5),
        "EDGE_BEARING_SE2_XY": Form(2, 2),
        "VERTEX_TRACKXYZ": Form(1, 3),
        "EDGE_SE3_TRACKXYZ": Form(3, 9),
        "PARAMS_SE2OFFSET": Form(1, 3),
        "PARAMS_SE3OFFSET": Form(1, 7),
    }
)
POINTS = ("VERTEX_XY", "VERTEX_TRACKXYZ")


class Line(NamedTuple):
    """One line of a file: its place, what it is, its keys, and its numbers without the keys."""

    source: str
    number: int
    tag: str
    keys: tuple[int, ...]
    values: tuple[float, ...]


class FileLines(NamedTuple):
    """All lines of one file that mean something.

    Attributes:
        robot: Whose file it is by its name; nobody's if the name says nothing.
        vertices: Poses.
        edges: Measurements between two poses.
        fixes: Lines with the keys of poses that stay.
        landmarks: Lines of points, as they were written.
        points: Keys of points.
    """

    robot: int | None
    vertices: list[Line]
    edges: list[Line]
    fixes: list[Line]
    landmarks: list[str]
    points: set[int]


def file_lines(file: Path, robot: int | None, skipped: Counter[str], *, lenient: bool) -> FileLines:
    """Read a file; unknown tags are counted if that is wanted, else refused."""
    out = FileLines(robot, [], [], [], [], set())
    for n, text in enumerate(read_lines(file), 1):
        words = text.split()
        if not words or words[0].startswith("#"):
            continue
        tag = words[0]
        if tag in VERTICES:
            out.vertices.append(_pose_line(str(file), n, words, Form(1, VERTICES[tag])))
        elif tag in EDGES:
            freedom = FREEDOM[EDGES[tag]]
            form = Form(2, EDGES[tag] + freedom * (freedom + 1) // 2)
            out.edges.append(_pose_line(str(file), n, words, form))
        elif tag == FIX:
            out.fixes.append(_line(str(file), n, words, Form(max(len(words) - 1, 1), 0)))
        elif tag in LANDMARKS:
            line = _line(str(file), n, words, LANDMARKS[tag])
            out.landmarks.append(text.strip())
            out.points.update(line.keys[:1] if tag in POINTS else ())
        elif lenient:
            skipped[tag[:40]] += 1
        else:
            expected = f"one of {', '.join((*DIMS, FIX, *LANDMARKS))} (--lenient skips others)"
            raise GraphFileError(str(file), n, expected, quoted(tag[:40]))
    return out


def _line(source: str, n: int, words: Sequence[str], form: Form) -> Line:
    """Keys and numbers of one line."""
    if len(words) != 1 + form.keys + form.numbers:
        expected = f"{form.keys} key{'s' * (form.keys > 1)} and {form.numbers} numbers after {words[0]}"
        raise GraphFileError(source, n, expected, f"{len(words) - 1} words")
    keys = tuple(whole_number(word, source, n) for word in words[1 : 1 + form.keys])
    values = tuple(number(word, source, n) for word in words[1 + form.keys :])
    bad = [value for value in values if not np.isfinite(value)]
    if bad:
        raise GraphFileError(source, n, "finite numbers", str(bad))
    return Line(source, n, words[0], keys, values)


def _pose_line(source: str, n: int, words: Sequence[str], form: Form) -> Line:
    """A pose or a measurement; values that mean nothing are refused."""
    line = _line(source, n, words, form)
    values, dims = np.array(line.values), DIMS[line.tag]

    def need(holds: bool | np.bool_, expected: str, got: object) -> None:
        if not holds:
            raise GraphFileError(source, n, expected, str(got))

    if dims == 7:
        norm = math.hypot(*line.values[3:7])
        need(abs(norm - 1.0) <= UNIT_LENGTH_ATOL, "a quaternion of length 1", f"length {norm:.6g}")
    if form.keys == 2:
        need(line.keys[0] != line.keys[1], "an edge between two poses", f"{line.keys[0]} twice")
        information = full(values[None, dims:], FREEDOM[dims])
        need(is_information(information)[0], "a positive definite information matrix", values[dims:])
    return line


def full(upper: Float[np.ndarray, "n numbers"], freedom: int) -> Float[np.ndarray, "n freedom freedom"]:
    """Symmetric matrices of their upper triangles, row by row."""
    out = np.zeros((len(upper), freedom, freedom))
    if len(upper):
        i, j = np.triu_indices(freedom)
        out[:, i, j] = out[:, j, i] = upper
    return out


def pose_lines(
    graph: PoseGraph, keys: UInt[np.ndarray, " poses"], chosen: Bool[np.ndarray, " poses"]
) -> Iterator[str]:
    """Lines of some poses, with all digits."""
    tag = "VERTEX_SE2" if graph.freedom == 3 else "VERTEX_SE3:QUAT"
    for key, pose in zip(keys[chosen].tolist(), graph.poses[chosen].tolist(), strict=True):
        yield " ".join((tag, str(key), *map(repr, pose)))


def fix_lines(keys: UInt[np.ndarray, " poses"], chosen: Bool[np.ndarray, " poses"]) -> Iterator[str]:
    """A line for each pose that is known."""
    yield from (f"{FIX} {key}" for key in keys[chosen].tolist())


def edge_lines(
    graph: PoseGraph, keys: UInt[np.ndarray, " poses"], chosen: Bool[np.ndarray, " edges"]
) -> Iterator[str]:
    """Lines of some measurements, with all digits; weights scale the information."""
    tag = "EDGE_SE2" if graph.freedom == 3 else "EDGE_SE3:QUAT"
    i, j = np.triu_indices(graph.freedom)
    upper = (graph.information[chosen] * graph.weight[chosen, None, None])[:, i, j]
    ends = np.stack([keys[graph.tail[chosen]], keys[graph.head[chosen]]], axis=-1)
    for pair, values in zip(ends.tolist(), np.hstack([graph.z[chosen], upper]).tolist(), strict=True):
        yield " ".join((tag, *map(str, pair), *map(repr, values)))
