"""Chi-square per degree of freedom: 1 where noise is as stated, and a word where it is far above."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.graphs import compose, random_graph, small

from wifipgo.graph.files.g2o import Reading, write_g2o
from wifipgo.graph.optimise import main, optimise
from wifipgo.graph.optimise_figures import PER_FREEDOM, figures
from wifipgo.graph.posegraph import PoseGraph

SIGMA = 0.02


def stated(seed: int, *, dims: int, fixed: int) -> tuple[PoseGraph, np.ndarray]:
    """A graph whose noise is as it says; some poses are held, where they truly are."""
    truth, graph = random_graph(seed, dims=dims, noise=SIGMA, start_noise=0.05, meetings=12)
    poses, held = graph.poses.copy(), np.arange(fixed) * 4
    poses[held] = truth[held]
    plain = graph.with_weight(np.ones(len(graph.tail))).with_poses(poses)
    return replace(plain, information=plain.information / SIGMA**2), held


def fitted(graph: PoseGraph, held: np.ndarray) -> object:
    reading = Reading(graph, np.zeros(len(graph.poses), dtype=np.uint64), {}, held)
    outcome = optimise(graph, fixed=held)
    return figures(reading, outcome, backend="gtsam", robust="none")[PER_FREEDOM]


@pytest.mark.parametrize("fixed", [0, 1, 3])
@pytest.mark.parametrize(("dims", "freedom"), [(3, 3), (7, 6)])
def test_it_is_one_where_noise_is_as_stated(dims: int, freedom: int, fixed: int) -> None:
    """Sums of squares over many graphs, beside the chi-square of as many numbers as poses leave over."""
    squares, left_over = [], []
    for seed in range(40):
        graph, held = stated(seed, dims=dims, fixed=fixed)
        found, n_unknown = fitted(graph, held), len(graph.poses) - max(fixed, 1)
        assert isinstance(found, float)
        left_over.append(freedom * (len(graph.tail) - n_unknown))
        squares.append(left_over[-1] * found)
    assert abs(sum(squares) - sum(left_over)) < 4.0 * np.sqrt(2.0 * sum(left_over))


def test_nothing_is_said_where_poses_use_all_up() -> None:
    """A chain has no measurement more than unknown poses."""
    _, graph = random_graph(0, dims=3, robots=1, meetings=0)
    assert fitted(graph, np.zeros(0, dtype=int)) == {}


def test_measurements_that_contradict_each_other_are_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """With a guard against them the fit is good again, and nothing is told."""
    graph, _ = stated(5, dims=3, fixed=0)
    wrong, z = np.arange(len(graph.tail) - 3, len(graph.tail)), graph.z.copy()
    z[wrong] = compose(z[wrong], small(np.array([[1.0, -1.0, 0.5]] * 3)))
    for name, measured, robust in (("as", graph.z, "none"), ("bad", z, "none"), ("kept", z, "gnc")):
        write_g2o(tmp_path / f"{name}.g2o", replace(graph, z=measured))
        main([str(tmp_path / f"{name}.g2o"), "--robust", robust, "--out", str(tmp_path / name)])
        told = "measurements contradict each other" in capsys.readouterr().out
        found = json.loads((tmp_path / name / "report.json").read_text())[PER_FREEDOM]
        assert told == (found > 10.0) == (name == "bad")
