"""Obstacles of any shape, in every sense that a robot has: what lies in a notch is outside."""

import numpy as np
import pytest
from support.polyominoes import Cell, grown, outline, solid

from envs.rendezvous_v0 import parallel_env
from wifipgo.radio.propagation.materials import SPEED_OF_LIGHT_M_S, Slab
from wifipgo.radio.propagation.paths import surfaces_of, trace_paths
from wifipgo.segments import in_sight
from wifipgo.world.arena import Arena
from wifipgo.world.coverage import empty_map
from wifipgo.world.layout import ArenaConfig, Layout, room_walls
from wifipgo.world.lidar import ray_directions, scan
from wifipgo.world.map_checks import floor_of, gap_to_obstacles
from wifipgo.world.placing import random_layout

SIZE_M, RADIUS_M, RANGE_M = 10.0, 0.15, 4.0
# Open to the right, its notch 1 m wide and 3 m deep.
CUP = ((3.0, 3.0), (7.0, 3.0), (7.0, 4.0), (4.0, 4.0), (4.0, 5.0), (7.0, 5.0), (7.0, 6.0), (3.0, 6.0))


def shape(seed: int, n_cells: int = 16) -> tuple[set[Cell], ArenaConfig]:
    """Cells of an obstacle of squares in the middle of a room, and the room."""
    cells = {(x + 2, y + 2) for x, y in grown(np.random.default_rng(seed), n_cells, 6)}
    return cells, ArenaConfig(size_m=SIZE_M, obstacles_m=(outline(cells),))


def drive(cfg: ArenaConfig, start: tuple[float, float, float], n_steps: int) -> tuple[np.ndarray, bool]:
    """A robot alone drives ahead; where it ends and whether its last drive was cut short."""
    poses = np.array([start])
    arena = Arena([random_layout(1, cfg, rng=np.random.default_rng(0))], cfg, turn_rad=2.0 * np.pi)
    for _ in range(n_steps):
        end = arena.drive(poses, np.array([[1.0, 0.0]]))
        poses = end.poses
    return poses[0, :2], bool(end.bumped[0])


def test_a_robot_drives_into_a_notch_up_to_its_back_wall() -> None:
    start = (9.0, 4.5, np.pi)
    cfg = ArenaConfig(size_m=SIZE_M, obstacles_m=(CUP,), starts=(start,))
    place_m, bumped = drive(cfg, start, 4)
    assert bumped
    np.testing.assert_allclose(place_m, [4.0 + RADIUS_M, 4.5], atol=0.01)


def test_a_robot_is_stopped_by_the_back_of_a_cup() -> None:
    start = (1.0, 4.5, 0.0)
    cfg = ArenaConfig(size_m=SIZE_M, obstacles_m=(CUP[::-1],), starts=(start,))
    place_m, bumped = drive(cfg, start, 4)
    assert bumped
    np.testing.assert_allclose(place_m, [3.0 - RADIUS_M, 4.5], atol=0.01)


@pytest.mark.parametrize("seed", range(6))
def test_nobody_drives_into_what_is_solid(seed: int) -> None:
    rng, (cells, cfg) = np.random.default_rng(seed), shape(seed)
    layout = random_layout(8, cfg, rng=rng)
    arena, poses = Arena([layout], cfg, turn_rad=0.5), layout.starts
    assert not solid(poses[:, :2], cells).any()
    n_bumps = 0
    for _ in range(40):
        poses, bumped = arena.drive(poses, rng.choice([-1.0, 0.0, 1.0], (8, 2)))
        n_bumps += int(bumped.sum())
        around = poses[:, None, :2] + 0.9 * RADIUS_M * np.array([[0, 1], [1, 0], [0, -1], [-1, 0]])
        assert not solid(around.reshape(-1, 2), cells).any()
    assert n_bumps > 20


@pytest.mark.parametrize("seed", range(6))
def test_lidar_sees_as_far_as_a_march_through_the_cells(seed: int) -> None:
    """All that a ray passes is free, and what it ends at is not."""
    cells, cfg = shape(seed)
    layout = random_layout(12, cfg, rng=np.random.default_rng(seed))
    edges_m = np.concatenate([layout.walls_m, layout.faces_m])
    n_hits = 0
    for pose in layout.starts:
        (free_m,) = scan(pose[None], edges_m, robot_radius_m=RADIUS_M, range_m=RANGE_M)
        for along, away_m in zip(ray_directions(pose[2:])[0], free_m, strict=True):
            march_m = np.append(np.arange(0.0, away_m - 1e-6, 0.01), away_m + 1e-6)
            blocked = stands(pose[:2] + (RADIUS_M + 1e-3 + march_m[:, None]) * along, cells)
            assert not blocked[:-1].any()
            assert blocked[-1] == (away_m < RANGE_M)
            n_hits += bool(blocked[-1])
    assert n_hits > 60


def stands(p_m: np.ndarray, cells: set[Cell]) -> np.ndarray:
    """Whether something stands at points: the obstacle, or what is outside the room."""
    return solid(p_m, cells) | (p_m < 0.0).any(axis=1) | (p_m > SIZE_M).any(axis=1)


