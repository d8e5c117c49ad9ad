"""Errors of teams are those of their definitions, and files of any kind give the same."""

import json
from pathlib import Path

import numpy as np
import pytest
from support.graphs import compose, random_graph, small

from wifipgo import se3
from wifipgo.errors import BadInputError
from wifipgo.graph.ate import compared, main
from wifipgo.graph.distributed import Channel, DistributedConfig, solve_distributed
from wifipgo.graph.distributed.agreement import disagreement
from wifipgo.graph.files.g2o import write_g2o
from wifipgo.graph.files.jrl_writing import shared_solutions, write_jrl, write_jrr
from wifipgo.graph.files.trajectories import Trajectory, associated, read_team
from wifipgo.graph.files.tum_kitti import write_kitti, write_tum
from wifipgo.graph.team_accuracy import iate, shared_variable_error, team_accuracy


@pytest.mark.parametrize("dims", [3, 7])
def test_errors_of_a_team_by_hand(dims: int) -> None:
    """Robot 0 is off by 3 m to the side, robot 1 turned by 0.2 rad on the spot at its last pose."""
    step = np.zeros((1, 3 if dims == 3 else 6))
    step[0, 0] = 1.0
    line = [small(np.zeros_like(step))]
    for _ in range(3):
        line.append(compose(line[-1], small(step)))
    truth = np.concatenate([*line, *line])
    estimate = truth.copy()
    estimate[:4, 1] += 3.0
    turn = np.zeros_like(step)
    turn[0, -1] = 0.2
    estimate[7:] = compose(truth[7:], small(turn))
    found = team_accuracy(estimate, truth, np.array([0] * 4 + [5] * 4))
    zero, five = found.robots[0], found.robots[5]
    np.testing.assert_allclose([zero.ate_m, zero.ate_rad, zero.rpe_m, zero.rpe_rad], [3, 0, 0, 0], atol=1e-12)
    np.testing.assert_allclose([five.ate_m, five.ate_rad], [0.0, 0.1], atol=1e-12)
    np.testing.assert_allclose(five.rpe_rad, 0.2 / np.sqrt(3.0))
    np.testing.assert_allclose([zero.ate_trans, five.ate_rot], [9.0, (1 - np.cos(0.2))])
    np.testing.assert_allclose([found.team.ate_m, found.team.rpe_rad], [np.sqrt(4.5), 0.2 / np.sqrt(6.0)])
    assert found.team.poses == 8


def test_alignment_takes_the_team_as_one() -> None:
    truth, graph = random_graph(3)
    moved = se3.compose(se3.exp(np.array([1.0, 2, 3, 0.3, -0.2, 0.5])), truth)
    assert team_accuracy(moved, truth, graph.robot).team.ate_m > 1.0
    assert team_accuracy(moved, truth, graph.robot, alignment="rigid").team.ate_m < 1e-9
    apart = truth.copy()
    apart[graph.robot == 1, 0] += 2.0  # each robot by itself would fit
    assert team_accuracy(apart, truth, graph.robot, alignment="rigid").team.ate_m > 0.5


def test_iate_is_the_mean_over_steps() -> None:
    truth = np.zeros((4, 3))
    truth[:, 0] = range(4)
    off = truth.copy()
    off[:, 1] = 2.0
    found = iate([(truth[:1], truth[:1]), (off[:3], truth[:3]), (off, truth)])
    np.testing.assert_allclose(
        [*found.steps_m, found.trans_m, found.rot_rad], [0, 2, 2, 4 / 3, 0], atol=1e-12
    )
    with pytest.raises(ValueError, match="steps must be at least one"):
        iate([])


def test_sve_by_hand() -> None:
    """Three robots hold pose (0, 0) 0, 1 and 2 m along x, two hold (1, 0), which they turn 0.3 rad apart."""
    at = [[float(x), 0.0, 0.0] for x in range(3)]
    held = {
        0: {(0, 0): at[0]},
        1: {(0, 0): at[1], (1, 0): at[0]},
        2: {(0, 0): at[2], (1, 0): [0.0, 0.0, 0.3]},
    }
    expected = [np.sqrt((1 + 1 + 4 + 0) / 4), np.sqrt(0.3**2 / 4)]
    np.testing.assert_allclose(shared_variable_error(held), expected)
    assert shared_variable_error({0: held[0]}) == (0.0, 0.0)


def test_robots_agree_to_their_threshold() -> None:
    _, graph = random_graph(4, robots=4)
    lossy = Channel(loss=0.3, rng=np.random.default_rng(0))
    for channel in (None, lossy):
        sve = []
        for threshold in (0.1, 1e-6):
            _, report = solve_distributed(
                graph, config=DistributedConfig(threshold=threshold), channel=channel
            )
            sve.append(disagreement(report.held)[0])
            assert sorted(report.seconds) == [0, 1, 2, 3]
            assert min(report.seconds.values()) > 0.0
        assert 1e-3 * 0.1 < sve[0] < 0.1
        assert sve[1] < 1e-6


