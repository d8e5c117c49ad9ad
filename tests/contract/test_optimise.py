"""The command that optimises files: what it writes, what it refuses, and that its guards find outliers."""

import json
import os
import subprocess
import sys
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from support.graphs import between, compose, random_graph, small

from wifipgo import se3
from wifipgo.command.processes import in_a_process
from wifipgo.errors import NumericalError
from wifipgo.graph.files.g2o import read_g2o, write_g2o
from wifipgo.graph.files.jrl import read_jrl
from wifipgo.graph.files.jrl_writing import read_jrr, write_jrl
from wifipgo.graph.files.tum_kitti import read_tum
from wifipgo.graph.optimise import Backend, Robust, main, optimise, run
from wifipgo.graph.posegraph import PoseGraph, pose_graph


def meeting_team(seed: int, *, dims: int, n_wrong: int = 0, poses: int = 12) -> tuple[np.ndarray, PoseGraph]:
    """Truth and graph of two robots that go side by side and meet at each pose; some meetings are wrong."""
    rng, freedom = np.random.default_rng(seed), 3 if dims == 3 else 6
    sigma = np.full(freedom, 0.02)
    step = np.zeros((1, freedom))
    step[0, 0] = 1.0
    truth = np.zeros((2, poses, dims))
    start = np.zeros((2, freedom))
    start[1, 1] = 2.0
    truth[:, 0] = small(start)
    for t in range(1, poses):
        truth[:, t] = compose(
            truth[:, t - 1], small(step + 0.1 * rng.normal(size=(2, freedom)) * (step == 0))
        )
    flat = truth.reshape(-1, dims)
    row = np.arange(2 * poses).reshape(2, poses)
    tail, head = np.append(row[:, :-1], row[0]), np.append(row[:, 1:], row[1])
    z = compose(between(flat[tail], flat[head]), small(sigma * rng.normal(size=(len(tail), freedom))))
    wrong = 2 * (poses - 1) + rng.choice(poses, n_wrong, replace=False)
    z[wrong] = compose(
        z[wrong], small(rng.choice([-1.0, 1.0], (n_wrong, freedom)) * rng.uniform(0.5, 1, (n_wrong, freedom)))
    )
    guess = flat.copy()
    for t in range(1, poses):
        for r in range(2):
            edge = row[r, t] - r - 1
            guess[row[r, t]] = compose(guess[row[r, t - 1]][None], z[edge][None])[0]
    robot, index = np.indices((2, poses)).reshape(2, -1)
    key = np.stack([robot, index], axis=-1)
    information = np.tile(np.diag(1.0 / sigma**2), (len(tail), 1, 1))
    graph = pose_graph(
        robot=robot, index=index, poses=guess, tail=key[tail], head=key[head], z=z, information=information
    )
    return flat, graph


@pytest.mark.parametrize("dims", [3, 7])
@pytest.mark.parametrize("backend", ["gtsam", "distributed"])
@pytest.mark.parametrize("robust", ["huber", "gnc", "pcm"])
def test_guards_find_outliers(dims: int, backend: Backend, robust: Robust) -> None:
    truth, graph = meeting_team(1, dims=dims, n_wrong=3)
    _, clean = meeting_team(1, dims=dims)
    wrong = (np.abs(graph.z - clean.z) > 0.3).any(axis=1)
    assert wrong.sum() == 3
    plain = optimise(graph, backend=backend, threshold=1e-4)
    guarded = optimise(graph, backend=backend, robust=robust, threshold=1e-4)
    assert guarded.converged
    assert guarded.weight[wrong].max() < 0.2
    if robust != "huber":
        assert guarded.weight[~wrong].mean() > 0.95

    def error(poses: np.ndarray) -> float:
        return float(np.linalg.norm((poses - truth)[:, :2], axis=1).mean())

    assert error(guarded.poses) < 0.7 * error(plain.poses)


