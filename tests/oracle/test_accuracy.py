"""Errors of trajectories against closed forms, least squares and the chi-square law."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize
from scipy.stats import chi2
from support.graphs import compose, random_graph, small

from wifipgo.errors import UnknownNameError
from wifipgo.graph.accuracy import aligned, nees, rmse_rot, rmse_trans, rpe
from wifipgo.graph.posegraph import PoseGraph
from wifipgo.graph.solvers.spatial import marginal_covariances, solve_graph
from wifipgo.graph.subgraphs import anchors

DIMS = pytest.mark.parametrize("dims", [3, 7])


def shift(dims: int, x_m: float, yaw_rad: float) -> np.ndarray:
    twist = np.zeros((1, 3 if dims == 3 else 6))
    twist[0, 0], twist[0, -1] = x_m, yaw_rad
    return small(twist)


@DIMS
def test_a_shift_of_one_robot_is_its_rmse(dims: int) -> None:
    truth, graph = random_graph(0, dims=dims)
    estimate = truth.copy()
    estimate[graph.robot == 1, 0] += 3.0
    np.testing.assert_allclose(rmse_trans(estimate, truth, graph.robot), [0.0, 3.0, 0.0])
    np.testing.assert_allclose(rmse_trans(estimate, truth), np.sqrt(3.0))
    np.testing.assert_allclose(rmse_rot(estimate, truth), 0.0, atol=1e-7)
    turned = compose(truth, shift(dims, 0.0, 0.4))
    np.testing.assert_allclose(rmse_rot(turned, truth, graph.robot), 0.4)


@DIMS
def test_relative_error_sees_steps_and_no_drift_of_the_frame(dims: int) -> None:
    truth, graph = random_graph(1, dims=dims)
    moved = compose(shift(dims, 5.0, 1.0), truth)
    for delta in (1, 2):
        trans, rot = rpe(moved, truth, graph.robot, delta=delta)
        np.testing.assert_allclose(trans, 0.0, atol=1e-6)
        np.testing.assert_allclose(rot, 0.0, atol=1e-6)
    bent = truth.copy()
    last = graph.robot == 2
    last &= np.cumsum(last) == 5
    bent[last] = compose(truth[last], shift(dims, 0.3, 0.2))
    trans, rot = rpe(bent, truth, graph.robot)
    np.testing.assert_allclose(rot, [0.0, 0.0, 0.1], atol=1e-6)  # one of four steps
    assert trans[2] > 0.1
    assert np.isnan(rpe(bent, truth, graph.robot, delta=5)[0]).all()


@settings(max_examples=10)
@given(seed=st.integers(0, 10**6), dims=st.sampled_from([3, 7]))
def test_alignment_undoes_a_change_of_frame(seed: int, dims: int) -> None:
    truth, graph = random_graph(seed, dims=dims)
    rng = np.random.default_rng(seed)
    T = small(rng.uniform(-1.5, 1.5, (1, graph.freedom)))
    moved = compose(T, truth)
    for alignment in ("first", "rigid", "similar"):
        back = aligned(moved, truth, alignment=alignment)
        np.testing.assert_allclose(rmse_trans(back, truth), 0.0, atol=1e-6)
        np.testing.assert_allclose(rmse_rot(back, truth), 0.0, atol=1e-6)
    larger = moved.copy()
    d = 2 if dims == 3 else 3
    larger[:, :d] *= 2.5
    np.testing.assert_allclose(rmse_trans(aligned(larger, truth, alignment="similar"), truth), 0.0, atol=1e-6)


def test_the_rigid_alignment_is_the_least_of_all() -> None:
    truth, graph = random_graph(3, dims=3)
    estimate = graph.poses

    def cost(x: np.ndarray) -> float:
        return float(rmse_trans(compose(x[None], estimate), truth)[0])

    best = min(minimize(cost, [0.0, 0.0, yaw], tol=1e-10).fun for yaw in (-2.0, 0.0, 2.0))
    assert rmse_trans(aligned(estimate, truth), truth)[0] == pytest.approx(best, rel=1e-5)
    with pytest.raises(UnknownNameError, match="first, none, rigid, similar"):
        aligned(estimate, truth, alignment="umeyama")


@DIMS
def test_nees_of_a_right_model_is_in_its_band(dims: int) -> None:
    """200 graphs, one pose of each, against the 95 % band of the sum."""
    sigma, total = 0.02, 0.0
    for seed in range(200):
        truth, graph = random_graph(
            seed, dims=dims, robots=2, poses=3, meetings=3, noise=sigma, start_noise=0.1
        )
        columns = {name: getattr(graph, name) for name in PoseGraph.__slots__}
        columns["information"] = np.tile(np.eye(graph.freedom) / sigma**2, (len(graph.tail), 1, 1))
        columns["weight"] = np.ones(len(graph.tail))
        columns["poses"] = np.concatenate([truth[:1], graph.poses[1:]])
        assert anchors(graph).tolist() == [0]
        sure = PoseGraph(**columns)
        found, _ = solve_graph(sure)
        row = np.array([1 + seed % 5])
        total += nees(found[row], truth[row], marginal_covariances(sure, found, row))[0]
    low, high = chi2.interval(0.95, 200 * graph.freedom)
    assert low < total < high
