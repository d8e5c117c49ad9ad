"""What must hold of an iteration whatever the numbers: chance, truth, belief, meetings."""

import itertools
from dataclasses import fields
from typing import Any, get_type_hints

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from envs.rendezvous_v0 import observe
from wifipgo.graph import ate_rot, ate_trans
from wifipgo.loop import advance, start
from wifipgo.scenarios import SCENARIOS, Scenario, scenario_named
from wifipgo.state import Belief, Commands, Tick, Truth
from wifipgo.streams import Streams


def episode(scenario: Scenario, seed: int, *, n_steps: int, stand: bool = False) -> list[Tick]:
    """Ticks of an episode of robots that walk at random, or stand still."""
    streams, walk = Streams.for_episode(seed, 0), np.random.default_rng(seed)
    world, tick = start(scenario, streams)
    ticks = [tick]
    for _ in range(n_steps):
        angle = walk.uniform(-np.pi, np.pi, scenario.n_robots)
        waypoints = np.stack([np.cos(angle), np.sin(angle)], axis=-1) * (0.0 if stand else 1.0)
        commands = Commands(waypoints, np.zeros(scenario.n_robots, dtype=bool))
        tick = advance(tick, commands, world=world, scenario=scenario, streams=streams)
        ticks.append(tick)
    return ticks


@settings(max_examples=6)
@given(st.integers(0, 10_000))
def test_no_noise_no_error(seed: int) -> None:
    """Perfect sensors: dead reckoning is the truth, every residual is zero, a solve changes nothing."""
    perfect = scenario_named("paper-hw-2", sigma_t_m=0.0, sigma_r_rad=0.0, size_m=6.0)
    last = episode(perfect, seed, n_steps=12)[-1]
    np.testing.assert_allclose(last.belief.paths.estimate[..., :2], last.truth.poses[..., :2], atol=1e-6)
    np.testing.assert_allclose(last.belief.err, 0.0, atol=1e-9)
    np.testing.assert_allclose(ate_trans(last.belief.paths.estimate, last.truth.poses), 0.0, atol=1e-9)
    np.testing.assert_allclose(ate_rot(last.belief.paths.estimate, last.truth.poses), 0.0, atol=1e-9)


def test_two_policies_meet_the_same_noise() -> None:
    """Standing or walking, the error of each odometry reading in units of sigma is the same."""
    scenario = scenario_named("paper-hw-2", n_obstacles=2, kappa=1000)  # nobody ever meets
    runs = [episode(scenario, 3, n_steps=8, stand=stand) for stand in (False, True)]
    heading_errors = []
    for ticks in runs:
        estimate, truth = ticks[-1].belief.paths.estimate, ticks[-1].truth.poses
        step = np.diff(estimate[..., 2], axis=1) - np.diff(truth[..., 2], axis=1)
        heading_errors.append(np.angle(np.exp(1j * step)))
    np.testing.assert_allclose(heading_errors[0], heading_errors[1], atol=1e-9)
    np.testing.assert_array_equal(runs[0][0].truth.poses, runs[1][0].truth.poses)


def test_a_new_stream_would_disturb_no_other() -> None:
    """Streams are keyed by place: the numbers of one do not depend on how much another was used."""
    first, second = Streams.for_episode(1, 0), Streams.for_episode(1, 0)
    first.layout.random(1000)
    assert first.channel.random() == second.channel.random()
    assert Streams.for_episode(1, 1).channel.random() != second.layout.random()


def test_belief_holds_no_truth() -> None:
    """By type, and by effect: other truth behind the same belief, same observation."""
    assert not [name for name, kind in get_type_hints(Belief).items() if "truth" in name or kind is Truth]
    scenario = scenario_named("paper-hw-2")
    tick = episode(scenario, 0, n_steps=3)[-1]
    lie = tick._replace(truth=tick.truth._replace(poses=tick.truth.poses + 7.0))
    np.testing.assert_array_equal(observe(tick.belief, scenario), observe(lie.belief, scenario))


def test_robots_that_stay_together_meet_every_kappa_iterations() -> None:
    """In a room smaller than the sensor range each iteration brings one observation each way."""
    small = scenario_named("paper-hw-2", size_m=1.5, lidar_range_m=1.0)
    ticks = episode(small, 1, n_steps=9, stand=True)
    met = [bool(tick.belief.team.met) for tick in ticks]
    assert met == [False, False, True, False, False, True, False, False, True, False]
    assert ticks[-1].belief.team.bytes_sent > 0
    assert (ticks[-1].belief.team.last_met == 8).all()


def test_a_meeting_lowers_the_error_of_lost_robots() -> None:
    lost = scenario_named("paper-hw-2", sigma_t_m=0.3, size_m=5.0)
    ticks = episode(lost, 2, n_steps=30)
    drops = [
        (a.belief.err.sum(), b.belief.err.sum())
        for a, b in itertools.pairwise(ticks)
        if b.belief.team.met and a.belief.err.sum() > 5.0
    ]
    assert drops
    assert all(after < before for before, after in drops)


def test_no_measurement_goes_through_a_wall() -> None:
    """Relative poses between robots exist only where nothing stood between them."""
    scenario = scenario_named("paper-hw-2", n_obstacles=4, size_m=12.0)
    ticks = episode(scenario, 5, n_steps=40)
    edges, poses = ticks[-1].belief.log.edges, ticks[-1].truth.poses
    pair = edges.between_robots
    gap = (
        poses[edges.tail[pair, 0], edges.tail[pair, 1], :2]
        - poses[edges.head[pair, 0], edges.head[pair, 1], :2]
    )
    assert (np.hypot(*gap.T) <= scenario.sensing.sensor_range_m + 1e-9).all()


@pytest.mark.parametrize("name", list(SCENARIOS))
def test_every_scenario_says_what_is_the_papers_and_what_is_ours(name: str) -> None:
    assert "ours" in SCENARIOS[name].source.lower()
    assert "paper" in SCENARIOS[name].source.lower() or "Sec." in SCENARIOS[name].source


@pytest.mark.parametrize(
    ("changes", "part"),
    [({"n_obstacles": 3}, "arena"), ({"sigma_t_m": 1}, "sensing"), ({"kappa": 5}, "rendezvous")],
)
def test_overrides_reach_the_part_that_holds_them(changes: dict[str, Any], part: str) -> None:
    changed = scenario_named("paper-hw-2").with_overrides(**changes)
    for name, value in changes.items():
        assert getattr(getattr(changed, part), name) == value
    assert changed.with_overrides(
        **{k: getattr(getattr(scenario_named("paper-hw-2"), part), k) for k in changes}
    ) == (scenario_named("paper-hw-2"))


def test_no_two_parts_share_a_field_name() -> None:
    parts = [getattr(SCENARIOS["paper-hw-2"], f.name) for f in fields(Scenario)]
    names = [f.name for part in parts if hasattr(part, "__dataclass_fields__") for f in fields(part)]
    doubled = {name for name in names if names.count(name) > 1}
    assert not doubled