@pytest.mark.parametrize("seed", range(6))
def test_sight_is_a_straight_way_through_free_cells(seed: int) -> None:
    cells, cfg = shape(seed)
    layout = random_layout(20, cfg, rng=np.random.default_rng(seed))
    start_m, end_m = np.split(layout.starts[:, :2], 2)
    share = np.linspace(0.0, 1.0, 5001)[:, None]
    clear = [not solid(a + share * (b - a), cells).any() for a, b in zip(start_m, end_m, strict=True)]
    assert in_sight(start_m, end_m, layout.faces_m).tolist() == clear


@pytest.mark.parametrize("seed", range(6))
def test_floor_and_cells_to_see_are_those_that_are_left(seed: int) -> None:
    cells, cfg = shape(seed)
    free = empty_map([random_layout(2, cfg, rng=np.random.default_rng(0))], SIZE_M).free[0]
    assert {tuple(cell) for cell in np.argwhere(~free).tolist()} == cells
    rng = np.random.default_rng(seed)
    p_m = rng.uniform(0.5, SIZE_M - 0.5, (300, 2))
    gap_m = gap_to_obstacles(p_m, [np.array(outline(cells))])
    corners = np.array(sorted(cells))
    to_cells_m = np.hypot(*np.maximum(np.abs(p_m[:, None] - corners - 0.5) - 0.5, 0.0).T).min(axis=0)
    np.testing.assert_allclose(gap_m, to_cells_m, atol=1e-12)


def test_a_notch_hangs_together_with_the_room_unless_its_mouth_is_closed() -> None:
    """A lid that touches the cup makes a ring: two parts of floor, and all starts in the larger."""
    lid = ((7.0, 3.0), (8.0, 3.0), (8.0, 6.0), (7.0, 6.0))
    notch_and_room = np.array([[5.5, 4.5], [1.0, 1.0]])
    for obstacles_m, joined in (((CUP,), True), ((CUP, lid), False)):
        cfg = ArenaConfig(size_m=SIZE_M, obstacles_m=obstacles_m)
        a, b = floor_of(cfg.obstacles_m, SIZE_M, RADIUS_M).part_of(notch_and_room)
        assert (a == b) == joined
        starts_m = random_layout(30, cfg, rng=np.random.default_rng(1)).starts[:, :2]
        in_notch = (starts_m > [4.0, 4.0]).all(axis=1) & (starts_m < [7.0, 5.0]).all(axis=1)
        assert not in_notch.any() or joined


def test_echoes_in_a_notch_are_those_of_three_mirrors() -> None:
    """Both ends in the cup, nothing but its inner faces near: back wall and sides, each a mirror."""
    tx_m, rx_m = np.array([[5.0, 4.3]]), np.array([[6.0, 4.8]])
    far = room_walls(200.0) - 100.0
    surfaces = surfaces_of(far, [np.array(CUP)], carrier_hz=5e9, wall=Slab(), obstacle=Slab())
    paths = trace_paths(tx_m, rx_m, surfaces, carrier_hz=5e9, max_order=1, penetration=False)
    length_m = paths.delay_s[0, paths.order[0] == 1] * SPEED_OF_LIGHT_M_S
    back, below, above = np.hypot(3.0, 0.5), np.hypot(1.0, 1.1), np.hypot(1.0, 0.9)
    near_m = np.sort(length_m[length_m < 50.0])
    np.testing.assert_allclose(near_m, sorted([back, below, above]))


def test_nothing_is_heard_through_a_cup_that_lets_nothing_through() -> None:
    """One robot in the notch, one behind the back wall: every straight way and echo is cut."""
    tx_m, rx_m = np.array([[4.5, 4.5]]), np.array([[2.5, 4.5]])
    far = room_walls(200.0) - 100.0
    surfaces = surfaces_of(far, [np.array(CUP)], carrier_hz=5e9, wall=Slab(), obstacle=Slab())
    paths = trace_paths(tx_m, rx_m, surfaces, carrier_hz=5e9, max_order=1, penetration=False)
    assert not (paths.order == 0).any()
    assert paths.delay_s[paths.order == 1].min(initial=np.inf) * SPEED_OF_LIGHT_M_S > 100.0


def test_an_episode_beside_a_cup() -> None:
    """The whole environment: a robot starts in the notch, and Layout and observations hold."""
    starts = ((5.0, 4.5, 0.0), (1.0, 1.0, 0.0))
    env = parallel_env("paper-hw-2", size_m=SIZE_M, obstacles_m=(CUP,), starts=starts, n_steps=30)
    observations, _ = env.reset(seed=2)
    layout: Layout = env.world.layout
    np.testing.assert_array_equal(layout.obstacles_m[0], CUP)
    rng = np.random.default_rng(0)
    while env.agents:
        assert all(env.observation_space(a).contains(row) for a, row in observations.items())
        observations, *_ = env.step({a: rng.uniform(-1.0, 1.0, 3) for a in env.agents})
    assert gap_to_obstacles(env.tick.truth.poses.reshape(-1, 3)[:, :2], [np.array(CUP)]).min() > 0.1
