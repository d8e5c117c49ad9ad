"""Solutions in the plane and in space against published optima, hand-solved graphs and finite differences."""

import json
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2
from support.data_dir import data_dir
from support.graphs import between, compose, random_graph, small

from wifipgo import se2, se3
from wifipgo.errors import UnknownNameError
from wifipgo.graph.chordal import chordal_cost, chordal_optimum, links, matrices, pose_rows, two_stage
from wifipgo.graph.distributed import DistributedConfig, solve_distributed
from wifipgo.graph.edges import Edges
from wifipgo.graph.files.g2o import read_g2o
from wifipgo.graph.posegraph import PoseGraph, pose_graph
from wifipgo.graph.residuals import chi_squares, tangent_errors
from wifipgo.graph.solvers import solve_team
from wifipgo.graph.solvers.spatial import METHODS, marginal_covariances, solve_graph
from wifipgo.graph.subgraphs import anchors, components, from_team, of_robots

SETS = ("example_4robots", "example_9robots", "example_16robots")


def reference(name: str) -> tuple[PoseGraph, dict[str, Any]]:
    folder = data_dir("g2o")
    figures = json.loads((folder / "reference.json").read_text())["datasets"][name]
    return read_g2o(folder / name).graph, figures


@pytest.mark.parametrize("name", SETS)
def test_published_optima(name: str) -> None:
    graph, figures = reference(name)
    start, edges = matrices(graph.poses), links(graph)
    assert (len(graph.poses), len(graph.tail)) == (figures["poses"], figures["edges"])
    assert chordal_cost(start, edges) == pytest.approx(figures["cost_of_file_values"], abs=1e-5)
    stages = two_stage(graph, start)
    assert chordal_cost(stages, edges) == pytest.approx(
        figures["chordal_cost_two_stage_centralised"], rel=2e-5
    )
    optimum = chordal_optimum(graph, stages)
    assert chordal_cost(optimum, edges) == pytest.approx(figures["chordal_optimum"], abs=1e-7)
    error = 0.5 * chi_squares(graph, pose_rows(optimum)).sum()
    assert error == pytest.approx(figures["gtsam_error_of_chordal_optimum"], abs=1e-6)
    for initial in ("given", "chordal"):
        poses, report = solve_graph(graph, initial=initial)
        assert 0.5 * report.chi2_after == pytest.approx(figures["gtsam_lm_error"], abs=1e-5)
        assert chordal_cost(matrices(poses), edges) == pytest.approx(
            figures["chordal_cost_of_lm_solution"], abs=1e-4
        )


def line(steps_m: list[float], seen_m: float, precision: list[float]) -> PoseGraph:
    """A robot that goes straight ahead in space, and sees its last pose from its first."""
    n = len(steps_m)
    tail, head = np.append(np.arange(n), 0), np.append(np.arange(n) + 1, n)
    poses, z = np.tile(se3.IDENTITY, (n + 1, 1)), np.tile(se3.IDENTITY, (n + 1, 1))
    z[:, 0] = [*steps_m, seen_m]
    return pose_graph(
        robot=np.zeros(n + 1, dtype=int),
        index=np.arange(n + 1),
        poses=poses,
        tail=np.stack([0 * tail, tail], axis=-1),
        head=np.stack([0 * head, head], axis=-1),
        z=z,
        information=np.array(precision)[:, None, None] * np.eye(6),
    )


@pytest.mark.parametrize("method", METHODS)
def test_a_closed_loop_is_the_weighted_mean(method: str) -> None:
    """The gap is shared out in proportion to the variances; where there is no error both costs agree."""
    precision = [1.0, 4.0, 2.0]
    graph = line([1.0, 2.0], 3.6, precision)
    share = 0.6 / np.sum(1.0 / np.array(precision)) / np.array(precision)
    expected = np.cumsum(np.array([1.0, 2.0]) + share[:2])
    poses, report = solve_graph(graph, method=method)
    np.testing.assert_allclose(poses[1:, 0], expected, atol=1e-8)
    assert report.chi2_after == pytest.approx(float(share**2 @ np.array(precision)), rel=1e-9)
    np.testing.assert_allclose(two_stage(graph, matrices(graph.poses)).t_m[1:, 0], expected, atol=1e-9)
    covariance = marginal_covariances(graph, poses)[1:, 0, 0]
    np.testing.assert_allclose(
        covariance, [1 / (1 + 1 / (1 / 4 + 1 / 2)), 1 / (2 + 1 / (1 + 1 / 4))], rtol=1e-6
    )


