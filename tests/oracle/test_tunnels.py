"""Teams in CSV files of dpgo: counts and matrices against what the rows say."""

from pathlib import Path

import numpy as np
import pytest
from support.data_dir import data_dir

from wifipgo.datasets import read_tunnels
from wifipgo.errors import BadInputError

HEADER = "robot_src,pose_src,robot_dst,pose_dst,qx,qy,qz,qw,tx,ty,tz,kappa,tau,is_known_inlier,weight"
TURN = "0,0,0,1"


def row(ends: str, t: str = "1,0,0", weight: str = "1") -> str:
    """A measurement without a turn."""
    return f"{ends},{TURN},{t},10000,100,0,{weight}"


def written(folder: Path, *files: list[str]) -> Path:
    """A file a robot."""
    for k, rows in enumerate(files):
        (folder / f"robot{k}.csv").write_text("\n".join([HEADER, *rows]) + "\n", encoding="utf-8")
    return folder


def test_a_team_is_read_as_it_is_written(tmp_path: Path) -> None:
    loop = row("0,1,1,0", "0,2,0", weight="0")
    graph = read_tunnels(written(tmp_path, [row("0,0,0,1"), loop], [row("1,0,1,1", "0,0,3"), loop]))
    assert (len(graph.poses), len(graph.tail)) == (4, 3)
    assert graph.between_robots.sum() == 1
    np.testing.assert_array_equal(graph.weight, 1.0)  # another method's answer is not looked at
    expected = np.diag([100.0] * 3 + [20_000.0] * 3)
    np.testing.assert_allclose(graph.information, np.tile(expected, (3, 1, 1)))
    np.testing.assert_allclose(
        graph.poses[:, :3] - graph.poses[0, :3], [[0, 0, 0], [1, 0, 0], [1, 2, 0], [1, 2, 3]]
    )


def test_a_robot_without_odometry_is_named(tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match="expected odometry of robot 1, from one"):
        read_tunnels(written(tmp_path, [row("0,0,0,1"), row("0,1,1,0")]))
    with pytest.raises(BadInputError, match=r"folder must be a folder with one \.csv file a robot"):
        read_tunnels(tmp_path / "robot0.csv")


def test_the_public_team_has_what_its_description_says() -> None:
    graph = read_tunnels(data_dir("tunnels"))
    own_loops = ~graph.between_robots & ~graph.odometry
    assert (len(graph.robots), len(graph.poses)) == (8, 1255)
    between = int(graph.between_robots.sum())
    assert (int(graph.odometry.sum()), int(own_loops.sum())) == (1247, 96)
    assert between == 3579 - 31  # rows that differ in the answer of another method alone are one measurement
