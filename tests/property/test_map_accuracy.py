"""The score: what is seen, where the team's map has it, and what the reward makes of it."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from envs.rendezvous_v0 import REWARDS, parallel_env
from property.test_loop import episode
from wifipgo import se2
from wifipgo.scenarios import scenario_named
from wifipgo.state import Tick
from wifipgo.world.coverage import CELL_M, TOLERANCE_M, empty_map, reveal
from wifipgo.world.layout import Layout, room_walls
from wifipgo.world.map_accuracy import MapAccuracy, first_map_accuracy, updated_map_accuracy

CROWDED = scenario_named("paper-hw-2", n_obstacles=2, size_m=8.0, clearance_m=0.5)


def by_definition(tick: Tick) -> float:
    """MapAccuracy share one sighting at a time, by transforms instead of offsets."""
    cells, n = tick.truth.cells, tick.truth.cells.seen.shape[1]
    placed: dict[int, list[np.ndarray]] = {}
    for t, seen in enumerate(cells.sightings):
        for robot, cell in zip(seen.row.tolist(), seen.cell.tolist(), strict=True):
            middle_m = CELL_M * (np.array([[cell // n, cell % n]]) + 0.5)
            body_m = se2.apply(se2.inverse(tick.truth.poses[robot, t][None]), middle_m)
            placed.setdefault(cell, []).append(
                se2.apply(tick.belief.paths.estimate[robot, t][None], body_m)[0]
            )
    truth = {cell: CELL_M * (np.array([cell // n, cell % n]) + 0.5) for cell in placed}
    good = [np.linalg.norm(np.mean(p, axis=0) - truth[c]) <= TOLERANCE_M for c, p in placed.items()]
    return sum(good) / int(cells.free.sum())


def map_of(tick: Tick, estimate: np.ndarray) -> MapAccuracy:
    return first_map_accuracy(tick.truth.cells, tick.truth.poses, estimate)


def score(ticks: list[Tick]) -> MapAccuracy:
    """MapAccuracy share kept up to date tick by tick."""
    first = ticks[0]
    mapped = map_of(first, first.belief.paths.estimate)
    for before, after in itertools.pairwise(ticks):
        mapped = updated_map_accuracy(
            mapped,
            after.truth.cells,
            after.truth.poses,
            before.belief.paths.estimate,
            after.belief.paths.estimate,
        )
    return mapped


@settings(max_examples=5)
@given(st.integers(0, 10_000))
def test_kept_up_to_date_it_is_what_its_definition_says(seed: int) -> None:
    """Robots meet often in a small room, so poses move again and again."""
    ticks = episode(CROWDED, seed, n_steps=25)
    assert score(ticks).share[0] == pytest.approx(by_definition(ticks[-1]), abs=1e-12)


def test_poses_did_move_in_the_test_above() -> None:
    assert any(tick.belief.team.met for tick in episode(CROWDED, 0, n_steps=25))


def test_with_perfect_sensors_all_that_is_seen_is_mapped() -> None:
    perfect = CROWDED.with_overrides(sigma_t_m=0.0, sigma_r_rad=0.0)
    ticks = episode(perfect, 3, n_steps=20)
    assert score(ticks).share == pytest.approx(ticks[-1].truth.cells.share)


def test_a_map_that_is_off_as_a_whole_maps_nothing() -> None:
    tick = episode(CROWDED, 1, n_steps=5)[-1]
    off = tick.truth.poses + np.array([TOLERANCE_M + 0.01, 0.0, 0.0])
    assert map_of(tick, off).share == 0.0
    near = tick.truth.poses + np.array([TOLERANCE_M - 0.01, 0.0, 0.0])
    shifted = map_of(tick, near)
    assert shifted.share == pytest.approx(tick.truth.cells.share)


def test_two_sightings_on_either_side_cancel_and_one_alone_does_not() -> None:
    """The map has a cell at the mean of where its sightings put it."""
    together = scenario_named("paper-hw-2", size_m=1.5, lidar_range_m=1.0)
    tick = episode(together, 0, n_steps=0)[-1]
    apart = tick.truth.poses + np.array([[[0.8, 0.0, 0.0]], [[-0.8, 0.0, 0.0]]])
    assert map_of(tick, apart).share == 1.0
    aside = tick.truth.poses + np.array([[[1.2, 0.0, 0.0]], [[0.0, 0.0, 0.0]]])
    assert map_of(tick, aside).share == 0.0


def test_nothing_is_seen_through_an_obstacle() -> None:
    """A wide box stands between the robot at its left and the cells at its right."""
    box = np.array([[2.0, 0.5], [2.4, 0.5], [2.4, 4.5], [2.0, 4.5]])
    room = Layout(walls_m=room_walls(5.0), obstacles_m=[box], starts=np.array([[1.5, 2.5, 0.0]]))
    cells = reveal(empty_map([room], 5.0), room.starts[:, :2], room.faces_m, range_m=2.2)
    assert cells.seen[0, 1].any()
    assert not cells.seen[0, 3:].any()
    free = reveal(empty_map([room], 5.0), room.starts[:, :2], np.zeros((0, 2, 2)), range_m=2.2)
    assert free.seen[0, 3].any()


def test_the_default_reward_adds_up_to_the_share_that_was_gained() -> None:
    env = parallel_env("paper-sim-2")
    _, infos = env.reset(seed=3)
    first, total = infos["robot_0"]["mapped_share_truth"], 0.0
    rng = np.random.default_rng(0)
    while env.agents:
        walk = {a: rng.uniform(-1.0, 1.0, 3) for a in env.agents}
        _, rewards, _, _, infos = env.step(walk)
        assert rewards["robot_0"] == rewards["robot_1"]
        total += rewards["robot_0"]
    assert first + total == pytest.approx(infos["robot_1"]["mapped_share_truth"])
    assert infos["robot_1"]["mapped_share_truth"] <= infos["robot_1"]["coverage_truth"]


@pytest.mark.parametrize("name", sorted(REWARDS))
def test_every_reward_is_a_number_for_each_robot(name: str) -> None:
    env = parallel_env("paper-hw-2", reward=name)
    env.reset(seed=1)
    for _ in range(4):
        _, rewards, *_ = env.step({a: np.ones(3) for a in env.agents})
        assert rewards.keys() == set(env.agents)
        assert np.isfinite(list(rewards.values())).all()