def test_it_writes_what_it_says(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    _, graph = meeting_team(2, dims=7, n_wrong=2)
    write_g2o(tmp_path / "in", graph)
    out = tmp_path / "out"
    run(tmp_path / "in", robust="gnc", out=out)
    assert "error after" in capsys.readouterr().out
    found = sorted(p.relative_to(out).as_posix() for p in out.rglob("*") if p.is_file())
    per_robot = [f"{kind}/{r}" for kind in ("kitti", "optimised", "tum") for r in (0, 1)]
    suffix = {"optimised": ".g2o", "kitti": ".txt", "tum": ".txt"}
    names = [name + suffix[name.split("/")[0]] for name in per_robot]
    assert found == sorted(["before_after.png", "manifest.jsonl", "report.json", *names])
    again = read_g2o(out / "optimised").graph
    stamps, poses = read_tum(out / "tum" / "1.txt")
    np.testing.assert_allclose(poses, again.poses[again.robot == 1], atol=1e-12)
    np.testing.assert_array_equal(stamps, again.index[again.robot == 1])
    kitti = np.loadtxt(out / "kitti" / "1.txt").reshape(-1, 3, 4)
    np.testing.assert_allclose(kitti[:, :, :3], se3.rotation_matrix(poses[:, 3:]), atol=1e-12)
    report = json.loads((out / "report.json").read_text())
    assert report["edges weighed down"] == len(report["weighed_down"]) >= 2
    assert main([str(tmp_path / "in"), "--out", str(out)]) == 2
    assert "--overwrite" in capsys.readouterr().err
    run(tmp_path / "in", out=out, overwrite=True, backend="distributed")
    assert json.loads((out / "report.json").read_text())["bytes sent"] > 0
    assert sorted(p.name for p in tmp_path.iterdir()) == ["in", "out"]


def test_a_file_of_the_plane_with_a_lone_robot(tmp_path: Path) -> None:
    _, graph = meeting_team(3, dims=3)
    place = tmp_path / "team.g2o"
    write_g2o(place, graph)
    with place.open("a") as file:
        file.write(f"VERTEX_SE2 {ord('d') << 56} 7 7 0\nPRIOR 0\n")
    for backend in ("gtsam", "distributed"):
        run(place, out=tmp_path / backend, lenient=True, backend=backend)
        report = json.loads((tmp_path / backend / "report.json").read_text())
        assert (report["components"], report["poses outside the largest"]) == (2, 1)
        assert report["lines skipped"] == {"PRIOR": 1}
        assert report["error after"] < 0.1 * report["error before"]
        assert (tmp_path / backend / "optimised.g2o").is_file()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "expected at least one vertex or edge"),
        ("VERTEX_SE2 0 0 0", ":1: expected 1 key and 3 numbers"),
        ("VERTEX_SE2 0 0 0 inf", ":1: expected finite numbers"),
        (None, "must be a file or folder that exists"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str | None, message: str
) -> None:
    place = tmp_path / "bad.g2o"
    if text is not None:
        place.write_text(text)
    assert main([str(place), "--out", str(tmp_path / "out")]) == 2
    printed = capsys.readouterr().err
    assert message in printed
    assert len(printed.splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_residuals_too_large_to_square_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    place = tmp_path / "far.g2o"
    place.write_text("VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 1e160 0 0\nEDGE_SE2 0 1 1 0 0 1e9 0 0 1e9 0 1\n")
    assert main([str(place), "--out", str(tmp_path / "out")]) == 2
    assert "error of the graph as given must be finite, got inf" in capsys.readouterr().err


def test_the_command_itself(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "wifipgo.graph.optimise", "nowhere", "--robust", "pcm"]
    found = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert (found.returncode, found.stdout) == (2, "")
    assert found.stderr == "error: path must be a file or folder that exists, got 'nowhere'\n"


def test_a_folder_of_something_else_is_not_touched(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    _, graph = meeting_team(4, dims=3)
    write_g2o(tmp_path / "team.g2o", graph)
    assert main([str(tmp_path / "team.g2o"), "--out", str(tmp_path), "--overwrite"]) == 2
    assert "nothing but results of optimise" in capsys.readouterr().err
    assert (tmp_path / "team.g2o").is_file()


def test_known_poses_stay_and_landmarks_come_back(tmp_path: Path) -> None:
    place = tmp_path / "fix.g2o"
    lines = ["VERTEX_SE2 0 0 0 0", "VERTEX_SE2 1 1 0 1.5", "VERTEX_SE2 2 1.1 1 3", "FIX 2", "VERTEX_XY 9 1 1"]
    edges = [f"EDGE_SE2 {k} {k + 1} 1 0 1.57 9 0 0 9 0 40" for k in range(2)]
    place.write_text("\n".join([*lines, *edges]))
    run(place, out=tmp_path / "out")
    written = (tmp_path / "out" / "optimised.g2o").read_text().splitlines()
    assert {"VERTEX_SE2 2 1.1 1.0 3.0", "FIX 2", "VERTEX_XY 9 1 1"} < set(written)
    assert "VERTEX_SE2 0 0.0 0.0 0.0" not in written


def far_apart(scale_m: float) -> PoseGraph:
    """Two robots in space on a circle, a measurement known to 5 cm at every step of ``scale_m``."""
    n = 12
    robot, index = np.indices((2, n)).reshape(2, -1)
    turn = 0.1 * index + robot
    poses = np.zeros((2 * n, 7))
    poses[:, :2] = scale_m * np.stack([np.sin(turn), np.cos(turn)], axis=1) * 10.0
    poses[:, 5:] = np.stack([np.sin(turn / 2), np.cos(turn / 2)], axis=1)
    pairs = np.array([(k, k + 1) for k in range(2 * n - 1) if k != n - 1] + [(3, n + 3), (9, n + 9), (2, 7)])
    key = np.stack([robot, index], axis=1)
    z = between(poses[pairs[:, 0]], poses[pairs[:, 1]])
    start = poses.copy()
    start[1:, :2] += np.random.default_rng(0).normal(0.0, 0.1 * scale_m, (2 * n - 1, 2))
    information = np.tile(np.eye(6) / 0.05**2, (len(pairs), 1, 1))
    tail, head = key[pairs[:, 0]], key[pairs[:, 1]]
    return pose_graph(
        robot=robot, index=index, poses=start, tail=tail, head=head, z=z, information=information
    )


@pytest.mark.parametrize("scale_m", [1.0, 1e3])
def test_a_search_over_kilometres_gives_its_poses(tmp_path: Path, scale_m: float) -> None:
    write_g2o(tmp_path / "far.g2o", far_apart(scale_m))
    assert main([str(tmp_path / "far.g2o"), "--out", str(tmp_path / "out")]) in {0, 1}
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    assert report["error after"] < 1e-3 * report["error before"]


def test_results_outlive_the_picture_and_names_are_printed_plain(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    _, graph = meeting_team(5, dims=3)
    place = tmp_path / "a\x1b]0;title\x07.g2o"
    write_g2o(place, graph)
    monkeypatch.setattr("wifipgo.graph.files.optimise_picture.draw", lambda *_: 1 / 0)
    assert main([str(place), "--out", str(tmp_path / "out")]) == 0
    printed = capsys.readouterr()
    assert "before_after.png was not drawn: ZeroDivisionError" in printed.err
    assert "\x1b" not in printed.out
    assert (tmp_path / "out" / "report.json").is_file()


def test_ctrl_c_ends_what_hears_no_signal_at_once() -> None:
    """The process that computes leaves Ctrl-C alone, as a native loop does; its parent ends it."""
    code = "import os, signal, threading, time\n"
    code += "from functools import partial\nfrom wifipgo.command.command_line import exit_code\n"
    code += "from wifipgo.command.processes import in_a_process\n"
    code += "threading.Timer(0.5, partial(os.kill, os.getpid(), signal.SIGINT)).start()\n"
    code += "raise SystemExit(exit_code(lambda: in_a_process(partial(time.sleep, 600))))"
    command = [sys.executable, "-c", code]
    found = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
    assert (found.returncode, found.stderr) == (130, "interrupted; nothing was written\n")


def test_a_process_gives_answers_failures_and_its_own_death() -> None:
    assert in_a_process(partial(divmod, 17, 5)) == (3, 2)
    with pytest.raises(ZeroDivisionError):
        in_a_process(partial(divmod, 17, 0))
    with pytest.raises(NumericalError, match="died"):
        in_a_process(partial(os._exit, 7))


def test_a_word_that_is_nearly_example(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["exampel"]) == 2
    assert "did you mean 'example'?" in capsys.readouterr().err


def test_a_team_in_jrl_comes_out_as_jrl(tmp_path: Path) -> None:
    truth, graph = meeting_team(4, dims=7)
    write_jrl(tmp_path / "in.jrl", graph, name="meeting", truth=truth)
    run(tmp_path / "in.jrl", out=tmp_path / "out")
    again = read_jrl(tmp_path / "out" / "optimised.jrl")
    np.testing.assert_allclose(again.graph.poses, read_g2o(tmp_path / "out" / "optimised.g2o").graph.poses)
    held = read_jrr(tmp_path / "out" / "optimised.jrr")
    assert sorted(held) == [0, 1]


def test_a_lone_robot_is_cut_by_the_command(tmp_path: Path) -> None:
    _, graph = random_graph(2, robots=1, poses=9)
    write_g2o(tmp_path / "one.g2o", graph)
    run(tmp_path / "one.g2o", out=tmp_path / "out", robots=3, backend="distributed")
    assert json.loads((tmp_path / "out" / "report.json").read_text())["robots"] == 3
