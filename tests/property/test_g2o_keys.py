"""Whose pose a key names is what the file says, or the file is refused."""

import codecs
import itertools
from pathlib import Path

import numpy as np
import pytest
from support.graphs import random_graph

from wifipgo.errors import GraphFileError, TextFileError
from wifipgo.graph.files.g2o import read_g2o, write_g2o
from wifipgo.graph.posegraph import PoseGraph
from wifipgo.graph.residuals import chi_squares

ONE = "1 0 0 1 0 1"


def symbol(letter: str, index: int, label: str = "\0") -> int:
    """Key as gtsam's Symbol or LabeledSymbol makes it."""
    return ord(letter) << 56 | ord(label) << 48 | index


def chain(*keys: int) -> str:
    """Poses one metre apart, and the way from each to the next."""
    vertices = [f"VERTEX_SE2 {key} {k} 0 0" for k, key in enumerate(keys)]
    edges = [f"EDGE_SE2 {a} {b} 1 0 0 {ONE}" for a, b in itertools.pairwise(keys)]
    return "\n".join([*vertices, *edges]) + "\n"


def owners(graph: PoseGraph) -> list[tuple[int, int]]:
    return list(zip(graph.robot.tolist(), graph.index.tolist(), strict=True))


def folder(path: Path, **files: str) -> Path:
    path.mkdir(exist_ok=True)
    for name, text in files.items():
        (path / f"{name.removeprefix('_')}.g2o").write_text(text)
    return path


def test_plain_keys_are_of_the_robot_in_the_name(tmp_path: Path) -> None:
    team = folder(tmp_path / "team", _7=chain(5, 6), _1=chain(1, 2), _10=chain(70), notes="nothing of ours")
    reading = read_g2o(team)
    assert owners(reading.graph) == [(1, 1), (1, 2), (7, 5), (7, 6), (10, 70)]
    assert reading.left_out == ("notes.g2o",)
    write_g2o(tmp_path / "again", reading.graph, keys=reading.keys)
    assert sorted(p.name for p in (tmp_path / "again").iterdir()) == ["1.g2o", "10.g2o", "7.g2o"]
    assert owners(read_g2o(tmp_path / "again").graph) == owners(reading.graph)
    assert owners(read_g2o(team / "7.g2o").graph) == [(7, 5), (7, 6)]


def test_labels_of_labelled_symbols_are_robots(tmp_path: Path) -> None:
    place = tmp_path / "team.g2o"
    keys = [symbol("l", k, label) for label in "ab" for k in (0, 3)]
    place.write_text(chain(*keys))
    reading = read_g2o(place)
    assert owners(reading.graph) == [(0, 0), (0, 3), (1, 0), (1, 3)]
    assert reading.keys.tolist() == keys


A, B, X_A = symbol("a", 0), symbol("b", 0), symbol("x", 0, "a")


@pytest.mark.parametrize(
    ("files", "message"),
    [
        ({"all": chain(A, 1)}, r"all.g2o:2: expected symbols as keys, like .* in .*all.g2o:1, got 1"),
        ({"all": chain(A, X_A)}, r"all.g2o:2: expected symbols as keys"),
        ({"all": chain(symbol("y", 0, "a"), X_A)}, r"all.g2o:2: expected one key for pose 0 of robot 0"),
        ({"all": chain(symbol("a", 0, "1"))}, r"all.g2o:1: expected keys below 2\^48 or gtsam symbols"),
        ({"all": chain(2**48)}, r"all.g2o:1: expected keys below 2\^48"),
        ({"all": chain(-1)}, r"all.g2o:1: expected keys below 2\^48"),
        ({"all": chain(2**70)}, r"all.g2o:1: expected keys below 2\^48"),
        ({"_0": chain(1), "_1": chain(1)}, r"1.g2o:1: expected each vertex once, got vertex 1 again"),
        ({"_0": chain(A), "_1": chain(7)}, r"1.g2o:1: expected symbols as keys"),
        ({"_0": chain(B), "_1": chain(A)}, r"0.g2o:1: expected poses of robot 0 \('a'\), as the file's name"),
        ({"_0": chain(A), "_1": chain(B) + f"VERTEX_SE2 {A} 9 0 0\n"}, r"1.g2o:2: expected each vertex once"),
        ({"_7": chain(1), "_07": chain(2)}, r"7.g2o: expected one file of robot 7"),
        ({"_99999999999999999999": chain(1)}, r"must be a robot's number, below"),
    ],
)
def test_what_could_be_two_robots_is_refused(tmp_path: Path, files: dict[str, str], message: str) -> None:
    place = folder(tmp_path / "team", **files)
    with pytest.raises(ValueError, match=message):
        read_g2o(place / "all.g2o" if "all" in files else place)


