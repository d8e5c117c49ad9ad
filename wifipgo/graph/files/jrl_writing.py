"""JRL files of teams, as their own program reads them: a data set, and results."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from wifipgo.files.json_nodes import Node
from wifipgo.graph.files._g2o_keys import LETTERS
from wifipgo.graph.files._jrl_values import DIMS, letters_of, place_of, poses_of, robot_number
from wifipgo.graph.files._json_files import content, write_content
from wifipgo.graph.files.g2o import symbols
from wifipgo.graph.files.jrl import KNOWN_SIGMA, ORDER
from wifipgo.graph.posegraph import PoseGraph

# Whose poses, by robot: number of the pose, and its value.
Solutions = Mapping[int, Mapping[tuple[int, int], list[float]]]


def write_jrl(
    path: str | Path,
    graph: PoseGraph,
    *,
    name: str,
    fixed: Int[np.ndarray, " fixed"] | None = None,
    truth: Float[np.ndarray, "poses dims"] | None = None,
) -> None:
    """Write a data set: measurements, poses as the initialization, and the truth where it is known.

    A measurement is its tail's robot's; its time stamp is the higher number of that robot's poses in it, as
    if each took as long. Weights scale the information, and what has none is left out. Known poses get a
    prior.

    Args:
        path: The file, ``.jrl`` or, as CBOR, ``.cbor``.
        graph: What to write.
        name: Of the data set.
        fixed: Rows of poses that are known.
        truth: True poses; rows of nan are left out.

    Raises:
        ValueError: There are more robots than letters.
    """
    path = Path(path)
    letters, keys = letters_of(graph.robots), symbols(graph).tolist()
    table: dict[str, object] = {
        "name": name,
        "robots": [ord(letter) for letter in letters],
        "measurements": {
            letter: _entries(graph, keys, robot, fixed)
            for letter, robot in zip(letters, graph.robots.tolist(), strict=True)
        },
        "initialization": _by_robot(graph, keys, graph.poses),
    }
    if truth is not None:
        table["groundtruth"] = _by_robot(graph, keys, truth)
    write_content(path, table)


def write_jrr(path: str | Path, solutions: Solutions, *, name: str, method: str) -> None:
    """Write results: what each robot holds for its own poses and for those of others that it knows.

    Args:
        path: The file, ``.jrr`` or, as CBOR, ``.cbor``.
        solutions: By robot, poses by (robot, index).
        name: Of the data set.
        method: What found them.
    """
    path = Path(path)
    letters = letters_of(np.array(sorted(solutions), dtype=np.int64))
    table = {
        letter: [
            {"key": ord(LETTERS[whose]) << 56 | index, **_value(row)} for (whose, index), row in held.items()
        ]
        for letter, (_, held) in zip(letters, sorted(solutions.items()), strict=True)
    }
    head = {"dataset_name": name, "method_name": method, "robots": [ord(letter) for letter in letters]}
    write_content(path, {**head, "solutions": table})


def read_jrr(path: str | Path) -> dict[int, dict[tuple[int, int], list[float]]]:
    """What each robot holds, by robot: poses by (robot, index).

    Raises:
        GraphFileError: A field is missing or is not what it should be; names it.
        OSError: The file cannot be read.
    """
    path = Path(path)
    root = Node(content(path), f"{path}:")
    return {
        robot_number(Node(letter, node.place)): {place_of(key): row for key, row in poses_of(node).items()}
        for letter, node in root.field("solutions").table().items()
    }


def shared_solutions(graph: PoseGraph, poses: Float[np.ndarray, "poses dims"]) -> Solutions:
    """What robots hold that agree: their own poses, and others' that a measurement ties to these."""
    held: dict[int, set[int]] = {robot: set() for robot in graph.robots.tolist()}
    for row, robot in enumerate(graph.robot.tolist()):
        held[robot].add(row)
    for i, j in zip(graph.tail.tolist(), graph.head.tolist(), strict=True):
        held[int(graph.robot[i])].add(j)
        held[int(graph.robot[j])].add(i)
    place = list(zip(graph.robot.tolist(), graph.index.tolist(), strict=True))
    return {robot: {place[r]: poses[r].tolist() for r in sorted(rows)} for robot, rows in held.items()}


def _value(row: list[float]) -> dict[str, object]:
    """A pose as JRL has it."""
    kind = next(name for name, dims in DIMS.items() if dims == len(row))
    if kind == "Pose2":
        return {"type": kind, "x": row[0], "y": row[1], "theta": row[2]}
    return {"type": kind, "translation": row[:3], "rotation": [row[6], *row[3:6]]}


def _by_robot(
    graph: PoseGraph, keys: list[int], poses: Float[np.ndarray, "poses dims"]
) -> dict[str, list[dict[str, object]]]:
    """Poses of each robot, those that are known."""
    there = np.isfinite(poses).all(axis=1)
    return {
        LETTERS[robot]: [
            {"key": keys[row], **_value(poses[row].tolist())}
            for row in np.flatnonzero((graph.robot == robot) & there).tolist()
        ]
        for robot in graph.robots.tolist()
    }


def _entries(
    graph: PoseGraph, keys: list[int], robot: int, fixed: Int[np.ndarray, " fixed"] | None
) -> list[dict[str, object]]:
    """What one robot measured, by time stamp."""
    by_stamp: dict[int, list[dict[str, object]]] = {}
    kind, order = f"Pose{2 if graph.freedom == 3 else 3}", ORDER[graph.poses.shape[1]]
    sure = (0.1 * KNOWN_SIGMA) ** 2 * np.eye(graph.freedom)
    for row in [] if fixed is None else fixed[graph.robot[fixed] == robot].tolist():
        prior = {"key": keys[row], "prior": _value(graph.poses[row].tolist())}
        told = {"type": f"PriorFactor{kind}", **prior, "covariance": sure.ravel().tolist()}
        by_stamp.setdefault(int(graph.index[row]), []).append(told)
    for k in np.flatnonzero((graph.robot[graph.tail] == robot) & (graph.weight > 0.0)).tolist():
        i, j = int(graph.tail[k]), int(graph.head[k])
        covariance = np.linalg.inv(graph.information[k] * graph.weight[k])[order][:, order]
        told = {
            "type": f"BetweenFactor{kind}",
            "key1": keys[i],
            "key2": keys[j],
            "measurement": _value(graph.z[k].tolist()),
            "covariance": (0.5 * (covariance + covariance.T)).ravel().tolist(),
        }
        later = max(graph.index[i], graph.index[j] if graph.robot[j] == robot else 0)
        by_stamp.setdefault(int(later), []).append(told)
    return [{"stamp": stamp, "measurements": by_stamp[stamp]} for stamp in sorted(by_stamp)]
