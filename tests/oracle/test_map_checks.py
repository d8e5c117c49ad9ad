"""Obstacle maps and random fields against geometry whose answer is known, or found in another way."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog
from scipy.spatial import ConvexHull

from envs.rendezvous_v0 import parallel_env
from wifipgo.scenarios import scenario_named
from wifipgo.world.layout import ArenaConfig
from wifipgo.world.map_checks import check_apart, floor_of, gap_to_obstacles
from wifipgo.world.placing import random_layout
from wifipgo.world.polygons import area_m2, inside_polygon

Corners = tuple[tuple[float, float], ...]
BOX: Corners = ((2.0, 2.0), (4.0, 2.0), (4.0, 3.0), (2.0, 3.0))
ELL: Corners = ((9, 9), (18, 9), (18, 10), (10, 10), (10, 18), (9, 18))
# Fills the room but for a slit that no robot fits into.
SLIT: Corners = ((0, 0), (20, 0), (20, 20), (10.2, 20), (10.2, 5), (10, 5), (10, 20), (0, 20))
DIVIDER: Corners = ((9.0, 0.0), (11.0, 0.0), (11.0, 20.0), (9.0, 20.0))


def box(x: float, y: float, width: float, height: float) -> Corners:
    right, top = float(x + width), float(y + height)
    return ((float(x), float(y)), (right, float(y)), (right, top), (float(x), top))


def hull(seed: int, n: int) -> Corners:
    """A convex polygon around random points in a 10 m square."""
    points = np.random.default_rng(seed).uniform(0.0, 5.0, (n, 2))
    points += np.random.default_rng(seed + 1).uniform(0.0, 5.0, 2)
    outer = np.asarray(ConvexHull(points).vertices, dtype=int)
    return tuple((float(x), float(y)) for x, y in points[outer])


def deepest_m(a: Corners, b: Corners) -> float:
    """Radius of the largest disc inside both polygons, by linear programming; negative if none."""
    rows, limits = [], []
    for corners in (np.array(a), np.array(b)):
        edge = np.roll(corners, -1, axis=0) - corners
        out = np.stack([edge[:, 1], -edge[:, 0]], axis=1) / np.hypot(*edge.T)[:, None]
        rows += [[*normal, 1.0] for normal in out]
        limits += (out * corners).sum(axis=1).tolist()
    found = linprog([0.0, 0.0, -1.0], A_ub=rows, b_ub=limits, bounds=[(None, None)] * 2 + [(-50.0, None)])
    assert found.x is not None
    return float(found.x[2])


@given(seed=st.integers(0, 10_000), n=st.integers(3, 9))
def test_overlap_is_what_a_linear_program_finds(seed: int, n: int) -> None:
    a, b = hull(seed, n), hull(seed + 20_000, n)
    try:
        check_apart([a, b])
        overlap = False
    except ValueError as problem:
        overlap = "obstacles_m[1] must be clear of ArenaConfig.obstacles_m[0]" in str(problem)
    assert overlap == (deepest_m(a, b) > 1e-9)


@settings(max_examples=25)
@given(seed=st.integers(0, 10_000), n=st.integers(3, 9), turn=st.integers(0, 8))
def test_order_and_first_corner_do_not_matter(seed: int, n: int, turn: int) -> None:
    corners = np.array(hull(seed, n))
    backwards = tuple(map(tuple, np.roll(corners, turn, axis=0)[::-1].tolist()))
    kept = np.array(ArenaConfig(obstacles_m=(backwards,)).obstacles_m[0])
    assert area_m2(kept) == pytest.approx(area_m2(corners))
    assert area_m2(kept) > 0.0
    np.testing.assert_array_equal(np.sort(kept, axis=0), np.sort(corners, axis=0))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"obstacles_m": (BOX, ((1, 1), (2, 1)))}, r"obstacles_m\[1\] must be at least 3"),
        ({"obstacles_m": (((1, 1), (2, 2), (3, 3)),)}, r"obstacles_m\[0\] must be of some area"),
        ({"obstacles_m": (((1, 1), (4, 4), (4, 1), (1, 4)),)}, r"obstacles_m\[0\] .* no edge that crosses"),
        (
            {"obstacles_m": (BOX, ((1, 1), (1, 1), (4, 1), (4, 1)))},
            r"obstacles_m\[1\] must be at least 3 corners",
        ),
        ({"obstacles_m": (BOX, ((5, 5), (9, 5), (9, 9), (7, 5)))}, r"obstacles_m\[1\] .* or touches another"),
        ({"obstacles_m": (BOX, box(19, 5, 2, 1))}, r"obstacles_m\[1\] must be in the room, 0\.\.20 m"),
        ({"obstacles_m": (BOX, box(3, 2.5, 2, 2))}, r"obstacles_m\[1\] must be clear of .*obstacles_m\[0\]"),
        ({"obstacles_m": (BOX, box(2.5, 2.2, 0.5, 0.5))}, r"obstacles_m\[1\] must be clear of"),
        ({"obstacles_m": (BOX, BOX)}, r"obstacles_m\[1\] must be clear of"),
        ({"obstacles_m": (ELL, box(8.5, 15, 1, 1))}, r"obstacles_m\[1\] must be clear of .*obstacles_m\[0\]"),
        (
            {"obstacles_m": (ELL, box(11, 11, 1, 1), ELL)},
            r"obstacles_m\[2\] must be clear of .*obstacles_m\[0\]",
        ),
        (
            {"obstacles_m": (box(0, 0, 20, 20),)},
            r"obstacles_m\[0\] must be small enough to leave a robot room",
        ),
        ({"obstacles_m": (SLIT,)}, r"obstacles_m\[0\] must be small enough to leave a robot room"),
        (
            {"obstacles_m": (((1, 1, 1), (4, 1, 1), (1, 4, 1)),)},
            r"obstacles_m\[0\]\[0\] must be 2 numbers long",
        ),
        ({"obstacles_m": (BOX, 5)}, r"obstacles_m\[1\] must be of type tuple of \(float, float\), got 5"),
        ({"obstacles_m": (((1, 1), (4, np.nan), (1, 4)),)}, r"obstacles_m\[0\]\[1\]\[1\] must be finite"),
        ({"starts": ((1, 1, 0), (3.0, 2.5, 0))}, r"starts\[1\] must be a robot's radius .*obstacles_m\[0\]"),
        ({"starts": ((1, 1, 0), (4.1, 2.5, 0))}, r"starts\[1\] must be a robot's radius .*obstacles_m\[0\]"),
        (
            {"starts": ((11, 11, 0), (9.5, 17, 0)), "obstacles_m": (BOX, ELL)},
            r"starts\[1\] must be a robot's radius .*obstacles_m\[1\]",
        ),
        ({"starts": ((0.1, 1, 0), (6, 6, 0))}, r"starts\[0\] must be a robot's radius inside the room"),
        ({"starts": ((1, 1, 0), (1.2, 1, 0))}, r"starts\[1\] must be two radii .* from .*starts\[0\]"),
        ({"starts": ((1, 1, 0),)}, r"starts must be empty or 2 long"),
        ({"starts": ((1, 1), (5, 5))}, r"starts\[0\] must be 3 numbers long"),
        (
            {"starts": ((1, 1, 0), (15, 1, 0)), "obstacles_m": (DIVIDER,)},
            r"starts\[1\] must be where a robot can drive to from .*starts\[0\]",
        ),
        ({"obstacle_density": 1.0}, r"obstacle_density must be in \[0, 1\), got 1\.0"),
        ({"obstacle_density": 0.1, "n_obstacles": 2}, r"n_obstacles must be 0 beside an obstacle_density"),
        ({"step_scale": (1.0,)}, r"step_scale must be empty or 2 long"),
        ({"step_scale": (1.0, -1.0)}, r"step_scale must be all in 0\.\."),
        ({"step_scale": (1.0, 9.0)}, r"n_substeps must be enough"),
    ],
)
def test_a_map_that_cannot_be_is_refused_by_index(changes: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        scenario_named("paper-hw-2", **({"obstacles_m": (BOX,)} | changes))


def test_a_map_on_every_cell_leaves_nothing_to_see() -> None:
    """A robot fits all round the block, but the middle of no cell is free."""
    starts = ((0.2, 0.2, 0.0), (2.8, 2.8, 0.0))
    env = parallel_env("paper-hw-2", size_m=3, obstacles_m=(box(0.4, 0.4, 2.2, 2.2),), starts=starts)
    with pytest.raises(
        ValueError, match=r"obstacles_m must be such that the middle of a cell of 1 m is free"
    ):
        env.reset(seed=0)


def test_touching_parts_make_a_shape_that_is_not_convex() -> None:
    """An L, one side of it on the wall: robots bump into it for a whole episode and nothing breaks."""
    ell = (box(0.0, 3.0, 3.0, 1.0), box(3.0, 3.0, 1.0, 3.0))
    env = parallel_env("paper-hw-2", size_m=8, obstacles_m=ell, starts=((1, 1, 0), (6, 6, 1.0)), n_steps=60)
    rng = np.random.default_rng(0)
    observations, _ = env.reset(seed=1)
    np.testing.assert_array_equal(env.tick.truth.poses[:, 0], [[1, 1, 0], [6, 6, 1]])
    while env.agents:
        assert all(env.observation_space(a).contains(row) for a, row in observations.items())
        actions = {a: rng.choice([-1.0, 1.0], 3) for a in env.agents}
        observations, *_ = env.step(actions)
    poses = env.tick.truth.poses.reshape(-1, 3)
    assert not any(inside_polygon(poses[:, :2], np.array(corners)).any() for corners in ell)
    assert gap_to_obstacles(poses[:, :2], [np.array(c) for c in ell]).min() > 0.1
    assert env.tick.truth.collisions.min() > 5


def test_a_map_cut_in_two_has_all_starts_in_the_larger_part() -> None:
    cfg = ArenaConfig(obstacles_m=(DIVIDER, box(11.5, 0, 1.0, 20.0)))
    floor = floor_of(cfg.obstacles_m, cfg.size_m, cfg.robot_radius_m)
    parts = floor.part_of(np.array([[1.0, 1.0], [8.0, 19.0], [11.25, 5.0], [10.0, 10.0], [19.0, 1.0]]))
    assert parts[0] == parts[1] == floor.largest
    assert parts[2] not in {parts[0], parts[4]}
    assert parts[3] == 0
    for seed in range(5):
        starts = random_layout(6, cfg, rng=np.random.default_rng(seed)).starts
        assert (starts[:, 0] < 9.0).all()


def test_a_passage_joins_what_it_lets_a_robot_through() -> None:
    """Half a robot wider than the robot is enough, narrower than the robot is not."""
    for width_m, joined in ((0.2, False), (0.29, False), (0.46, True), (1.0, True)):
        halves = (box(9, 0, 2, 7), box(9, 7 + width_m, 2, 13 - width_m))
        floor = floor_of(ArenaConfig(obstacles_m=halves).obstacles_m, 20.0, 0.15)
        west, east = floor.part_of(np.array([[4.0, 4.0], [16.0, 4.0]]))
        assert (west == east) == joined, width_m


@pytest.mark.parametrize("density", [0.01, 0.08, 0.15])
@pytest.mark.parametrize("seed", [0, 1])
def test_a_field_covers_the_share_that_was_asked_for(density: float, seed: int) -> None:
    cfg = ArenaConfig(obstacle_density=density, clearance_m=0.6)
    layout = random_layout(4, cfg, rng=np.random.default_rng(seed))
    p_m = np.random.default_rng(7).uniform(0.0, 20.0, (40_000, 2))
    hit = np.mean([inside_polygon(p_m, corners) for corners in layout.obstacles_m], axis=1).sum()
    assert hit == pytest.approx(density, abs=0.008)  # five standard deviations of the count
    assert sum(map(area_m2, layout.obstacles_m)) == pytest.approx(density * 400.0)
    for k, corners in enumerate(layout.obstacles_m):
        others = [c for j, c in enumerate(layout.obstacles_m) if j != k]
        assert gap_to_obstacles(corners, others).min(initial=np.inf) >= 0.6
        assert corners.min() >= 0.6
        assert corners.max() <= 19.4
    again = random_layout(4, cfg, rng=np.random.default_rng(seed))
    np.testing.assert_array_equal(np.concatenate(again.obstacles_m), np.concatenate(layout.obstacles_m))


def test_a_share_that_does_not_fit_says_how_much_does() -> None:
    with pytest.raises(ValueError, match=r"obstacle_density must be at most .* \(covered 0\.\d+\), got 0\.6"):
        random_layout(2, ArenaConfig(size_m=8.0, obstacle_density=0.6), rng=np.random.default_rng(0))


def test_random_boxes_keep_clear_of_what_is_placed_by_hand() -> None:
    starts = ((1.0, 1.0, 0.0), (10.0, 10.0, 0.0))
    cfg = ArenaConfig(obstacles_m=(BOX,), starts=starts, n_obstacles=8)
    for seed in range(5):
        first, *rest = random_layout(2, cfg, rng=np.random.default_rng(seed)).obstacles_m
        np.testing.assert_array_equal(first, BOX)
        assert len(rest) == 8
        assert (
            min(
                gap_to_obstacles(np.array(BOX), rest).min(),
                *(gap_to_obstacles(r, [first]).min() for r in rest),
            )
            >= 1.0
        )
        assert gap_to_obstacles(np.array(starts)[:, :2], rest).min() > 0.3


def test_each_robot_has_its_step() -> None:
    env = parallel_env("paper-hw-2", step_scale=(0.5, 1.0), starts=((5, 5, 0), (15, 15, 0)))
    env.reset(seed=0)
    env.step({a: np.array([1.0, 0.0, -1.0]) for a in env.agents})
    moved = np.diff(env.tick.truth.poses[:, :, 0], axis=1)[:, 0]
    np.testing.assert_allclose(moved, [1.0, 2.0], atol=1e-6)
