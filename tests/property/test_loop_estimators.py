"""Who optimises, and when: what that changes in the loop, and what it must leave alone."""

from typing import Any

import numpy as np
import pytest

from wifipgo.errors import UnknownNameError
from wifipgo.graph import ate_trans, residual_error, solve
from wifipgo.graph.config import GraphConfig
from wifipgo.graph.distributed.simulated_team import solve_by_robots
from wifipgo.graph.smoother_updates import CAREFUL
from wifipgo.loop import advance, start
from wifipgo.loop.exchange import BYTES_PER_PING
from wifipgo.rendezvous import RendezvousConfig
from wifipgo.scenarios import scenario_named
from wifipgo.state import Commands, Tick
from wifipgo.streams import Streams

SMALL = {"size_m": 3.0, "lidar_range_m": 2.0}


def episode(
    seed: int = 0, n_steps: int = 12, n_robots: int = 2, reach_m: float = 1.0, **overrides: Any
) -> Tick:
    """Last tick of robots that walk at random in a small room and meet often."""
    scenario = scenario_named("paper-hw-2", n_robots=n_robots, **(SMALL | overrides))
    streams, walk = Streams.for_episode(seed, 0), np.random.default_rng(seed)
    world, tick = start(scenario, streams)
    for _ in range(n_steps):
        commands = Commands(walk.uniform(-reach_m, reach_m, (n_robots, 2)), np.zeros(n_robots, dtype=bool))
        tick = advance(tick, commands, world=world, scenario=scenario, streams=streams)
    return tick


@pytest.mark.parametrize(
    "how",
    [
        {"estimator": "every_step"},
        {"estimator": "every_step", "outliers": "huber"},
        {"estimator": "every_step", "outliers": "bearing"},
        {"estimator": "every_step", "aoa_factors": True},
        {"backend": "distributed"},
        {"backend": "distributed", "outliers": "huber"},
        {"backend": "distributed", "outliers": "pcm"},
    ],
    ids=str,
)
def test_the_world_and_the_measurements_stay(how: dict[str, Any]) -> None:
    """Chance and meetings are those of paper mode; the estimates are not, and they are better than none."""
    plain, other = episode(), episode(**how)
    np.testing.assert_array_equal(other.truth.poses, plain.truth.poses)
    np.testing.assert_array_equal(other.belief.log.edges.z, plain.belief.log.edges.z)
    np.testing.assert_array_equal(other.belief.team.last_met, plain.belief.team.last_met)
    assert plain.belief.team.last_met.max() > 0
    assert not np.array_equal(other.belief.paths.estimate, plain.belief.paths.estimate)
    dead = episode(kappa=10_000)
    error = [ate_trans(tick.belief.paths.estimate, tick.truth.poses).mean() for tick in (other, dead)]
    assert error[0] < error[1]


@pytest.mark.parametrize("how", [{"estimator": "every_step"}, {"backend": "distributed"}], ids=str)
def test_without_noise_nothing_moves(how: dict[str, Any]) -> None:
    tick = episode(sigma_t_m=0.0, sigma_r_rad=0.0, **how)
    np.testing.assert_allclose(tick.belief.paths.estimate, tick.truth.poses, atol=1e-6)
    np.testing.assert_allclose(tick.belief.err, 0.0, atol=1e-9)


@pytest.mark.parametrize("how", [{}, {"estimator": "every_step"}, {"backend": "distributed"}], ids=str)
def test_twice_the_same_to_the_bit(how: dict[str, Any]) -> None:
    first, second = episode(n_robots=3, **how), episode(n_robots=3, **how)
    np.testing.assert_array_equal(first.belief.paths.estimate, second.belief.paths.estimate)
    np.testing.assert_array_equal(first.belief.paths.covariance, second.belief.paths.covariance)


@pytest.mark.parametrize("loss", ["none", "huber"])
@pytest.mark.parametrize("third_party", ["fixed_told", "ignore"])
def test_robots_by_themselves_come_near_the_central_optimum(loss: str, third_party: str) -> None:
    """Their cost is chordal and they stop early, so the error of Eq. 4 is compared, not the poses."""
    tick = episode(kappa=10_000, n_robots=3, seed=3)
    poses, edges = tick.belief.paths.estimate, tick.belief.log.edges
    mine, report = solve_by_robots(poses, edges, robots=[0, 2], loss=loss, third_party=third_party)
    best, _ = solve(poses, edges, robots=[0, 2], loss=loss, third_party=third_party)
    np.testing.assert_array_equal(mine[:, 0], poses[:, 0])
    np.testing.assert_array_equal(mine[1], poses[1])
    assert report.converged
    errors = [residual_error(p, edges, weights="information")[[0, 2]].sum() for p in (poses, mine, best)]
    assert errors[2] <= errors[1] * 1.001 <= errors[0]
    assert np.abs(mine - best)[..., :2].max() < 0.35 * np.abs(poses - best)[..., :2].max()


