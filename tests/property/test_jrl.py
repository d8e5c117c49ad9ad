"""JRL and dpgo's files hold the graph that was written; what is wrong in one is named by field or line."""

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import gtsam
import numpy as np
import pytest
from support.graphs import random_graph

from wifipgo import se3
from wifipgo.errors import BadInputError, GraphFileError, TextFileError
from wifipgo.graph.files.dpgo_csv import read_dpgo_csv
from wifipgo.graph.files.graph_files import cut, read_graph
from wifipgo.graph.files.jrl import read_jrl
from wifipgo.graph.files.jrl_writing import read_jrr, shared_solutions, write_jrl, write_jrr
from wifipgo.graph.residuals import chi_squares

A, B = ord("a") << 56, ord("b") << 56
HEAD = "robot_src,pose_src,robot_dst,pose_dst,qx,qy,qz,qw,tx,ty,tz,kappa,tau,is_known_inlier,weight"


def as_program(pose: Sequence[float]) -> dict[str, Any]:
    """A pose of the plane as JRL's own program writes it."""
    return {"type": "Pose2", "x": pose[0], "y": pose[1], "theta": pose[2]}


def small_set() -> dict[str, Any]:
    """Two robots of two poses each, which see each other at the end, by hand."""

    def between(i: int, j: int, pose: list[float]) -> dict[str, Any]:
        covariance = [0.01, 0.0, 0.0, 0.0, 0.01, 0.0, 0.0, 0.0, 0.0004]
        ends = {"type": "BetweenFactorPose2", "key1": i, "key2": j}
        return {**ends, "measurement": as_program(pose), "covariance": covariance}

    met = between(A + 1, B + 1, [0.0, 2.0, 0.0])
    start = {A: [0, 0, 0], A + 1: [1, 0, 0], B: [0, 2, 0], B + 1: [1, 2, 0]}
    values = {
        letter: [{"key": k, **as_program(pose)} for k, pose in start.items() if k >> 56 == ord(letter)]
        for letter in "ab"
    }
    a = [{"stamp": 0}, {"stamp": 5, "measurements": [between(A, A + 1, [1.1, 0.0, 0.0]), met]}]
    b = [
        {"stamp": 3, "measurements": [between(B, B + 1, [0.9, 0.0, 0.1])]},
        {"stamp": 5, "measurements": [met]},
    ]
    return {"name": "two", "robots": [97, 98], "measurements": {"a": a, "b": b}, "initialization": values}


def written(path: Path, table: object) -> Path:
    path.write_text(json.dumps(table))
    return path


