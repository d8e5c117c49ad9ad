"""What cannot change a pose graph: the world's frame, the robots' numbers, the order of edges."""

from dataclasses import replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from wifipgo import se2
from wifipgo.graph.edges import Edges, select
from wifipgo.graph.metrics import ERR_WEIGHTS, ate_rot, ate_trans, residual_error
from wifipgo.graph.outliers.aoa_weights import PAPER_GATE_RAD, likelihood, paper_weights
from wifipgo.graph.solvers import solve, solve_team

SEEDS = st.integers(0, 2**32 - 1)
METRE = st.floats(-100.0, 100.0)
RADIAN = st.floats(-np.pi, np.pi)
N_ROBOTS, N_TIMES = 3, 6
STOP = 2e-4  # m or rad: the search may stop one iteration sooner or later


def noisy_graph(seed: int) -> tuple[np.ndarray, np.ndarray, Edges]:
    """Truth, dead reckoning and edges of robots that see each other and themselves at random."""
    rng = np.random.default_rng(seed)
    truth = rng.uniform(-2.0, 2.0, (N_ROBOTS, N_TIMES, 3))
    own = np.stack(np.meshgrid(np.arange(N_ROBOTS), np.arange(N_TIMES), indexing="ij"), axis=-1)
    seen = np.stack([rng.integers(0, N_ROBOTS, (2, 8)), rng.integers(0, N_TIMES, (2, 8))], axis=-1)
    tail = np.concatenate([own[:, :-1].reshape(-1, 2), seen[0]])
    head = np.concatenate([own[:, 1:].reshape(-1, 2), seen[1]])
    z = se2.between(truth[tail[:, 0], tail[:, 1]], truth[head[:, 0], head[:, 1]])
    z = z + rng.normal(size=z.shape) * [0.1, 0.1, 0.05]
    start = truth.copy()
    for t in range(N_TIMES - 1):
        start[:, t + 1] = se2.compose(start[:, t], z[: -len(seen[0])].reshape(N_ROBOTS, -1, 3)[:, t])
    weight, told = rng.uniform(0.1, 1.0, len(z)), start[head[:, 0], head[:, 1]]
    keep = (tail != head).any(axis=1)
    edges = Edges.measured(tail=tail, head=head, z=z, sigma=(0.1, 0.05), weight=weight, reported_pose=told)
    return truth, start, select(edges, keep)


def moved(T_new_world: np.ndarray, poses: np.ndarray, edges: Edges) -> tuple[np.ndarray, Edges]:
    """The same graph in another world frame."""
    return se2.compose(T_new_world, poses), replace(
        edges, reported_pose=se2.compose(T_new_world, edges.reported_pose)
    )


def apart(a: np.ndarray, b: np.ndarray) -> float:
    """Largest difference of two sets of poses, m or rad."""
    return float(np.abs(np.concatenate([a[..., :2] - b[..., :2], se2.wrap_angle(a - b)[..., 2:]], -1)).max())


@given(seed=SEEDS, x_m=METRE, y_m=METRE, yaw_rad=RADIAN)
def test_the_world_frame_changes_no_error(seed: int, x_m: float, y_m: float, yaw_rad: float) -> None:
    truth, start, edges = noisy_graph(seed)
    T_new_world = np.array([x_m, y_m, yaw_rad])
    there, edges_there = moved(T_new_world, start, edges)
    for weights in ERR_WEIGHTS:
        here = residual_error(start, edges, weights=weights)
        np.testing.assert_allclose(residual_error(there, edges_there, weights=weights), here, atol=1e-9)
    truth_there = se2.compose(T_new_world, truth)
    np.testing.assert_allclose(ate_trans(there, truth_there), ate_trans(start, truth), atol=1e-9)
    np.testing.assert_allclose(ate_rot(there, truth_there), ate_rot(start, truth), atol=1e-9)


