"""Directions from a file weigh what the command optimises; a truth gives errors, and iATE."""

import json
import math
import pickle
from pathlib import Path
from typing import get_args

import numpy as np
import pytest

from wifipgo import se3
from wifipgo.graph.files.bearings_csv import read_bearings
from wifipgo.graph.files.g2o import write_g2o
from wifipgo.graph.files.jrl_writing import write_jrl
from wifipgo.graph.files.tum_kitti import write_tum
from wifipgo.graph.optimise import Backend, Robust, main, optimise, run
from wifipgo.graph.outliers.methods import OUTLIER_METHODS
from wifipgo.graph.posegraph import PoseGraph, pose_graph

HEAD = "observer,observer_pose,target,target_pose,azimuth_deg"


def side_by_side(dims: int, *, wrong: tuple[int, ...] = ()) -> tuple[np.ndarray, PoseGraph]:
    """Truth and graph of two robots 2 m beside each other for five steps, who measure each other at each.

    Odd measurements are of robot 0 by robot 1. A wrong one has its place 2 m ahead instead of to the side.
    """
    step, side = np.array([1.0, 0, 0, 0, 0, 0]), np.array([0, 2.0, 0, 0, 0, 0])
    flat = np.array([k * step + robot * side for robot in (0, 1) for k in range(5)])
    key = np.array([(robot, k) for robot in (0, 1) for k in range(5)])
    tails = [(r, k) for r in (0, 1) for k in range(4)] + [(k % 2, k) for k in range(5)]
    heads = [(r, k + 1) for r in (0, 1) for k in range(4)] + [(1 - k % 2, k) for k in range(5)]
    z = [step] * 8 + [step * 2 if k in wrong else side * (-1.0) ** k for k in range(5)]
    truth, measured = (se3.exp(np.array(part)) for part in (flat, z))
    if dims == 3:
        truth, measured = se3.project(truth), se3.project(measured)
    graph = pose_graph(
        robot=key[:, 0],
        index=key[:, 1],
        poses=truth,
        tail=np.array(tails),
        head=np.array(heads),
        z=measured,
        information=np.tile(np.eye(3 if dims == 3 else 6) * 400.0, (13, 1, 1)),
    )
    return truth, graph


def lines_of(observed: list[tuple[int, int, float]]) -> str:
    """Directions in which a robot heard the other at pose k."""
    return "".join(f"{robot},{k},{1 - robot},{k},{azimuth_deg}\n" for robot, k, azimuth_deg in observed)


@pytest.mark.parametrize("dims", [3, 7])
@pytest.mark.parametrize("robust", ["paper", "range_aware", "paper+huber"])
@pytest.mark.parametrize("heard_by", [0, 1])
def test_what_comes_from_elsewhere_is_weighed_down(
    tmp_path: Path, dims: int, robust: Robust, heard_by: int
) -> None:
    """Either end may have heard: the direction is that from who heard."""
    truth, graph = side_by_side(dims, wrong=(1, 2))
    azimuth_deg = 90.0 if heard_by == 0 else -90.0
    place = tmp_path / "heard.csv"
    ghosts = [(heard_by, k, azimuth_deg + 45.0) for k in range(5)]  # a lower peak, further away
    heard = [(heard_by, k, azimuth_deg + 1.0) for k in range(5)]
    place.write_text(f"{HEAD}\n{lines_of(heard)}{lines_of(ghosts)}")
    outcome = optimise(graph, robust=robust, bearings=read_bearings(place, graph))
    wrong = graph.between_robots & np.isin(graph.index[graph.tail], (1, 2))
    assert outcome.gated.heard == 5
    assert outcome.weight[wrong].max() < 1e-3
    np.testing.assert_allclose(outcome.weight[~wrong], 1.0)
    np.testing.assert_allclose(outcome.poses, truth, atol=2e-3)