@pytest.mark.parametrize("dims", [3, 7])
@pytest.mark.parametrize("suffix", ["jrl", "cbor"])
def test_what_is_written_is_read(tmp_path: Path, dims: int, suffix: str) -> None:
    truth, graph = random_graph(3, dims=dims)
    known = truth.copy()
    known[2] = np.nan
    place = tmp_path / f"team.{suffix}"
    write_jrl(place, graph, name="team", fixed=np.array([0, 4]), truth=known)
    again = read_graph(place)
    assert (again.name, again.format, again.guessed) == ("team", "JRL", False)
    np.testing.assert_array_equal(again.fixed, [0, 4])
    assert again.truth is not None
    np.testing.assert_allclose(again.truth, known, atol=1e-12)
    np.testing.assert_allclose(again.graph.poses, graph.poses, atol=1e-12)
    np.testing.assert_array_equal(again.graph.tail, graph.tail)
    weighed = graph.information * graph.weight[:, None, None]
    np.testing.assert_allclose(again.graph.information, weighed, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(chi_squares(again.graph, truth), chi_squares(graph, truth), rtol=1e-6)


def test_covariances_are_in_the_order_of_gtsam(tmp_path: Path) -> None:
    """The chi-square of a measurement in space is that of gtsam's factor with the file's own numbers."""
    rng = np.random.default_rng(4)
    root = rng.normal(size=(6, 6))
    covariance = root @ root.T + np.eye(6)
    poses = se3.exp(rng.normal(size=(2, 6)))
    z = se3.exp(rng.normal(size=(1, 6)))[0]

    def value(row: np.ndarray) -> dict[str, Any]:
        return {"type": "Pose3", "translation": row[:3].tolist(), "rotation": row[[6, 3, 4, 5]].tolist()}

    def theirs(row: np.ndarray) -> gtsam.Pose3:
        return gtsam.Pose3(gtsam.Rot3.Quaternion(row[6], *row[3:6]), row[:3])

    met = {"type": "BetweenFactorPose3", "key1": A, "key2": A + 1, "measurement": value(z)}
    entry = {"stamp": 1, "measurements": [{**met, "covariance": covariance.ravel().tolist()}]}
    start = {"a": {str(A + k): value(row) for k, row in enumerate(poses)}}  # a table by key, as documented
    table = {"name": "x", "robots": ["a"], "measurements": {"a": [entry]}, "initialization": start}
    graph = read_jrl(written(tmp_path / "x.jrl", table)).graph
    factor = gtsam.BetweenFactorPose3(0, 1, theirs(z), gtsam.noiseModel.Gaussian.Covariance(covariance))
    values = gtsam.Values()
    for k, row in enumerate(poses):
        values.insert(k, theirs(row))
    np.testing.assert_allclose(chi_squares(graph, graph.poses)[0], 2.0 * factor.error(values), rtol=1e-9)


def test_a_meeting_that_both_tell_counts_once(tmp_path: Path) -> None:
    reading = read_jrl(written(tmp_path / "two.jrl", small_set()))
    assert (len(reading.graph.poses), len(reading.graph.tail)) == (4, 3)
    np.testing.assert_array_equal(reading.graph.robot, [0, 0, 1, 1])
    np.testing.assert_allclose(reading.graph.information[0], np.diag([100.0, 100.0, 2500.0]))


def test_without_initialization_odometry_leads(tmp_path: Path) -> None:
    table = small_set()
    del table["initialization"]
    reading = read_jrl(written(tmp_path / "two.jrl", table))
    assert reading.guessed
    np.testing.assert_allclose(reading.graph.poses[1], [1.1, 0.0, 0.0])
    np.testing.assert_allclose(reading.graph.poses[3, :2], [1.1, 2.0])


def change(*path: str | int, to: object) -> Callable[[dict[str, Any]], None]:
    def do(table: Any) -> None:
        for word in path[:-1]:
            table = table[word]
        table[path[-1]] = to

    return do


FIRST = ("measurements", "a", 1, "measurements", 0)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (change("version", to=2), "two.jrl: version: expected version 1 of JRL, .* got 2"),
        (change("robot_names", to=[]), "two.jrl: robot_names: expected one of name, robots"),
        (change(*FIRST, "type", to="BetweenFactorPose4"), r"measurements.a\[1\].measurements\[0\].type"),
        (
            change(*FIRST, "key2", to=A + 9),
            r"measurements\[0\].key2: expected a pose that is there: .* pose 9",
        ),
        (change(*FIRST, "key2", to=A), "key2: expected another pose than key1"),
        (change(*FIRST, "key1", to=-1), "key1: expected a whole number"),
        (change(*FIRST, "key1", to=7), "key1: expected a gtsam symbol"),
        (change(*FIRST, "measurement", "x", to="1"), "measurement.x: expected a finite number, got '1'"),
        (change(*FIRST, "measurement", "x", to=float("nan")), "measurement.x: expected a finite number"),
        (change(*FIRST, "covariance", to=[1.0] * 9), "covariance: expected a positive definite"),
        (change(*FIRST, "covariance", to=[1.0] * 8), "covariance: expected 9 numbers, got 8"),
        (change("measurements", "b", 1, "stamp", to=2), r"b\[1\].stamp: expected not before .* at 3, got 2"),
        (change("measurements", "b", 1, "stamp", to=2.5), r"b\[1\].stamp: expected a whole number"),
        (change("measurements", "c", to=[]), "measurements.c: expected a robot of the field 'robots'"),
        (change("robots", to=["a", "?"]), r"robots\[1\]: expected a letter"),
        (change("initialization", "b", 0, "theta", to=None), r"initialization.b\[0\].theta"),
        (change("initialization", "b", 0, "key", to=B + 1), "key: expected each key once"),
        (change("initialization", "b", 0, "type", to="Pose3"), "expected a field 'rotation', got none"),
        (change("measurements", to=7), "two.jrl: measurements: expected a table"),
    ],
)
def test_what_is_wrong_is_named(
    tmp_path: Path, wrong: Callable[[dict[str, Any]], None], message: str
) -> None:
    table = small_set()
    wrong(table)
    with pytest.raises(GraphFileError, match=message):
        read_jrl(written(tmp_path / "two.jrl", table))


def test_priors_hold_poses(tmp_path: Path) -> None:
    table = small_set()
    prior = {
        "type": "PriorFactorPose2",
        "key": B,
        "prior": as_program([5, 5, 0]),
        "covariance": [1, 0, 0] * 3,
    }
    loose = {**prior, "key": B + 1}
    for one in (prior, loose):
        one["covariance"] = np.eye(3).ravel().tolist()
    table["measurements"]["b"][0]["measurements"].append(prior)
    reading = read_jrl(written(tmp_path / "one.jrl", table))
    np.testing.assert_array_equal(reading.graph.poses[reading.fixed], [[5, 5, 0]])
    table["measurements"]["b"][0]["measurements"].append(loose)
    place = written(tmp_path / "more.jrl", table)
    with pytest.raises(GraphFileError, match=r"b\[0\].measurements\[2\]: expected one prior"):
        read_jrl(place)
    assert read_jrl(place, lenient=True).skipped == {"PriorFactor beyond the first": 1}


@pytest.mark.parametrize("data", [b"", b"\xff", b"\x9f" * 5000, b"\xa1\x01\x02"])
def test_bytes_that_are_no_cbor(tmp_path: Path, data: bytes) -> None:
    place = tmp_path / "x.cbor"
    place.write_bytes(data)
    with pytest.raises(BadInputError, match=r"x.cbor"):
        read_jrl(place)


