"""Data sets of teams in JRL files (JSON Robot Log), the format of COSMO-Bench, as JSON or CBOR.

The format is that of ``DanMcGann/jrl``. Its documents and its program write some fields differently: robots
as letters or as their codes, values as a table by key or as a list; both are read, and what its program
reads is written. Keys are gtsam symbols whose letter is the robot. Covariances are of (rotation,
translation) in space, as gtsam orders them, those of `PoseGraph` of (translation, rotation).
"""

from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from wifipgo.errors import GraphFileError
from wifipgo.files.json_nodes import Node
from wifipgo.graph.files._g2o_keys import LETTERS
from wifipgo.graph.files._jrl_values import DIMS, place_of, pose, pose_key, robot_number, values
from wifipgo.graph.files._json_files import content
from wifipgo.graph.files.g2o import Reading
from wifipgo.graph.first_guess import first_guess
from wifipgo.graph.posegraph import FREEDOM, is_information, keys_of, pose_graph, rows_of

JRL = "JRL"
VERSION = 1  # of the format; its files tell none, so far
FIELDS = ("name", "robots", "measurements", "groundtruth", "initialization")
OUTLIERS = ("potential_outlier_factors", "outlier_factors")  # labels: not looked at
BETWEEN: Mapping[str, int] = MappingProxyType({f"BetweenFactor{pose}": n for pose, n in DIMS.items()})
PRIOR: Mapping[str, int] = MappingProxyType({f"PriorFactor{pose}": n for pose, n in DIMS.items()})
# Of points: no part of a pose graph.
LANDMARKS = frozenset(
    {f"{kind}Factor{d}D" for kind in ("Range", "BearingRange") for d in (2, 3)}
    | {f"{kind}FactorPoint{d}" for kind in ("Prior", "Between") for d in (2, 3)}
)
KNOWN_SIGMA = 1e-3  # m and rad: a prior as sure as this holds its pose, whatever else is there
# From gtsam's order of the tangent space to ours; it is its own inverse.
ORDER: Mapping[int, list[int]] = MappingProxyType({3: [0, 1, 2], 7: [3, 4, 5, 0, 1, 2]})


class Between(NamedTuple):
    """A measurement between two poses, and where it stands."""

    keys: tuple[int, int]
    z: list[float]
    covariance: list[float]
    node: Node


class Measured(NamedTuple):
    """What a data set's robots measured.

    Attributes:
        between: Each measurement once, though two robots may tell of it.
        known: Poses that a prior holds, and where it stands, by key.
        skipped: Types that play no part, and how many there are of each.
    """

    between: list[Between]
    known: dict[int, tuple[list[float], Node]]
    skipped: Counter[str]


def read_jrl(path: str | Path, *, lenient: bool = False) -> Reading:
    """Read a data set, ``.jrl`` (JSON) or ``.cbor``.

    Poses begin at the initialization; without one at a first guess along the odometry. A prior holds its
    pose, and so a robot may have one; more only if they are sure to a millimetre.

    Args:
        path: The file.
        lenient: Skip fields and measurements of unknown kinds, and report them.

    Raises:
        GraphFileError: A field is missing or is not what it should be, a pose is not there, or a field, a
            kind of measurement or a version is unknown; names the field.
        BadInputError: The file is no JSON or CBOR; a package for CBOR is not installed.
        OSError: It cannot be read.
    """
    path = Path(path)
    root = Node(content(path), f"{path}:")
    skipped = _unknown_fields(root, lenient=lenient)
    robots = {robot_number(node) for node in root.field("robots").items()}
    told = _measured(root.field("measurements"), robots, skipped, lenient=lenient)
    fields = root.table()
    start = values(fields["initialization"]) if "initialization" in fields else {}
    graph_keys = sorted(start or {key for one in told.between for key in one.keys})
    if not graph_keys:
        raise GraphFileError(str(path), 0, "at least one pose", "none")
    truth = values(fields["groundtruth"]) if "groundtruth" in fields else None
    return _reading(root, told, start, graph_keys, truth)


def _reading(
    root: Node,
    told: Measured,
    start: dict[int, list[float]],
    keys: list[int],
    truth: dict[int, list[float]] | None,
) -> Reading:
    """Graph and the rest, from what the file says by key."""
    dims = len(next(iter((*start.values(), *(one.z for one in told.between)))))
    _check_ends(told, set(keys), dims)
    here = [0.0] * (dims - 1) + [float(dims == 7)]
    place = np.array([place_of(key) for key in keys], dtype=np.int64)
    ends = np.array([[place_of(key) for key in one.keys] for one in told.between], dtype=np.int64)
    graph = pose_graph(
        robot=place[:, 0],
        index=place[:, 1],
        poses=np.array([told.known[key][0] if key in told.known else start.get(key, here) for key in keys]),
        tail=ends.reshape(-1, 2, 2)[:, 0],
        head=ends.reshape(-1, 2, 2)[:, 1],
        z=np.array([one.z for one in told.between]).reshape(-1, dims),
        information=_information(told.between, dims),
    )
    graph = graph if start else graph.with_poses(first_guess(graph))
    known = np.array([place_of(key) for key in told.known], dtype=np.int64)
    key_of = {place_of(key): key for key in keys}
    ordered = [key_of[robot, index] for robot, index in keys_of(graph).tolist()]
    return Reading(
        graph=graph,
        keys=np.array(ordered, dtype=np.uint64),
        skipped=dict(told.skipped),
        fixed=np.unique(rows_of(keys_of(graph), known.reshape(-1, 2), "prior")),
        guessed=not start,
        truth=None if truth is None else np.array([truth.get(key, [np.nan] * dims) for key in ordered]),
        name=root.field("name").text(),
        format=JRL,
    )


