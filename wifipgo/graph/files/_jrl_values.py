"""Robots, keys and poses of JRL files, checked where they stand."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from jaxtyping import Int

from wifipgo.errors import GraphFileError, require
from wifipgo.files.json_nodes import Node
from wifipgo.graph.files._g2o_keys import INDEX_BITS, LETTERS, robot_of_letter
from wifipgo.graph.posegraph import UNIT_LENGTH_ATOL

DIMS: Mapping[str, int] = MappingProxyType({"Pose2": 3, "Pose3": 7})
MOST_POSE = 10**9  # numbers of poses are smaller: landmarks and velocities of a robot come after


def robot_number(node: Node) -> int:
    """Number of a robot, from its letter or the letter's code."""
    code = ord(node.value) if isinstance(node.value, str) and len(node.value) == 1 else node.value
    robot = robot_of_letter(code) if type(code) is int else None
    if robot is None:
        raise node.refused("a letter that stands for a robot, or its code")
    return robot


def place_of(key: int) -> tuple[int, int]:
    """(robot, index) of a pose's key; keys are checked where they are read."""
    robot = robot_of_letter(key >> INDEX_BITS)
    return -1 if robot is None else robot, key & ((1 << INDEX_BITS) - 1)


def pose_key(node: Node) -> int:
    """A key of a pose: a symbol of a robot's letter, and a number below a thousand million."""
    key = node.whole()
    robot, index = place_of(key)
    if robot < 0 or index >= MOST_POSE:
        raise node.refused("a gtsam symbol of a robot's letter and a pose's number below 1e9")
    return key


def pose(node: Node) -> list[float]:
    """Numbers of a pose, ours."""
    kind = node.field("type").text()
    if kind not in DIMS:
        raise node.field("type").refused(" or ".join(DIMS))
    if DIMS[kind] == 3:
        return [node.field(name).number() for name in ("x", "y", "theta")]
    w, *xyz = node.field("rotation").numbers(4)
    norm = float(np.linalg.norm([w, *xyz]))
    if abs(norm - 1.0) > UNIT_LENGTH_ATOL:
        rule = "a quaternion of length 1"
        raise GraphFileError(node.field("rotation").place, 0, rule, f"length {norm:.6g}")
    return [*node.field("translation").numbers(3), *xyz, w]


def values(by_robot: Node) -> dict[int, list[float]]:
    """Poses by key; of one that several robots have, what the robot says whose it is."""
    own: dict[int, list[float]] = {}
    others: dict[int, list[float]] = {}
    for letter, node in by_robot.table().items():
        robot = robot_number(Node(letter, node.place))
        for key, value in poses_of(node).items():
            (own if place_of(key)[0] == robot else others).setdefault(key, value)
    return others | own


def poses_of(node: Node) -> dict[int, list[float]]:
    """Poses of one robot's values, a list or a table by key; points and vectors are left out."""
    found: dict[int, list[float]] = {}
    for key_node, value in _keyed(node):
        if value.field("type").text() not in DIMS:
            continue
        key = pose_key(key_node)
        if key in found:
            raise key_node.refused("each key once")
        found[key] = pose(value)
    return found


def _keyed(node: Node) -> list[tuple[Node, Node]]:
    """Keys and values."""
    if not isinstance(node.value, dict):
        return [(value.field("key"), value) for value in ([] if node.value is None else node.items())]
    return [
        (Node(int(key) if key.isascii() and key.isdecimal() else key, value.place), value)
        for key, value in node.table().items()
    ]


def letters_of(robots: Int[np.ndarray, " robots"]) -> list[str]:
    """Letters that stand for robots.

    Raises:
        ValueError: There are more robots than letters.
    """
    last = int(robots.max(initial=0))
    require(last < len(LETTERS), "robot", f"below {len(LETTERS)}, the number of letters", last)
    return [LETTERS[robot] for robot in robots.tolist()]
