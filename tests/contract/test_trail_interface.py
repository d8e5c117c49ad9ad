"""What a robot remembers of its way, and what it makes of it, beside a plain reckoning of the same."""

import numpy as np
import pytest

from baselines.policies import make_policy
from baselines.policies.learned.trail_interface import N_DIRECTION, N_WHOLE, Trail, Trails
from envs.rendezvous_v0 import parallel_env, vector_env
from wifipgo.scenarios import Scenario, scenario_named

_STEPS = 25


def episodes(scenario: Scenario, seeds: list[int]) -> list[np.ndarray]:
    """Observations of teams that explore, (worlds, robots, numbers), iteration after iteration."""
    env, policy = vector_env(scenario, n_worlds=len(seeds)), make_policy("frontier_home", scenario)
    policy.reset_rows(seeds)
    seen, _ = env.reset(seed=seeds)
    found = [seen.copy()]
    for _ in range(_STEPS):
        found.append(env.step(policy.act_rows(found[-1])).observations.copy())
    return found


def replayed(interface: Trails, observations: list[np.ndarray]) -> tuple[Trail, np.ndarray]:
    memory = None
    for teams in observations:
        rows = teams.reshape(-1, teams.shape[-1])
        memory = interface.remembered(rows, memory)
    assert memory is not None
    return memory, interface.shown(rows, memory)


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    return scenario_named("paper-hw-2-hetero")


@pytest.fixture(scope="module")
def seen(scenario: Scenario) -> list[np.ndarray]:
    return episodes(scenario, [3, 4, 5])


def blocks(shown: np.ndarray) -> np.ndarray:
    """The numbers of directions that this interface adds, (rows, numbers, rays)."""
    return shown[:, N_WHOLE:].reshape(len(shown), N_DIRECTION, 16)[:, 12:]


def test_a_team_alone_is_shown_what_it_is_shown_among_others(
    scenario: Scenario, seen: list[np.ndarray]
) -> None:
    _, together = replayed(Trails(scenario), seen)
    for k in range(3):
        _, alone = replayed(Trails(scenario), [teams[k : k + 1] for teams in seen])
        np.testing.assert_array_equal(together[2 * k : 2 * k + 2], alone)


def test_old_places_are_those_that_were_passed(scenario: Scenario, seen: list[np.ndarray]) -> None:
    """Whether a step ends in reach of a place of three iterations before, reckoned one by one."""
    layout = {field.name: field.where for field in parallel_env(scenario).layout}
    _, shown = replayed(Trails(scenario), seen)
    closes, gain = blocks(shown)[:, 0], blocks(shown)[:, 3]
    size, reach_m = scenario.arena.size_m, 0.9 * scenario.sensing.sensor_range_m
    step_m = scenario.arena.step_m
    for row in range(6):
        path = np.array([teams.reshape(6, -1)[row] for teams in seen])
        place_m, spread_m = (
            size * path[:, layout["own/position"]],
            path[:, layout["own/recorded_spread"]][:, 0],
        )
        heading = path[-1, layout["own/heading"]]
        for ray in range(16):
            free = path[-1, layout["lidar"]][ray] * scenario.arena.lidar_range_m / step_m
            length = np.clip(free - 0.15, 0.0, 1.0) * step_m
            angle = np.arctan2(heading[1], heading[0]) + ray * np.pi / 8.0
            there = place_m[-1] + length * np.array([np.cos(angle), np.sin(angle)])
            away = np.hypot(*(place_m[: _STEPS + 2 - scenario.sensing.revisit_gap] - there).T)
            if abs(away.min() - reach_m) < 1e-4:
                continue
            assert closes[row, ray] == (away.min() <= reach_m)
            surer = np.log1p(4.0 * spread_m[-1]) - np.log1p(4.0 * spread_m[away.argmin()])
            assert gain[row, ray] == pytest.approx(max(surer, 0.0) if closes[row, ray] else 0.0, abs=1e-4)
    assert 0.0 < closes.mean() < 1.0


def test_a_memory_begins_anew_with_an_episode_and_is_left_as_it_was(
    scenario: Scenario, seen: list[np.ndarray]
) -> None:
    trails = Trails(scenario)
    memory, _ = replayed(trails, seen)
    before = [each.copy() for each in memory]
    first, last = (teams.reshape(6, -1) for teams in (seen[0], seen[-1]))
    rows = np.concatenate([last[:2], first[2:]])  # the first world goes on, the others begin
    after = trails.remembered(rows, memory)
    for each, old in zip(memory, before, strict=True):
        np.testing.assert_array_equal(each, old)
    assert after.clock.tolist() == [_STEPS] * 2 + [0] * 4
    assert np.isfinite(after.place[:2, :_STEPS]).all()
    assert not np.isfinite(after.place[2:, 1:]).any()
    np.testing.assert_array_equal(trails.shown(rows, after)[2:], trails.shown(first)[2:])
    joined = trails.remembered(last, memory, np.arange(6) < 2)  # the first world is another one now
    assert np.isfinite(joined.place[..., 0]).sum(axis=1).tolist() == [1] * 2 + [_STEPS + 1] * 4


def test_a_turn_of_the_body_turns_what_is_shown(scenario: Scenario, seen: list[np.ndarray]) -> None:
    """The world turns by -90 degrees in the body frame: 4 of 16 rays, 18 of 72 profile bins."""
    layout = {field.name: field.where for field in parallel_env(scenario).layout}
    trails, rows = Trails(scenario), seen[-1].reshape(6, -1)
    memory, shown = replayed(trails, seen)
    turned = rows.copy()
    turned[:, layout["lidar"]] = np.roll(rows[:, layout["lidar"]], -4, axis=1)
    turned[:, layout["slot0/profile"]] = np.roll(rows[:, layout["slot0/profile"]], -18, axis=1)
    c, s = rows[:, layout["own/heading"]].T
    turned[:, layout["own/heading"]] = np.stack([-s, c], axis=1)
    c, s = rows[:, layout["own/sighted_bearing"]].T
    turned[:, layout["own/sighted_bearing"]] = np.stack([s, -c], axis=1)
    after = trails.shown(turned, memory)
    np.testing.assert_allclose(after[:, :N_WHOLE], shown[:, :N_WHOLE], atol=1e-5)
    near_m = np.roll(blocks(shown), -4, axis=2)
    assert (np.abs(blocks(after) - near_m) > 1e-3).mean() < 0.01  # a place at the edge of the range


def test_robots_know_which_of_them_sees_badly(scenario: Scenario, seen: list[np.ndarray]) -> None:
    """One robot has a third of the noise, the other three times as much."""
    _, shown = replayed(Trails(scenario), seen)
    own, others = shown[:, N_WHOLE - 15 : N_WHOLE - 13], shown[:, N_WHOLE - 13 : N_WHOLE - 11]
    np.testing.assert_allclose(own[1] - own[0], np.log(9.0), rtol=1e-5)
    np.testing.assert_allclose(own[::2], others[1::2], rtol=1e-6)