def _unknown_fields(root: Node, *, lenient: bool) -> Counter[str]:
    """Fields of no version that is known, which are refused unless that is wanted."""
    skipped: Counter[str] = Counter()
    for name, node in root.table().items():
        if name == "version":
            if node.value not in (VERSION, str(VERSION), f"{VERSION}.0"):
                raise node.refused(f"version {VERSION} of JRL, which is the one that is read")
        elif name not in (*FIELDS, *OUTLIERS):
            if not lenient:
                known = ", ".join((*FIELDS, *OUTLIERS))
                raise GraphFileError(node.place, 0, f"one of {known} (--lenient skips others)", repr(name))
            skipped[name[:40]] += 1
    return skipped


def _measured(by_robot: Node, robots: set[int], skipped: Counter[str], *, lenient: bool) -> Measured:
    """Measurements of all robots."""
    told = Measured([], {}, skipped)
    seen: dict[tuple[int, int], list[list[float]]] = {}
    for letter, entries in by_robot.table().items():
        if robot_number(Node(letter, entries.place)) not in robots:
            raise GraphFileError(entries.place, 0, "a robot of the field 'robots'", repr(letter))
        earlier = {keys: list(found) for keys, found in seen.items()}
        priors: set[int] = set()
        for node in _in_order(entries):
            kind = node.field("type").text()
            if kind in BETWEEN:
                one = _between(node)
                if one.z not in earlier.get(one.keys, []):
                    told.between.append(one)
                    seen.setdefault(one.keys, []).append(one.z)
            elif kind in PRIOR:
                _prior(node, told, priors, lenient=lenient)
            elif kind in LANDMARKS or lenient:
                skipped[kind[:40]] += 1
            else:
                known = ", ".join((*BETWEEN, *PRIOR, *sorted(LANDMARKS)))
                raise node.field("type").refused(f"one of {known} (--lenient skips others)")
    return told


def _in_order(entries: Node) -> Iterator[Node]:
    """Measurements of one robot's entries, whose time stamps must not fall."""
    last = 0
    for entry in [] if entries.value is None else entries.items():
        stamp = entry.field("stamp")
        if stamp.whole() < last:
            raise stamp.refused(f"not before the entry above, at {last}")
        last = stamp.whole()
        inside = entry.table().get("measurements")
        yield from [] if inside is None or inside.value is None else inside.items()


def _between(node: Node) -> Between:
    """A measurement between two poses."""
    z = pose(node.field("measurement"))
    ends = (pose_key(node.field("key1")), pose_key(node.field("key2")))
    if ends[0] == ends[1]:
        raise node.field("key2").refused("another pose than key1")
    return Between(ends, z, node.field("covariance").numbers(FREEDOM[len(z)] ** 2), node)


def _prior(node: Node, told: Measured, priors: set[int], *, lenient: bool) -> None:
    """A pose that is known; the first of a robot, or as sure as what is known."""
    key, value = pose_key(node.field("key")), pose(node.field("prior"))
    covariance = node.field("covariance").numbers(FREEDOM[len(value)] ** 2)
    sure = max(covariance[:: FREEDOM[len(value)] + 1]) <= KNOWN_SIGMA**2
    if priors - {key} and not sure:
        if not lenient:
            rule = "one prior of a robot, which holds its pose, or all of them sure to 1 mm (--lenient skips)"
            raise GraphFileError(node.place, 0, rule, "another one")
        told.skipped["PriorFactor beyond the first"] += 1
        return
    priors.add(key)
    told.known[key] = (value, node)


def _check_ends(told: Measured, keys: set[int], dims: int) -> None:
    """Refuse measurements of poses that are nowhere, and those of another space than the poses."""
    ends = [(key, one.node, f"key{k}") for one in told.between for k, key in enumerate(one.keys, 1)]
    for key, node, name in [*ends, *((key, node, "key") for key, (_, node) in told.known.items())]:
        if key not in keys:
            robot, index = place_of(key)
            rule = f"a pose that is there: no initialization has pose {index} of {LETTERS[robot]!r}"
            raise node.field(name).refused(rule)
    for z, node in [*((one.z, one.node) for one in told.between), *told.known.values()]:
        if len(z) != dims:
            raise node.field("type").refused(f"of Pose{2 if dims == 3 else 3}, as the first pose")


def _information(between: list[Between], dims: int) -> Float[np.ndarray, "edges freedom freedom"]:
    """Inverse covariances, translation first."""
    freedom, order = FREEDOM[dims], ORDER[dims]
    matrices = np.array([one.covariance for one in between]).reshape(-1, freedom, freedom)
    matrices = matrices[:, order][:, :, order]
    bad = np.flatnonzero(~is_information(matrices))
    if len(bad):
        raise between[bad[0]].node.field("covariance").refused("a positive definite covariance matrix")
    return np.linalg.inv(matrices) if len(matrices) else matrices