def test_results_hold_what_each_robot_knows(tmp_path: Path) -> None:
    truth, graph = random_graph(5)
    write_jrr(tmp_path / "r.jrr", shared_solutions(graph, truth), name="x", method="y")
    held = read_jrr(tmp_path / "r.jrr")
    places = list(zip(graph.robot.tolist(), graph.index.tolist(), strict=True))
    for i, j in zip(graph.tail.tolist(), graph.head.tolist(), strict=True):
        for robot in {int(graph.robot[i]), int(graph.robot[j])}:
            np.testing.assert_allclose(held[robot][places[i]], truth[i], atol=1e-12)


def csv_line(ends: tuple[int, ...], twist: list[float]) -> str:
    row = se3.exp(np.array([twist]))[0]
    return ",".join(map(repr, (*ends, *row[3:].tolist(), *row[:3].tolist(), 10000.0, 100.0, 0, 1)))


def test_logs_of_dpgo(tmp_path: Path) -> None:
    """Near the optimum the squares of its program are our chi-square: kappa and tau mean what they should."""
    step, met = [1.0, 0, 0, 0, 0, 0.1], [0.0, 2, 0, 0, 0, 0]
    shared = csv_line((0, 1, 3, 8), met)
    for name, own in (("robot0", (0, 0, 0, 1)), ("robot3", (3, 7, 3, 8))):
        (tmp_path / f"{name}.csv").write_text(f"{HEAD}\n{csv_line(own, step)}\n{shared}\n")
    reading = read_graph(tmp_path)
    graph = reading.graph
    assert (reading.guessed, reading.format, len(graph.tail)) == (True, "dpgo CSV", 3)
    np.testing.assert_array_equal(np.stack([graph.robot, graph.index], 1), [[0, 0], [0, 1], [3, 7], [3, 8]])
    np.testing.assert_allclose(chi_squares(graph, graph.poses), 0.0, atol=1e-12)
    off = graph.poses.copy()
    off[1] = se3.compose(off[1], se3.exp(np.array([0.01, 0, 0.02, 1e-3, 0, -2e-3])))
    R, t_m = se3.rotation_matrix(off[:, 3:]), off[:, :3]
    Rz, tz_m = se3.rotation_matrix(graph.z[:, 3:]), graph.z[:, :3]
    i, j = graph.tail, graph.head
    turn = ((R[j] - R[i] @ Rz) ** 2).sum(axis=(1, 2))
    move = ((t_m[j] - t_m[i] - (R[i] @ tz_m[..., None])[..., 0]) ** 2).sum(axis=1)
    np.testing.assert_allclose(chi_squares(graph, off), 10000.0 * turn + 100.0 * move, rtol=1e-3, atol=1e-9)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("0,1,0,2,0,0,0,0,1,0,0,1,1,1,1", "r.csv:2: expected a quaternion of length 1, got length 0"),
        ("0,1,0,1,0,0,0,1,1,0,0,1,1,1,1", "r.csv:2: expected a measurement between two poses"),
        ("0,1,0,2,0,0,0,1,1,0,0,0,1,1,1", "r.csv:2: expected kappa and tau > 0"),
        ("0,1,0,2,0,0,0,1,1,0,0,1,1,1", "r.csv:2: expected 15 values"),
        ("0,1.5,0,2,0,0,0,1,1,0,0,1,1,1,1", "r.csv:2: expected a whole number"),
        ("0,-1,0,2,0,0,0,1,1,0,0,1,1,1,1", "r.csv:2: expected robots and poses"),
        ("0,1,0,2,0,0,0,1,inf,0,0,1,1,1,1", "r.csv:2: expected finite"),
    ],
)
def test_a_line_of_dpgo_that_is_wrong(tmp_path: Path, line: str, message: str) -> None:
    place = tmp_path / "r.csv"
    place.write_text(f"{HEAD}\n{line}\n")
    with pytest.raises(TextFileError, match=message):
        read_dpgo_csv(place)


def test_a_lone_robot_is_cut(tmp_path: Path) -> None:
    _, graph = random_graph(6, robots=1, poses=11)
    write_jrl(tmp_path / "one.jrl", graph, name="one")
    reading = read_graph(tmp_path / "one.jrl")
    team = cut(reading, 3)
    assert np.bincount(team.graph.robot).tolist() == [4, 4, 3]
    np.testing.assert_allclose(chi_squares(team.graph, graph.poses), chi_squares(reading.graph, graph.poses))
    with pytest.raises(ValueError, match=r"robots must be in 1..11"):
        cut(reading, 12)
    with pytest.raises(ValueError, match="robots must be one"):
        cut(team, 2)


def test_other_folders_are_told_apart(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="a file, or a folder with"):
        read_graph(tmp_path)
    _, graph = random_graph(7)
    write_jrl(tmp_path / "x.jrl", graph, name="x")
    with pytest.raises(ValueError, match=r"one of its files: x.jrl"):
        read_graph(tmp_path)
    with pytest.raises(ValueError, match="exists"):
        read_graph(tmp_path / "nothing")