def test_lost_messages_cost_bytes_and_change_nothing() -> None:
    sure, lossy = (episode(backend="distributed", message_loss=loss) for loss in (0.0, 0.4))
    np.testing.assert_array_equal(sure.belief.paths.estimate, lossy.belief.paths.estimate)
    assert lossy.belief.team.bytes_sent > sure.belief.team.bytes_sent


def test_a_solution_that_did_not_arrive_is_not_believed() -> None:
    """With nearly all messages lost the robots keep their poses and what is due stays due."""
    tick = episode(backend="distributed", message_loss=1.0 - 1e-9)
    assert tick.belief.team.last_met.max() == 0
    assert tick.belief.team.observed.max() > RendezvousConfig().kappa
    np.testing.assert_array_equal(tick.belief.paths.estimate, episode(kappa=10_000).belief.paths.estimate)


def test_pings_are_of_the_slots_and_their_packets_are_counted() -> None:
    plain = episode(estimator="every_step")
    heard = episode(estimator="every_step", aoa_factors=True)
    pings, turn = heard.belief.log.pings, scenario_named("paper-hw-2").turn
    assert len(plain.belief.log.pings.observer) == 0
    assert len(pings.observer) == 2 * 13  # two robots that hear each other, at the start and 12 times
    assert (
        heard.belief.team.bytes_sent - plain.belief.team.bytes_sent
        >= 2 * 13 * BYTES_PER_PING * turn.n_positions
    )


def test_directions_of_robots_far_away_cut_the_error_of_robots_that_never_meet() -> None:
    """Four rooms of two robots that cross them without a rendezvous."""
    apart: dict[str, Any] = {"size_m": 20.0, "reach_m": 2.0, "n_steps": 30, "kappa": 10_000}
    apart["estimator"] = "every_step"
    error = [
        [ate_trans(t.belief.paths.estimate, t.truth.poses).mean() for t in (plain, heard)]
        for plain, heard in (
            (episode(seed, **apart), episode(seed, aoa_factors=True, **apart)) for seed in range(4)
        )
    ]
    without, with_factors = np.mean(error, axis=0)
    assert with_factors < 0.6 * without


def test_covariance_grows_on_the_way_and_falls_at_a_meeting() -> None:
    alone, met = episode(kappa=10_000), episode()
    trace = np.trace(alone.belief.paths.covariance[:, :2, :2], axis1=1, axis2=2)
    n_steps, sigma_t_m = 12, scenario_named("paper-hw-2").sensing.sigma_t_m
    assert (trace > 0.99 * 2.0 * n_steps * sigma_t_m**2).all()
    assert (np.trace(met.belief.paths.covariance[:, :2, :2], axis1=1, axis2=2) < trace).all()
    np.testing.assert_allclose(
        met.belief.paths.covariance, met.belief.paths.covariance.transpose(0, 2, 1), atol=1e-12
    )


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"estimator": "sometimes"}, "every_step"),
        ({"backend": "cloud"}, "distributed"),
        ({"estimator": "every_step", "backend": "distributed"}, "backend"),
        ({"estimator": "every_step", "outliers": "gnc"}, "outliers"),
        ({"estimator": "every_step", "outliers": "pcm+bearing"}, "outliers"),
        ({"backend": "distributed", "outliers": "bearing"}, "outliers"),
        ({"message_loss": 0.1}, "message_loss"),
        ({"aoa_factors": True}, "aoa_factors"),
        ({"backend": "distributed", "message_loss": 1.0}, "message_loss"),
    ],
)
def test_what_does_not_go_together_is_refused(wrong: dict[str, Any], says: str) -> None:
    with pytest.raises((ValueError, UnknownNameError), match=says):
        GraphConfig(**wrong)


def test_headings_that_are_hardly_known_are_solved_with_more_digits(monkeypatch: pytest.MonkeyPatch) -> None:
    """Positions to a millimetre and headings to a radian: Cholesky's factors lose all their digits."""
    monkeypatch.setitem(SMALL, "size_m", 20.0)
    belief = episode(n_steps=25, n_robots=3, estimator="every_step", sigma_t_m=0.0, sigma_r_rad=1.2).belief
    assert belief.paths.smoothing is not None
    assert belief.paths.smoothing.way.max() == CAREFUL
    assert np.isfinite(belief.paths.estimate).all()
    assert np.isfinite(belief.paths.covariance).all()