def test_a_weight_is_that_of_the_paper(tmp_path: Path) -> None:
    """Eq. 7 with sigma of 2.96 degrees, ten degrees off, written out."""
    _, graph = side_by_side(3)
    place = tmp_path / "heard.csv"
    place.write_text(f"{HEAD}\n0,0,1,0,80\n")
    outcome = optimise(graph, robust="paper", bearings=read_bearings(place, graph))
    sigma = math.radians(2.96)
    expected = min(1.0, math.exp(-0.5 * (10.0 / 2.96) ** 2) / sigma)
    met = graph.between_robots & (graph.index[graph.tail] == 0)
    np.testing.assert_allclose(outcome.weight[met], expected)


def test_an_outcome_goes_from_process_to_process() -> None:
    _, graph = side_by_side(3)
    for backend in get_args(Backend):
        again = pickle.loads(pickle.dumps(optimise(graph, backend=backend)))
        np.testing.assert_array_equal(again.weight, 1.0)


def test_every_method_without_bearing_factors_is_offered() -> None:
    assert set(get_args(Robust)) == {name for name, row in OUTLIER_METHODS.items() if not row.bearings}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("observer,target\n", "b.csv:1: expected columns observer, .* got none named 'observer_pose'"),
        (f"{HEAD}\n0,0,1,0,90\n0,0,1,9,90\n", "b.csv:3: expected a pose of the graph, got pose 9 of robot 1"),
        (f"{HEAD}\n0,0,0,1,90\n", "b.csv:2: expected another robot as target, got robot 0 again"),
        (f"{HEAD}\n0,0,1,0,nan\n", "b.csv:2: expected an azimuth in -360..360 degrees, got nan"),
        (f"{HEAD}\n0,0,1,0\n", "b.csv:2: expected 5 values"),
        (f"{HEAD}\n0,0,1,x,1\n", "b.csv:2: expected a whole number"),
        (f"{HEAD}\n", "b.csv: expected at least one direction"),
        ("", "b.csv:1: expected columns"),
    ],
)
def test_a_direction_that_cannot_be_used(tmp_path: Path, text: str, message: str) -> None:
    place = tmp_path / "b.csv"
    place.write_text(text)
    with pytest.raises(ValueError, match=message):
        read_bearings(place, side_by_side(3)[1])


def test_directions_and_methods_belong_together(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    _, graph = side_by_side(3)
    write_g2o(tmp_path / "team.g2o", graph)
    place = tmp_path / "b.csv"
    place.write_text(f"{HEAD}\n0,0,1,3,90\n")
    words = [str(tmp_path / "team.g2o"), "--out", str(tmp_path / "out")]
    for more, message in (
        (["--robust", "paper"], "bearings must be given (--bearings FILE)"),
        (["--robust", "gnc", "--bearings", str(place)], "bearings must be given (--bearings FILE)"),
        (["--robust", "paper", "--bearings", str(place)], "bearings must be directions between poses that"),
        (["--steps", "3"], "steps must be given with a reference"),
        (["--steps", "-1", "--reference", words[0]], "steps must be >= 0"),
    ):
        assert main([*words, *more]) == 2
        assert message in capsys.readouterr().err


@pytest.mark.parametrize("backend", ["gtsam", "distributed"])
def test_a_truth_gives_errors(tmp_path: Path, backend: str) -> None:
    truth, graph = side_by_side(7)
    off = graph.poses.copy()
    off[7:, :3] += np.random.default_rng(1).normal(size=(3, 3))
    write_jrl(tmp_path / "team.jrl", graph.with_poses(off), name="team", truth=truth)
    assert main([str(tmp_path / "team.jrl"), "--backend", backend, "--out", str(tmp_path / "a")]) == 0
    report = json.loads((tmp_path / "a" / "report.json").read_text())
    assert report["ATE before, RMSE m"] > 0.1
    assert report["ATE after, RMSE m"] < 1e-2
    assert set(report["accuracy"]["after"]["robots"]) == {"0", "1"}
    assert set(report["seconds by robot"]) == ({"0", "1"} if backend == "distributed" else set())
    write_tum(tmp_path / "truth", graph, truth)
    write_g2o(tmp_path / "team.g2o", graph)
    run(tmp_path / "team.g2o", reference=tmp_path / "truth", steps=2, out=tmp_path / "b")
    assert json.loads((tmp_path / "b" / "report.json").read_text())["iATE, m"] < 1e-6
