"""A graph comes back from its files as it went in; a broken file says where it is broken."""

from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from support.graphs import random_graph

from wifipgo.errors import GraphFileError, TextFileError
from wifipgo.graph.files.g2o import read_g2o, write_g2o
from wifipgo.graph.posegraph import PoseGraph
from wifipgo.graph.subgraphs import appended, components, of_robots

ONE = " 1 0 0 1 0 1"
GOOD = f"VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 1 0 0\nEDGE_SE2 0 1 1 0 0{ONE}\n"


def symbol(letter: str, index: int, label: str = "\0") -> int:
    """Key as gtsam's Symbol or LabeledSymbol makes it."""
    return ord(letter) << 56 | ord(label) << 48 | index


def same(a: PoseGraph, b: PoseGraph, atol: float = 1e-15) -> None:
    for f in fields(PoseGraph):
        np.testing.assert_allclose(getattr(a, f.name), getattr(b, f.name), atol=atol, err_msg=f.name)


@settings(max_examples=8, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(seed=st.integers(0, 10**6), dims=st.sampled_from([3, 7]), robots=st.sampled_from([1, 3, 28]))
def test_what_was_written_is_read(tmp_path: Path, seed: int, dims: int, robots: int) -> None:
    _, graph = random_graph(seed, dims=dims, robots=robots)
    graph = graph.with_weight(np.ones(len(graph.tail)))
    for place in (tmp_path / f"{seed}.g2o", tmp_path / f"{seed}-{dims}-{robots}"):
        write_g2o(place, graph)
        same(read_g2o(place).graph, graph)


def test_a_folder_tells_of_each_meeting_twice_and_it_counts_once(tmp_path: Path) -> None:
    _, graph = random_graph(1)
    write_g2o(tmp_path, graph)
    lines = "".join(f.read_text() for f in tmp_path.glob("*.g2o")).splitlines()
    assert sum(line.startswith("EDGE") for line in lines) == len(graph.tail) + graph.between_robots.sum()
    assert len(read_g2o(tmp_path).graph.tail) == len(graph.tail)


def test_keys_stay(tmp_path: Path) -> None:
    place = tmp_path / "plain.g2o"
    place.write_text(GOOD)
    reading = read_g2o(place)
    write_g2o(tmp_path / "again.g2o", reading.graph, keys=reading.keys)
    same(read_g2o(tmp_path / "again.g2o").graph, reading.graph)
    assert "VERTEX_SE2 1 " in (tmp_path / "again.g2o").read_text()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (GOOD + "EDGE_SE2 0 1 1 0", r":4: expected 2 keys and 9 numbers after EDGE_SE2, got 4 words"),
        (GOOD + "VERTEX_SE2 two 0 0 0", ":4: expected a whole number, got 'two'"),
        (GOOD + "LANDMARK 3", ":4: expected one of VERTEX_SE2, .*got 'LANDMARK'"),
        (GOOD + "VERTEX_SE2 1 1 0 0", r"vertex 1 again, as in .*:2"),
        (GOOD + "VERTEX_SE2 2 nan 0 0", ":4: expected finite numbers"),
        (GOOD + f"EDGE_SE2 0 7 1 0 0{ONE}", ":4: expected keys of vertices, got no vertex 7"),
        (GOOD + f"EDGE_SE2 1 1 1 0 0{ONE}", ":4: expected an edge between two poses"),
        (GOOD + "EDGE_SE2 0 1 1 0 0 1 0 0 -1 0 1", ":4: expected a positive definite information matrix"),
        (GOOD + "VERTEX_SE2 9223372036854775807 0 0 0", r":4: expected keys below 2\^48 or gtsam symbols"),
        (GOOD + "VERTEX_SE3:QUAT 2 0 0 0 0 0 0 1", ":4: expected lines of the plane or of space"),
        ("VERTEX_SE3:QUAT 2 0 0 0 0 0 0 2", ":1: expected a quaternion of length 1, got length 2"),
        ("# nothing", "expected at least one vertex or edge, got none"),
    ],
)
def test_a_broken_line_is_named(tmp_path: Path, text: str, message: str) -> None:
    place = tmp_path / "broken.g2o"
    place.write_text(text)
    with pytest.raises(TextFileError, match=message):
        read_g2o(place)


def test_unknown_tags_are_skipped_on_request_only(tmp_path: Path) -> None:
    place = tmp_path / "more.g2o"
    place.write_text(GOOD + "EDGE_PRIOR 0\nLANDMARK 1\nLANDMARK 2\n")
    assert read_g2o(place, lenient=True).skipped == {"EDGE_PRIOR": 1, "LANDMARK": 2}


def test_two_files_must_agree_on_a_meeting(tmp_path: Path) -> None:
    _, graph = random_graph(2, robots=2)
    write_g2o(tmp_path, graph)
    file = tmp_path / "1.g2o"
    lines = file.read_text().splitlines()
    shared = set((tmp_path / "0.g2o").read_text().splitlines()) & set(lines)
    row = next(k for k, line in enumerate(lines) if line in shared)
    words = lines[row].split()
    lines[row] = " ".join([*words[:3], "99", *words[4:]])
    file.write_text("\n".join(lines))
    with pytest.raises(GraphFileError, match=rf"1.g2o:{row + 1}: expected the measurement of .*0.g2o"):
        read_g2o(tmp_path)


def test_a_robot_without_any_edge_is_a_part_of_its_own(tmp_path: Path) -> None:
    place = tmp_path / "lone.g2o"
    a, b, c = (symbol("a", 0), symbol("a", 1), symbol("c", 0))
    vertices = "".join(f"VERTEX_SE2 {key} 5 5 0\n" for key in (a, b, c))
    place.write_text(f"{vertices}EDGE_SE2 {a} {b} 1 0 0{ONE}\n")
    graph = read_g2o(place).graph
    assert graph.robots.tolist() == [0, 2]
    assert components(graph).tolist() == [0, 0, 1]


@given(seed=st.integers(0, 10**6))
def test_a_graph_is_the_sum_of_its_growth(seed: int) -> None:
    """Robots 0 and 1 first, then what has to do with robot 2."""
    _, graph = random_graph(seed)
    pair = of_robots(graph, [0, 1])
    kept = np.isin(graph.robot[graph.tail], [0, 1]) & np.isin(graph.robot[graph.head], [0, 1])
    rest = {name: getattr(graph, name)[~kept] for name in ("tail", "head", "z", "information", "weight")}
    increment = PoseGraph(robot=graph.robot, index=graph.index, poses=graph.poses, **rest)
    same(appended(pair, increment), graph)