@pytest.mark.parametrize("dims", [3, 7])
def test_without_noise_the_truth_is_found(dims: int) -> None:
    truth, graph = random_graph(3, dims=dims, noise=0.0, start_noise=0.2)
    found, report = solve_graph(graph, initial="chordal")
    fixed = anchors(graph)
    assert report.chi2_after < 1e-12
    T_found_truth = compose(found[fixed[:1]], inverse_of(truth[fixed[:1]]))
    np.testing.assert_allclose(found, normal(compose(T_found_truth, truth)), atol=1e-6)


def inverse_of(T: np.ndarray) -> np.ndarray:
    return between(T, np.zeros_like(T) if T.shape[-1] == 3 else se3.IDENTITY[None])


def normal(T: np.ndarray) -> np.ndarray:
    """The quaternion with qw >= 0, the angle in [-pi, pi)."""
    return compose(T, np.zeros(3) if T.shape[-1] == 3 else se3.IDENTITY)


@pytest.mark.parametrize("dims", [3, 7])
def test_the_solution_is_a_minimum_and_the_covariance_its_curvature(dims: int) -> None:
    """Finite differences of our own residuals, which share no code with gtsam."""
    _, graph = random_graph(4, dims=dims, robots=2, poses=4)
    found, report = solve_graph(graph)
    assert chi_squares(graph, found).sum() == pytest.approx(report.chi2_after, rel=1e-9)
    f, n = graph.freedom, len(found)
    jacobian = np.zeros((len(graph.tail) * f, n * f))
    for row, axis in np.ndindex(n, f):
        twist = np.zeros((n, f))
        twist[row, axis] = 1e-6
        ahead, back = (tangent_errors(graph, compose(found, small(s * twist))) for s in (1.0, -1.0))
        jacobian[:, row * f + axis] = (ahead - back).ravel() / 2e-6
    weighted = np.repeat(graph.weight, f)[:, None] * jacobian
    slope = weighted.T @ tangent_errors(graph, found).ravel()
    assert np.abs(slope[f:]).max() < 1e-4
    covariance = np.linalg.inv((weighted.T @ jacobian)[f:, f:]).reshape(n - 1, f, n - 1, f)
    blocks = covariance[np.arange(n - 1), :, np.arange(n - 1)]
    np.testing.assert_allclose(marginal_covariances(graph, found)[1:], blocks, rtol=2e-3, atol=2e-3)


def test_separate_parts_are_solved_and_stay_where_they_begin() -> None:
    _, graph = random_graph(5, meetings=0)
    apart = PoseGraph(
        **{name: getattr(graph, name) for name in ("robot", "index", "poses")},
        **{
            name: getattr(graph, name)[~graph.between_robots]
            for name in ("tail", "head", "z", "information", "weight")
        },
    )
    assert components(apart).tolist() == graph.robot.tolist()
    for method in METHODS:
        found, report = solve_graph(apart, method=method)
        assert report.chi2_after < 1e-9
        np.testing.assert_allclose(found[anchors(apart)], apart.poses[anchors(apart)], atol=1e-9)
    alone, _ = solve_graph(of_robots(graph, [1]))
    np.testing.assert_allclose(alone, found[graph.robot == 1], atol=1e-5)