@settings(max_examples=25)
@given(seed=SEEDS, x_m=METRE, y_m=METRE, yaw_rad=RADIAN)
def test_the_world_frame_moves_with_the_solution(seed: int, x_m: float, y_m: float, yaw_rad: float) -> None:
    _, start, edges = noisy_graph(seed)
    T_new_world = np.array([x_m, y_m, yaw_rad])
    there, edges_there = moved(T_new_world, start, edges)
    here, _ = solve(start, edges, robots=[0, 2])
    solved_there, _ = solve(there, edges_there, robots=[0, 2])
    assert apart(solved_there, se2.compose(T_new_world, here)) < STOP


@settings(max_examples=25)
@given(seed=SEEDS, names=st.permutations(range(N_ROBOTS)))
def test_renaming_robots_renames_results(seed: int, names: list[int]) -> None:
    truth, start, edges = noisy_graph(seed)
    new, old = np.array(names), np.argsort(names)  # robot r is called new[r]
    tail, head = edges.tail.copy(), edges.head.copy()
    tail[:, 0], head[:, 0] = new[tail[:, 0]], new[head[:, 0]]
    renamed = replace(edges, tail=tail, head=head)
    for weights in ERR_WEIGHTS:
        err = residual_error(start[old], renamed, weights=weights)
        np.testing.assert_allclose(err[new], residual_error(start, edges, weights=weights), rtol=1e-12)
    np.testing.assert_array_equal(ate_trans(start[old], truth[old])[new], ate_trans(start, truth))
    solved, _ = solve_team(start, edges)
    solved_renamed, _ = solve_team(start[old], renamed)
    assert apart(solved_renamed[new], solved) < STOP


@settings(max_examples=25)
@given(seed=SEEDS)
def test_the_order_of_edges_does_not_matter(seed: int) -> None:
    _, start, edges = noisy_graph(seed)
    shuffled = select(edges, np.random.default_rng(seed).permutation(len(edges)))
    solved, report = solve(start, edges, robots=[0, 1])
    again, report_again = solve(start, shuffled, robots=[1, 0])
    np.testing.assert_array_equal(solved, again)
    assert report.n_used == report_again.n_used
    np.testing.assert_allclose(
        residual_error(start, shuffled), residual_error(start, edges), rtol=1e-12, atol=1e-15
    )


@given(seed=SEEDS)
def test_without_noise_nothing_is_wrong_and_nothing_moves(seed: int) -> None:
    truth, _, edges = noisy_graph(seed)
    ends = [truth[e[:, 0], e[:, 1]] for e in (edges.tail, edges.head)]
    exact = replace(edges, z=se2.between(*ends), reported_pose=ends[1])
    assert residual_error(truth, exact).max() < 1e-20
    assert apart(solve(truth, exact, robots=[0, 1])[0], truth) < 1e-9


@settings(max_examples=25)
@given(seed=SEEDS, share=st.floats(0.05, 1.0))
def test_a_common_weight_changes_no_solution(seed: int, share: float) -> None:
    """Weights of 1 are plain optimisation; any common factor on all information is too."""
    _, start, edges = noisy_graph(seed)
    plain, _ = solve_team(start, replace(edges, weight=np.ones(len(edges))))
    scaled, _ = solve_team(start, replace(edges, weight=np.full(len(edges), share)))
    assert apart(plain, scaled) < STOP


@given(off=st.lists(st.floats(-20.0, 20.0), min_size=1), sigma_rad=st.floats(0.01, 0.39))
def test_weights_are_shares_and_fall_with_the_angle(off: list[float], sigma_rad: float) -> None:
    angles = np.array(off)
    weight = paper_weights(angles, np.zeros_like(angles), sigma_rad=sigma_rad)
    assert ((weight >= 0.0) & (weight <= 1.0)).all()
    near = np.abs(se2.wrap_angle(angles)) < PAPER_GATE_RAD
    assert (weight[near] == 1.0).all()
    falling = likelihood(np.sort(np.abs(se2.wrap_angle(angles))), sigma_rad=sigma_rad)
    assert (np.diff(falling) <= 1e-12).all()
