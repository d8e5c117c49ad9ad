"""The distributed method finds what a centre would, shares no more than it may, and knows when it fails."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.graphs import random_graph

from wifipgo import se2, se3
from wifipgo.graph.chordal import chordal_cost, chordal_optimum, links, matrices, two_stage
from wifipgo.graph.distributed import Channel, DistributedConfig, solve_distributed
from wifipgo.graph.distributed.team import make_robots
from wifipgo.graph.posegraph import PoseGraph
from wifipgo.graph.subgraphs import of_edges, of_robots

EXACT = DistributedConfig(threshold=1e-9, refinements=0, max_rounds=20_000)
DIMS = st.sampled_from([3, 7])
SEEDS = st.integers(0, 10**6)


def gap(graph: PoseGraph, poses: np.ndarray) -> float:
    """Largest difference to the two stages solved by a centre."""
    found, best = matrices(poses), two_stage(graph, matrices(graph.poses))
    return float(max(np.abs(found.R - best.R).max(), np.abs(found.t_m - best.t_m).max()))


@settings(max_examples=8)
@given(seed=SEEDS, dims=DIMS, scheme=st.sampled_from(["gauss_seidel", "jor"]))
def test_many_rounds_find_what_a_centre_finds(seed: int, dims: int, scheme: str) -> None:
    _, graph = random_graph(seed, dims=dims)
    relaxation = 0.7 if scheme == "jor" else 1.0
    config = DistributedConfig(
        threshold=1e-8, refinements=0, max_rounds=20_000, scheme=scheme, relaxation=relaxation
    )
    poses, report = solve_distributed(graph, config=config)
    assert report.converged
    assert gap(graph, poses) < 1e-4
    assert report.cost_after == pytest.approx(chordal_cost(matrices(poses), links(graph)))


@pytest.mark.parametrize("delay", [0, 1, 2])
def test_late_values_are_not_overshot(delay: int) -> None:
    """Over-relaxation with values of rounds ago diverges, so it waits until values come in time."""
    _, graph = random_graph(2, poses=3)
    config = DistributedConfig(threshold=1e-3, max_rounds=500, relaxation=1.7)
    _, report = solve_distributed(graph, config=config, channel=Channel(delay_rounds=delay))
    assert report.converged
    least = chordal_cost(chordal_optimum(graph, two_stage(graph, matrices(graph.poses))), links(graph))
    assert report.cost_after < 1.01 * least


@settings(max_examples=5)
@given(seed=SEEDS)
def test_refinements_go_to_the_least_cost(seed: int) -> None:
    _, graph = random_graph(seed)
    least = chordal_cost(chordal_optimum(graph, two_stage(graph, matrices(graph.poses))), links(graph))
    costs = [
        solve_distributed(graph, config=DistributedConfig(threshold=1e-5, refinements=n))[1].cost_after
        for n in (0, 3)
    ]
    assert least * (1.0 - 1e-9) <= costs[1]
    assert costs[1] <= least * (1.0 + 1e-3) + 1e-9
    assert costs[1] <= costs[0] * (1.0 + 1e-6)


@settings(max_examples=5)
@given(seed=SEEDS, dims=DIMS)
def test_the_world_frame_moves_with_the_solution(seed: int, dims: int) -> None:
    _, graph = random_graph(seed, dims=dims)
    if dims == 3:
        there = graph.with_poses(se2.compose(np.array([[5.0, -3.0, 2.0]]), graph.poses))
    else:
        T_new_world = se3.exp(np.array([[5.0, -3.0, 1.0, 0.3, -0.2, 2.0]]))
        there = graph.with_poses(se3.compose(T_new_world, graph.poses))
    costs = [solve_distributed(g, config=EXACT)[1].cost_after for g in (graph, there)]
    assert costs[0] == pytest.approx(costs[1], rel=1e-6)


@settings(max_examples=8)
@given(seed=SEEDS, loss=st.sampled_from([0.1, 0.5]), delay=st.integers(0, 3))
def test_with_losses_and_delays_the_answer_is_right_or_said_to_be_none(
    seed: int, loss: float, delay: int
) -> None:
    _, graph = random_graph(seed, poses=3)
    config = DistributedConfig(threshold=1e-6, refinements=0, max_rounds=500)
    channel = Channel(loss=loss, attempts=2, delay_rounds=delay, rng=np.random.default_rng(seed))
    poses, report = solve_distributed(graph, config=config, channel=channel)
    assert report.n_lost > 0
    assert not report.converged or gap(graph, poses) < 1e-3


def test_robots_that_hear_nothing_have_not_converged() -> None:
    _, graph = random_graph(0)
    channel = Channel(loss=1.0, attempts=1, rng=np.random.default_rng(0))
    _, report = solve_distributed(graph, config=DistributedConfig(max_rounds=20), channel=channel)
    assert not report.converged
    assert report.n_lost == report.n_messages > 0


def test_a_link_that_dies_is_noticed() -> None:
    """What a robot said long ago is not taken for what it says, while it still moves."""

    class Dying(Channel):
        def send(self, receiver: int, message: object) -> bool:
            dead = receiver == 0 and self.now > 3
            return False if dead else super().send(receiver, message)  # type: ignore[arg-type]

    _, graph = random_graph(7, robots=4)
    _, report = solve_distributed(
        graph, config=DistributedConfig(threshold=1e-6, max_rounds=200), channel=Dying()
    )
    assert not report.converged


def test_a_warm_start_needs_fewer_rounds() -> None:
    _, graph = random_graph(3, robots=5, meetings=20)
    cold, first = solve_distributed(graph, config=DistributedConfig(threshold=1e-3))
    _, again = solve_distributed(graph, cold, config=DistributedConfig(threshold=1e-3, warm=True))
    assert again.converged
    assert sum(again.rounds) < 0.5 * sum(first.rounds)
    assert again.cost_after <= first.cost_after * (1.0 + 1e-3)


def test_bytes_are_those_of_the_separators() -> None:
    """72 B for a rotation, 48 B for a pose, for each separator and neighbour that needs it."""
    _, graph = random_graph(5, robots=4, meetings=15)
    between = graph.between_robots
    wanted = {
        (int(row), int(graph.robot[other]))
        for ends in ((graph.tail, graph.head), (graph.head, graph.tail))
        for row, other in zip(ends[0][between], ends[1][between], strict=True)
    }
    _, report = solve_distributed(graph, config=DistributedConfig(refinements=0))
    rotation, pose = report.rounds
    assert report.bytes_sent == len(wanted) * (72 * (rotation + 1) + 48 * pose)


def test_a_robot_is_given_nobody_elses_estimate() -> None:
    _, graph = random_graph(9)
    for robot in make_robots(graph, matrices(graph.poses)):
        own = graph.robot == robot.number
        assert len(robot.knowledge.start.R) == own.sum()
        touching = own[graph.tail] | own[graph.head]
        assert len(robot.knowledge.links.tail) == touching.sum()


def test_separate_teams_and_lone_robots_are_solved_apart() -> None:
    _, graph = random_graph(11, robots=4, meetings=0)
    tail, head = graph.robot[graph.tail], graph.robot[graph.head]
    kept = ((tail == head) | ((tail < 2) & (head < 2))) & (tail != 3) & (head != 3)
    apart = of_edges(graph, kept)
    poses, report = solve_distributed(apart, config=EXACT)
    assert report.converged
    assert gap(apart, poses) < 1e-6
    lone = graph.robot == 3
    np.testing.assert_allclose(matrices(poses[lone]).R, matrices(apart.poses[lone]).R, atol=1e-9)
    pair, _ = solve_distributed(of_robots(apart, [0, 1]), config=EXACT)
    np.testing.assert_allclose(pair, poses[graph.robot < 2], atol=1e-7)


def test_bad_settings_are_refused() -> None:
    with pytest.raises(ValueError, match="known: gauss_seidel, jor"):
        DistributedConfig(scheme="sor")
    with pytest.raises(ValueError, match=r"threshold must be > 0, got nan"):
        DistributedConfig(threshold=float("nan"))
    with pytest.raises(ValueError, match="rng must be given"):
        Channel(loss=0.1)