def test_poses_go_with_the_nearest_in_time() -> None:
    def at(*stamps: float) -> Trajectory:
        poses = np.tile(se3.IDENTITY, (len(stamps), 1))
        return Trajectory(np.array(stamps, dtype=float), poses, "x.txt")

    def pairs(a: Trajectory, b: Trajectory, tolerance_s: float) -> list[tuple[int, int]]:
        here, there = associated(a, b, tolerance_s=tolerance_s)
        return list(zip(here.tolist(), there.tolist(), strict=True))

    assert pairs(at(0, 1, 2, 3), at(0.995, 2.1, 2.999), 0.01) == [(1, 0), (3, 2)]
    assert pairs(at(0, 1, 2, 3), at(0.995, 2.1, 2.999), 0.2) == [(1, 0), (2, 1), (3, 2)]
    assert pairs(at(1), at(0.9, 1.05, 1.2), 0.5) == [(0, 1)]  # once, however dense the other is
    assert pairs(at(0.9, 1.05, 1.2), at(1), 0.5) == [(1, 0)]
    assert pairs(at(0, 1), at(5), 0.5) == []
    with pytest.raises(BadInputError, match="which has no time stamps"):
        associated(at(0, 1), Trajectory(None, at(0).poses, "k.txt"))


def test_every_kind_of_file_gives_the_same(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    truth, graph = random_graph(5)
    write_tum(tmp_path / "truth", graph, truth)
    write_tum(tmp_path / "tum", graph, graph.poses)
    write_kitti(tmp_path / "kitti", graph, graph.poses)
    write_g2o(tmp_path / "g2o", graph)
    write_jrr(tmp_path / "team.jrr", shared_solutions(graph, graph.poses), name="x", method="y")
    write_jrl(tmp_path / "team.jrl", graph, name="x", truth=truth)
    estimates = [str(tmp_path / name) for name in ("tum", "kitti", "g2o", "team.jrr")]
    for reference in ("truth", "team.jrl"):
        out = tmp_path / f"{reference}.json"
        assert main([str(tmp_path / reference), *estimates, "--align", "--out", str(out)]) == 0
        found = json.loads(out.read_text())["estimates"]
        expected = team_accuracy(graph.poses, truth, graph.robot, alignment="rigid")
        for name in estimates:
            np.testing.assert_allclose(found[name]["team"]["ate_m"], expected.team.ate_m, rtol=1e-9)
            np.testing.assert_allclose(found[name]["robots"]["1"]["rpe_rad"], expected.robots[1].rpe_rad)
    single = [str(tmp_path / "tum" / f"{robot}.txt") for robot in (0, 1, 2)]
    capsys.readouterr()
    assert main([str(tmp_path / "truth"), *single]) == 0
    assert capsys.readouterr().out.count("team") == 1  # one table
    assert main([str(tmp_path / "truth"), *single[:2]]) == 1
    assert "robots of the reference that have no pose here" in capsys.readouterr().err


def test_lone_files_need_no_number(tmp_path: Path) -> None:
    _, graph = random_graph(6, robots=1)
    write_tum(tmp_path, graph, graph.poses)
    (tmp_path / "0.txt").rename(tmp_path / "estimate.txt")
    write_tum(tmp_path / "truth", graph, graph.poses)
    (tmp_path / "truth" / "0.txt").rename(tmp_path / "truth" / "3.txt")
    pairs = compared(read_team(tmp_path / "truth"), read_team(tmp_path / "estimate.txt"))
    assert (len(pairs.robot), pairs.missing) == (5, ())


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["truth"], "ESTIMATE must be at least one"),
        (["truth", "nowhere"], "path must be a file or folder that exists"),
        (["truth", "late"], "expected poses of one robot within 0.01 s of each other"),
        (["truth", "truth", "--scale"], "scale must be given with --align only"),
        (["truth", "truth", "--tolerance", "-1"], "tolerance must be finite"),
        (["truth", "twice"], "0.txt:2: expected a time stamp after 1.0"),
        (["truth", "empty"], "a folder with 0.txt"),
    ],
)
def test_what_cannot_be_compared(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    words: list[str],
    message: str,
) -> None:
    line = "1.0 0 0 0 0 0 0 1\n"
    for name, text in (("truth", line), ("late", line.replace("1.0", "9")), ("twice", line * 2)):
        (tmp_path / name).mkdir()
        (tmp_path / name / "0.txt").write_text(text)
    (tmp_path / "empty").mkdir()
    monkeypatch.chdir(tmp_path)
    try:
        code = main(words)
    except SystemExit as end:  # tyro's, of the command line
        code = int(str(end.code))
    assert code == 2
    assert message in capsys.readouterr().err
