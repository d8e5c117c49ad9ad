"""Lines of g2o files: what each means, checked where it stands."""

import string
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, UInt

from wifipgo.errors import GraphFileError
from wifipgo.graph.keyed import FREEDOM, UNIT_LENGTH_ATOL, PoseGraph, is_information

LETTERS = string.ascii_lowercase + string.ascii_uppercase
INDEX_BITS = 56
# Tag: (whether an edge, numbers of a pose row).
TAGS = {
    "VERTEX_SE2": (False, 3),
    "EDGE_SE2": (True, 3),
    "VERTEX_SE3:QUAT": (False, 7),
    "EDGE_SE3:QUAT": (True, 7),
}


class Line(NamedTuple):
    """One line of a file: its place, what it is, its keys, and its numbers without the keys."""

    source: str
    number: int
    tag: str
    keys: tuple[int, ...]
    values: tuple[float, ...]


def read_lines(file: Path, skipped: Counter[str], *, lenient: bool) -> list[Line]:
    """All lines of a file that mean something."""
    out = []
    for number, text in enumerate(file.read_text(encoding="utf-8", errors="replace").splitlines(), 1):
        words = text.split()
        if not words or words[0].startswith("#"):
            continue
        if words[0] in TAGS:
            out.append(_line(str(file), number, words))
        elif lenient:
            skipped[words[0]] += 1
        else:
            expected = f"one of {', '.join(TAGS)} (--lenient skips others)"
            raise GraphFileError(str(file), number, expected, repr(words[0][:40]))
    return out


def _line(source: str, number: int, words: Sequence[str]) -> Line:
    """Keys and numbers of one line, checked."""
    is_edge, dims = TAGS[words[0]]
    n_keys, freedom = 1 + is_edge, FREEDOM[dims]
    n_values = dims + is_edge * freedom * (freedom + 1) // 2
    if len(words) != 1 + n_keys + n_values:
        expected = f"{n_keys} key{'s' * is_edge} and {n_values} numbers after {words[0]}"
        raise GraphFileError(source, number, expected, f"{len(words) - 1} words")
    try:
        keys = tuple(int(word) for word in words[1 : 1 + n_keys])
        values = tuple(float(word) for word in words[1 + n_keys :])
    except ValueError as error:
        raise GraphFileError(source, number, "whole keys and plain numbers", str(error)) from error
    line = Line(source, number, words[0], keys, values)
    _check(line, dims)
    return line


def _check(line: Line, dims: int) -> None:
    """Refuse values that mean nothing."""
    values = np.array(line.values)

    def need(holds: bool | np.bool_, expected: str, got: object) -> None:
        if not holds:
            raise GraphFileError(line.source, line.number, expected, str(got))

    letters = [key >> INDEX_BITS for key in line.keys]
    known = all(letter == 0 or (0 < letter < 128 and chr(letter) in LETTERS) for letter in letters)
    need(known, "keys whose top byte is 0 or a letter", line.keys)
    need(np.isfinite(values).all(), "finite numbers", values[~np.isfinite(values)])
    if dims == 7:
        norm = np.linalg.norm(values[3:7])
        need(abs(norm - 1.0) <= UNIT_LENGTH_ATOL, "a quaternion of length 1", f"length {norm:.6g}")
    if len(line.keys) == 2:
        need(line.keys[0] != line.keys[1], "an edge between two poses", f"{line.keys[0]} twice")
        information = full(values[None, dims:], FREEDOM[dims])
        need(is_information(information)[0], "a positive definite information matrix", values[dims:])


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