def test_a_team_with_known_starts_is_solved_as_by_the_planar_solver() -> None:
    """Two ways to the same optimum: by rows and by robots."""
    rng = np.random.default_rng(0)
    truth = rng.uniform(-2.0, 2.0, (3, 6, 3))
    own = [((r, t), (r, t + 1)) for r in range(3) for t in range(5)]
    tail, head = np.array([*own, ((0, 2), (1, 2)), ((1, 4), (2, 3)), ((2, 5), (0, 4))]).transpose(1, 0, 2)
    z = se2.between(truth[tail[:, 0], tail[:, 1]], truth[head[:, 0], head[:, 1]])
    z = z + 0.02 * rng.normal(size=z.shape)
    edges = Edges.measured(tail=tail, head=head, z=z, sigma=(0.02, 0.02), reported_pose=np.zeros_like(z))
    graph = from_team(truth, edges)
    first = np.array([0, 6, 12])
    found, report = solve_graph(graph, fixed=first)
    team, team_report = solve_team(truth, edges)
    np.testing.assert_allclose(found, normal(team.reshape(-1, 3)), atol=1e-4)
    assert report.chi2_after == pytest.approx(team_report.chi2_after, rel=1e-4)
    config = DistributedConfig(threshold=1e-7, refinements=3)
    by_robots, told = solve_distributed(graph, fixed=first, config=config)
    assert told.converged
    optimum = pose_rows(chordal_optimum(graph, matrices(found), first))
    np.testing.assert_allclose(by_robots, optimum, atol=1e-4)


@pytest.mark.parametrize("dims", [3, 7])
@pytest.mark.parametrize("robust", ["huber", "gnc"])
def test_a_gross_outlier_is_weighed_down_and_named(dims: int, robust: str) -> None:
    truth, graph = random_graph(6, dims=dims, meetings=20, noise=0.0, start_noise=0.0)
    wrong = int(np.flatnonzero(~graph.odometry & ~graph.between_robots)[0])
    z = graph.z.copy()
    z[wrong, :2] += 40.0
    columns = {name: getattr(graph, name) for name in PoseGraph.__slots__}
    plain, _ = solve_graph(bad := PoseGraph(**(columns | {"z": z})))
    found, report = solve_graph(bad, robust=robust)
    (down,) = report.downweighted
    assert down.method == robust
    assert down.rows[down.weight.argmin()] == wrong
    start = truth[anchors(graph)[0]]
    off = [np.linalg.norm((p - truth)[:, :2] - (p[0] - start)[:2]) for p in (found, plain)]
    assert off[0] < 0.5 * off[1]


def test_chi_square_of_a_right_model_is_in_its_band() -> None:
    """Over 200 small graphs, for full matrices in space."""
    total, freedom = 0.0, 0
    for seed in range(200):
        _, graph = random_graph(seed, noise=0.02, start_noise=0.1, robots=2, poses=3, meetings=3)
        sure = np.broadcast_to(np.eye(6) / 0.02**2, graph.information.shape).copy()
        columns = {name: getattr(graph, name) for name in PoseGraph.__slots__}
        graph = PoseGraph(**(columns | {"information": sure, "weight": np.ones(len(graph.tail))}))
        total += solve_graph(graph)[1].chi2_after
        freedom += 6 * (len(graph.tail) - len(graph.poses) + 1)
    low, high = chi2.interval(0.95, freedom)
    assert low < total < high


def test_unknown_options_list_the_known_ones() -> None:
    _, graph = random_graph(0)
    with pytest.raises(UnknownNameError, match="gn, lm"):
        solve_graph(graph, method="newton")
    with pytest.raises(UnknownNameError, match="gnc, huber, none"):
        solve_graph(graph, robust="cauchy")


@pytest.mark.parametrize("dims", [3, 7])
def test_the_pose_that_is_known_is_the_only_one_that_stays(dims: int) -> None:
    """Which pose of a connected graph stays moves the optimum as a whole, and changes nothing else."""
    _, graph = random_graph(8, dims=dims, start_noise=0.05)
    known = np.array([4])
    held_first, _ = solve_graph(graph)
    held_other, _ = solve_graph(graph, fixed=known)
    there = compose(graph.poses[known], inverse_of(held_first[known]))
    expected = matrices(compose(there, held_first))
    for found, wanted in zip(matrices(held_other), expected, strict=True):
        np.testing.assert_allclose(found, wanted, atol=1e-4)
