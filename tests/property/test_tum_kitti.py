"""Trajectories are read as they were written; a line that is no pose is named."""

import codecs
from pathlib import Path

import numpy as np
import pytest
from support.graphs import random_graph

from wifipgo.errors import TextFileError
from wifipgo.graph.files.g2o import write_g2o
from wifipgo.graph.files.graph_files import read_graph
from wifipgo.graph.files.tum_kitti import read_kitti, read_tum, write_kitti, write_tum

GOOD = "0.5 1 2 3 0 0 0 1"
MATRIX = "1 0 0 5 0 1 0 6 0 0 1 7"


def test_both_kinds_hold_the_same_poses(tmp_path: Path) -> None:
    truth, graph = random_graph(1)
    write_tum(tmp_path / "tum", graph, truth)
    write_kitti(tmp_path / "kitti", graph, truth)
    for robot in graph.robots.tolist():
        stamps, poses = read_tum(tmp_path / "tum" / f"{robot}.txt")
        other = read_kitti(tmp_path / "kitti" / f"{robot}.txt")
        np.testing.assert_array_equal(stamps, graph.index[graph.robot == robot])
        np.testing.assert_allclose(poses, truth[graph.robot == robot], atol=1e-12)
        sign = np.sign((poses[:, 3:] * other[:, 3:]).sum(axis=1, keepdims=True))
        np.testing.assert_allclose(other[:, :3], poses[:, :3], atol=1e-12)
        np.testing.assert_allclose(other[:, 3:] * sign, poses[:, 3:], atol=1e-12)


def test_places_may_be_text(tmp_path: Path) -> None:
    truth, graph = random_graph(1)
    write_tum(str(tmp_path / "tum"), graph, truth)
    write_g2o(str(tmp_path / "graph.g2o"), graph)
    assert len(read_tum(str(tmp_path / "tum" / "0.txt"))[0]) == np.sum(graph.robot == 0)
    read = read_graph(str(tmp_path / "graph.g2o")).graph
    np.testing.assert_allclose(read.poses, graph.poses, atol=1e-9)


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_any_editor(tmp_path: Path, end: str) -> None:
    place = tmp_path / "t.txt"
    later = GOOD.replace("0.5", "0.6").replace(" ", "\t")
    lines = ["# time x y z qx qy qz qw", f"\f{GOOD}\t", "", later, ""]
    place.write_bytes(codecs.BOM_UTF8 + end.join(lines).encode())
    stamps, poses = read_tum(place)
    np.testing.assert_array_equal(stamps, [0.5, 0.6])
    np.testing.assert_array_equal(poses, [[1, 2, 3, 0, 0, 0, 1]] * 2)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("2 1 0 0 0 0 0 0", "t.txt:3: expected a rotation, got a quaternion of length 0"),
        ("2 1 0 0 0 0 0 1.1", "t.txt:3: expected a rotation, got a quaternion of length 1.1"),
        ("2 1 0 0 0 0 1", "t.txt:3: expected 8 finite numbers, got 7 words"),
        ("2 1 0 0 0 0 0 1 9", "t.txt:3: expected 8 finite numbers, got 9 words"),
        ("2 nan 0 0 0 0 0 1", "t.txt:3: expected 8 finite numbers, got '2 nan"),
        ("2 1e999 0 0 0 0 0 1", "t.txt:3: expected 8 finite numbers"),
        ("2,1,0,0,0,0,0,1", "t.txt:3: expected a number with a decimal point, got a comma"),
        ("2, 1, 0, 0, 0, 0, 0, 1", "t.txt:3: expected a number with a decimal point, got a comma in '2,'"),
        ("0.5 1 0 0 0 0 0 1", "t.txt:3: expected a time stamp after 0.5, that of the line before, got 0.5"),
        ("0.4 1 0 0 0 0 0 1", "t.txt:3: expected a time stamp after 0.5, that of the line before, got 0.4"),
        ("2 LOST", "t.txt:3: expected a number, got 'LOST'"),
        ("2 1e200 1e200 0 1e200 0 0 1e200", "t.txt:3: expected a rotation"),
    ],
)
def test_a_line_that_is_no_pose(tmp_path: Path, line: str, message: str) -> None:
    place = tmp_path / "t.txt"
    place.write_text(f"# first\n{GOOD}\n{line}\n")
    with pytest.raises(TextFileError, match=message):
        read_tum(place)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        (MATRIX + " 1", "k.txt:2: expected 12 finite numbers, got 13 words"),
        (MATRIX.replace("5", "nan"), "k.txt:2: expected 12 finite numbers"),
        (MATRIX.replace("5", "0,5"), "k.txt:2: expected a number with a decimal point"),
        ("0 " * 12, "k.txt:2: expected a rotation, got a matrix whose rows are off"),
        ("1e200 " * 12, "k.txt:2: expected a rotation"),
        ("-1 0 0 5 0 1 0 6 0 0 1 7", "k.txt:2: expected a rotation, got a mirrored matrix"),
    ],
)
def test_a_matrix_that_is_no_pose(tmp_path: Path, line: str, message: str) -> None:
    place = tmp_path / "k.txt"
    place.write_text(f"{MATRIX}\n{line}\n")
    with pytest.raises(TextFileError, match=message):
        read_kitti(place)


@pytest.mark.parametrize("reader", [read_tum, read_kitti])
def test_no_pose_at_all(tmp_path: Path, reader: object) -> None:
    place = tmp_path / "empty.txt"
    place.write_text("# nothing\n")
    with pytest.raises(TextFileError, match=r"empty.txt: expected at least one pose, got none"):
        reader(place)  # type: ignore[operator]