def test_a_symbol_may_be_told_again_by_another_robot(tmp_path: Path) -> None:
    team = folder(tmp_path / "team", _0=chain(A), _1=chain(A, B))
    assert owners(read_g2o(team).graph) == [(0, 0), (1, 0)]


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_any_editor(tmp_path: Path, end: str) -> None:
    _, graph = random_graph(5)
    graph = graph.with_weight(np.ones(len(graph.tail)))
    write_g2o(tmp_path / "plain.g2o", graph)
    lines = (tmp_path / "plain.g2o").read_text().splitlines()
    text = end.join(f"\f{line.replace(' ', chr(9), 1)} \v" for line in lines) + 2 * end
    (tmp_path / "edited.g2o").write_bytes(codecs.BOM_UTF8 + text.encode())
    again = read_g2o(tmp_path / "edited.g2o").graph
    np.testing.assert_array_equal(again.poses, read_g2o(tmp_path / "plain.g2o").graph.poses)
    np.testing.assert_array_equal(again.z, graph.z)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("VERTEX_SE2 1 1,5 0 0", r"bad.g2o:2: expected a number with a decimal point, got a comma in '1,5'"),
        ("VERTEX_SE2 1_0 1 0 0", r"bad.g2o:2: expected a whole number, got '1_0'"),
        ("VERTEX_SE2 1 1_5 0 0", r"bad.g2o:2: expected a number, got '1_5'"),
        ("VERTEX_SE2 1 1e999 0 0", r"bad.g2o:2: expected finite numbers"),
        ("VERTEX_SE2 " + "9" * 10**5 + " 1 0 0", r"bad.g2o:2: expected a whole number, got '9"),
        ("VERTEX_SE2 1 " + "9" * 10**7, r"bad.g2o:2: expected lines of at most"),
        ("FIX 3", r"bad.g2o:2: expected keys of vertices, got no vertex 3"),
        ("FIX", r"bad.g2o:2: expected 1 key and 0 numbers after FIX"),
        ("VERTEX_XY 5 1", r"bad.g2o:2: expected 1 key and 2 numbers after VERTEX_XY"),
    ],
)
def test_a_bad_word_is_named(tmp_path: Path, line: str, message: str) -> None:
    place = tmp_path / "bad.g2o"
    place.write_text(f"VERTEX_SE2 0 0 0 0\n{line}\n")
    with pytest.raises(TextFileError, match=message) as caught:
        read_g2o(place)
    assert len(str(caught.value)) < 700


def test_known_poses_and_landmarks_are_kept(tmp_path: Path) -> None:
    place = tmp_path / "g2o.g2o"
    marks = ["VERTEX_XY 9 1.50 2.", "EDGE_SE2_XY 0 9 1.5 2 1 0 1", "EDGE_BEARING_SE2_XY 1 9 0.5 10"]
    place.write_text(chain(0, 1, 2) + "\n".join([*marks, "FIX 1 2", "FIX 9"]) + "\n")
    reading = read_g2o(place)
    assert reading.fixed.tolist() == [1, 2]
    assert [mark.text for mark in reading.landmarks] == [*marks, "FIX 9"]
    again = tmp_path / "again.g2o"
    write_g2o(again, reading.graph, keys=reading.keys, fixed=reading.fixed, landmarks=reading.landmarks)
    assert set(marks) | {"FIX 1", "FIX 2", "FIX 9"} < set(again.read_text().splitlines())
    assert read_g2o(again).fixed.tolist() == [1, 2]


@pytest.mark.parametrize("dims", [3, 7])
def test_measurements_alone_lead_to_poses_that_fit_them(tmp_path: Path, dims: int) -> None:
    """Without noise, a tree of measurements leads to the truth, seen from the first pose."""
    _truth, graph = random_graph(6, dims=dims, noise=0.0, start_noise=0.0)
    graph = graph.with_weight(np.ones(len(graph.tail)))
    write_g2o(tmp_path / "all.g2o", graph)
    edges = [x for x in (tmp_path / "all.g2o").read_text().splitlines(keepends=True) if x[0] == "E"]
    (tmp_path / "edges.g2o").write_text("".join(edges))
    reading = read_g2o(tmp_path / "edges.g2o")
    assert reading.guessed
    assert owners(reading.graph) == owners(graph)
    np.testing.assert_allclose(chi_squares(reading.graph, reading.graph.poses), 0.0, atol=1e-20)


def test_odometry_leads_before_closed_loops(tmp_path: Path) -> None:
    place = tmp_path / "edges.g2o"
    odometry = "".join(f"EDGE_SE2 {k} {k + 1} 1 0 0 {ONE}\n" for k in range(3))
    place.write_text(f"EDGE_SE2 0 3 77 0 0 {ONE}\n{odometry}EDGE_SE2 3 0 99 0 0 {ONE}\n")
    np.testing.assert_allclose(read_g2o(place).graph.poses[:, 0], [0.0, 1.0, 2.0, 3.0])


def test_whose_a_plain_end_is_must_be_clear(tmp_path: Path) -> None:
    edge = f"EDGE_SE2 2 5 1 0 0 {ONE}\n"
    team = folder(tmp_path / "team", _1=edge, _7=edge)
    with pytest.raises(GraphFileError, match=r"7.g2o:1: expected a vertex that says whose pose 2 is"):
        read_g2o(team)
