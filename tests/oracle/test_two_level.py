"""Robots that solve on two levels find the optimum of one computer, and send separators only."""

from functools import partial

import numpy as np
import pytest
from support.graphs import random_graph

from wifipgo.graph.distributed import Channel, TwoLevelConfig, solve_two_level
from wifipgo.graph.distributed.asynchronous import AsynchronousConfig, solve_asynchronously
from wifipgo.graph.residuals import chi_squares, tangent_errors
from wifipgo.graph.solvers.linear_blocks import linear_blocks, stepped
from wifipgo.graph.solvers.spatial import solve_graph


def link(sender: int, receiver: int, *, mbit_s: float) -> float:
    """The same rate from everybody to everybody."""
    assert sender != receiver
    return mbit_s


EXACT = TwoLevelConfig(least_fall=1e-9, accuracy=1e-3)


@pytest.mark.parametrize("dims", [3, 7])
def test_slopes_are_those_of_the_residuals(dims: int) -> None:
    """Central differences of residuals that this project computes itself."""
    _, graph = random_graph(1, dims=dims, start_noise=0.3)
    blocks, d, h = linear_blocks(graph, graph.poses), graph.freedom, 1e-6
    information = graph.weight[:, None, None] * graph.information
    root = np.linalg.cholesky(information).swapaxes(1, 2)
    for k in range(d):
        twist = np.zeros((len(graph.poses), d))
        twist[:, k] = h
        ahead, behind = (tangent_errors(graph, stepped(graph.poses, s * twist)) for s in (1.0, -1.0))
        slope = np.einsum("eab,eb->ea", root, ahead - behind) / (2.0 * h)
        both = blocks.J_tail[..., k] + blocks.J_head[..., k]
        np.testing.assert_allclose((both**2).sum(axis=1), (slope**2).sum(axis=1), rtol=1e-4, atol=1e-5)
    np.testing.assert_allclose((blocks.off**2).sum(axis=1), chi_squares(graph, graph.poses), rtol=1e-9)


@pytest.mark.parametrize("dims", [3, 7])
@pytest.mark.parametrize("loss", ["none", "huber"])
def test_the_optimum_is_that_of_one_computer(dims: int, loss: str) -> None:
    _, graph = random_graph(2, dims=dims, start_noise=0.1)
    fixed = np.array([3])
    expected, _ = solve_graph(graph, fixed=fixed, robust=loss)
    found, report, _ = solve_two_level(graph, graph.poses, fixed=fixed, loss=loss, config=EXACT)
    assert report.converged
    np.testing.assert_allclose(found, expected, atol=1e-4)
    np.testing.assert_array_equal(found[fixed], graph.poses[fixed])


def test_stretches_spare_rounds_where_a_team_bends_slowly() -> None:
    """A ring of robots, each tied to the next at one place only: blocks alone hand errors on one by one."""
    rounds = {}
    for stretches in (0, 4):
        _, graph = random_graph(3, dims=3, robots=6, poses=6, meetings=0, start_noise=0.1)
        _, report, _ = solve_two_level(
            graph, config=TwoLevelConfig(stretches=stretches, accuracy=1e-3, least_fall=1e-6)
        )
        assert report.converged
        rounds[stretches] = sum(report.rounds)
    assert rounds[4] < 0.6 * rounds[0]


def test_what_is_lost_is_sent_again_and_changes_nothing() -> None:
    _, graph = random_graph(2, dims=3, start_noise=0.1)
    clean, lossy = Channel(), Channel(loss=0.3, attempts=2, rng=np.random.default_rng(0))
    expected, _, _ = solve_two_level(graph, channel=clean)
    found, report, _ = solve_two_level(graph, channel=lossy)
    np.testing.assert_array_equal(found, expected)
    assert report.n_lost > 0
    assert report.bytes_sent > clean.bytes_sent


def test_robots_that_hear_nothing_say_so() -> None:
    _, graph = random_graph(2, dims=3, start_noise=0.1)
    deaf = Channel(loss=1.0, attempts=1, rng=np.random.default_rng(0))
    found, report, _ = solve_two_level(graph, graph.poses, channel=deaf)
    assert not report.converged
    np.testing.assert_array_equal(found, graph.poses)


@pytest.mark.parametrize("wrong", [{"accuracy": 1.0}, {"least_fall": 0.0}, {"stretches": -1}])
def test_options_that_cannot_be(wrong: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=f"TwoLevelConfig.{next(iter(wrong))}"):
        TwoLevelConfig(**wrong)  # type: ignore[arg-type]


def test_airtime_follows_the_rates_of_links() -> None:
    """Half the rate, twice the time of what is sent; a packet has a time of its own."""
    _, graph = random_graph(2, dims=3, start_noise=0.1)
    fast, slow = (Channel(rate_mbit_s=partial(link, mbit_s=r)) for r in (13.0, 6.5))
    for channel in (fast, slow):
        solve_two_level(graph, channel=channel)
    packets_s = 1e-4 * fast.n_sent
    assert fast.airtime_s == pytest.approx(packets_s + 8e-6 * fast.bytes_sent / 13.0)
    assert slow.airtime_s - packets_s == pytest.approx(2.0 * (fast.airtime_s - packets_s))


def test_robots_that_do_not_wait_do_not_need_to() -> None:
    """Quick links, links slower than a step, and none: late values cost accuracy in a given time."""
    _, graph = random_graph(2, dims=3, start_noise=0.1)
    expected, _ = solve_graph(graph)
    config, cost = AsynchronousConfig(period_s=0.1, horizon_s=0.8), []
    for mbit_s in (6.5, 2e-3, 0.0):
        rows, report = solve_asynchronously(
            graph, graph.poses, rate_mbit_s=partial(link, mbit_s=mbit_s), config=config
        )
        cost.append(float(chi_squares(graph, rows).sum()))
        assert 15 <= report.steps <= 24
    assert float(chi_squares(graph, expected).sum()) < cost[0] < cost[1] < cost[2]
    assert cost[2] < float(chi_squares(graph, graph.poses).sum())
