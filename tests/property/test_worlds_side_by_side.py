"""What worlds of a batch sense is what each senses alone, to the bit."""

from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wifipgo import se2, segments
from wifipgo.rows import Generators
from wifipgo.world import coverage_belief, sensing
from wifipgo.world.arena import Arena
from wifipgo.world.coverage import CellMap, empty_map, reveal
from wifipgo.world.layout import FAR_FACE_M, ArenaConfig, Layout, padded
from wifipgo.world.lidar import scan
from wifipgo.world.map_accuracy import first_map_accuracy, updated_map_accuracy
from wifipgo.world.placing import random_layout
from wifipgo.world.sensing import SensingConfig

SIZE_M, RANGE_M = 8.0, 2.2


class Batch(NamedTuple):
    """Rooms with other numbers of boxes each, and where their robots were, row by row."""

    layouts: list[Layout]
    history: np.ndarray
    seed: int

    def faces_m(self, world: slice) -> np.ndarray:
        """Edges of obstacles."""
        return padded([layout.faces_m for layout in self.layouts[world]])

    def edges_m(self, world: slice) -> np.ndarray:
        """And the walls."""
        return padded([np.concatenate([one.walls_m, one.faces_m]) for one in self.layouts[world]])

    def rows(self, world: slice) -> slice:
        """Of robots of some worlds."""
        n = len(self.layouts[0].starts)
        return slice(world.start * n, world.stop * n)

    def rng(self, world: slice) -> Generators:
        """Chance of some worlds."""
        return Generators([np.random.default_rng([self.seed, k]) for k in range(world.start, world.stop)])

    @property
    def all(self) -> slice:
        """Of all worlds."""
        return slice(0, len(self.layouts))

    @property
    def each(self) -> list[slice]:
        """One world after the other."""
        return [slice(k, k + 1) for k in range(len(self.layouts))]


def batch_of(seed: int, n_robots: int, boxes: list[int]) -> Batch:
    rng = np.random.default_rng(seed)
    cfgs = [ArenaConfig(size_m=SIZE_M, n_obstacles=n, obstacle_max_m=2.0, clearance_m=0.3) for n in boxes]
    layouts = [random_layout(n_robots, cfg, rng=rng) for cfg in cfgs]
    steps = rng.normal(0.0, 0.4, (7, len(boxes) * n_robots, 3))
    ways = [np.concatenate([layout.starts for layout in layouts])]
    for step in steps:
        ways.append(se2.compose(ways[-1], step))
    return Batch(layouts, np.stack(ways, axis=1), seed)


SEEDS, TEAMS = st.integers(0, 10_000), st.sampled_from([2, 3, 5])
BOXES = st.lists(st.integers(0, 3), min_size=2, max_size=5)


def joined(parts: list[np.ndarray]) -> np.ndarray:
    return np.concatenate(parts)


@settings(max_examples=25)
@given(SEEDS, TEAMS, BOXES)
def test_sensors(seed: int, n_robots: int, boxes: list[int]) -> None:
    """Who is in view, what the camera and the lidar show."""
    batch = batch_of(seed, n_robots, boxes)
    poses = batch.history[:, -1]

    def sensed(world: slice) -> list[np.ndarray]:
        own, faces_m, edges_m = poses[batch.rows(world)], batch.faces_m(world), batch.edges_m(world)
        return [
            sensing.robots_in_view(own, faces_m, range_m=RANGE_M),
            sensing.sight_robots(own, faces_m, range_m=6.0, rng=batch.rng(world)),
            scan(own, edges_m, robot_radius_m=0.15, range_m=4.0),
        ]

    for together, alone in zip(sensed(batch.all), zip(*map(sensed, batch.each), strict=True), strict=True):
        np.testing.assert_array_equal(together, joined(list(alone)))


@pytest.mark.parametrize("noise_scale", [(), (0.5, 1.0, 2.0)])
@settings(max_examples=15)
@given(SEEDS, BOXES)
def test_measurements(noise_scale: tuple[float, ...], seed: int, boxes: list[int]) -> None:
    """Odometry, other robots with outliers among them, and loop closures."""
    batch = batch_of(seed, 3, boxes)
    cfg = SensingConfig(noise_scale=noise_scale, outlier_share=0.4, revisit_gap=2)

    def measured(world: slice) -> list[np.ndarray]:
        rows, faces_m, rng = batch.rows(world), batch.faces_m(world), batch.rng(world)
        history, n_worlds = batch.history[rows], len(range(*world.indices(99)))
        seen = sensing.robots_in_view(history[:, -1], faces_m, range_m=RANGE_M)
        motion = sensing.odometry(history[:, -2], history[:, -1], cfg=cfg, rng=rng, n_worlds=n_worlds)
        others = sensing.observe_robots(history[:, -1], 7, seen, cfg=cfg, rng=rng, outlier_rng=rng)
        places = sensing.measure_loop_closures(history, faces_m, cfg=cfg, rng=rng)
        shift = np.array([rows.start, 0])
        found = [(r.tail + shift, r.head + shift, r.z, r.sigma, r.is_outlier) for r in (others, places)]
        return [motion, *found[0], *found[1]]

    for together, alone in zip(
        measured(batch.all), zip(*map(measured, batch.each), strict=True), strict=True
    ):
        np.testing.assert_array_equal(together, joined(list(alone)))


@settings(max_examples=15)
@given(SEEDS, TEAMS, BOXES)
def test_cells_and_map_accuracy(seed: int, n_robots: int, boxes: list[int]) -> None:
    """What is seen, and how right the map is, from step to step while estimates move in some worlds."""
    batch, rng = batch_of(seed, n_robots, boxes), np.random.default_rng(seed)
    estimate = batch.history + np.cumsum(rng.normal(0.0, 0.2, batch.history.shape), axis=1)
    moved = estimate + 0.1 * (rng.random((len(estimate), 1, 1)) < 0.3)

    def revealed(world: slice, n_times: int) -> CellMap:
        cells = empty_map(batch.layouts[world], SIZE_M)
        for p_m in batch.history[batch.rows(world), :n_times, :2].swapaxes(0, 1):
            cells = reveal(cells, p_m, batch.faces_m(world), range_m=RANGE_M)
        return cells

    def mapped(world: slice) -> list[np.ndarray]:
        rows, before, after = batch.rows(world), revealed(world, 7), revealed(world, 8)
        first = first_map_accuracy(before, batch.history[rows, :7], estimate[rows, :7])
        later = updated_map_accuracy(first, after, batch.history[rows], estimate[rows, :7], moved[rows])
        anew = first_map_accuracy(after, batch.history[rows], moved[rows])
        np.testing.assert_allclose(later.off_m, anew.off_m, atol=1e-9)
        return [after.free, after.seen, after.share, *first, *later]

    for together, alone in zip(mapped(batch.all), zip(*map(mapped, batch.each), strict=True), strict=True):
        np.testing.assert_array_equal(together, joined(list(alone)))


@settings(max_examples=15)
@given(SEEDS, TEAMS, BOXES)
def test_drives(seed: int, n_robots: int, boxes: list[int]) -> None:
    """Robots that jostle in small rooms, some of which need the engine at a step and some not."""
    batch, rng = batch_of(seed, n_robots, boxes), np.random.default_rng(seed)
    cfg = ArenaConfig(size_m=SIZE_M, step_scale=tuple(rng.uniform(0.3, 1.0, n_robots).tolist()))
    together = Arena(batch.layouts, cfg, turn_rad=0.5)
    alone = [Arena([layout], cfg, turn_rad=0.5) for layout in batch.layouts]
    poses = np.concatenate([layout.starts for layout in batch.layouts])
    for waypoints in rng.uniform(-1.0, 1.0, (12, len(poses), 2)):
        parts = [batch.rows(world) for world in batch.each]
        ends = [one.drive(poses[own], waypoints[own]) for one, own in zip(alone, parts, strict=True)]
        drive = together.drive(poses, waypoints)
        np.testing.assert_array_equal(drive.poses, joined([end.poses for end in ends]))
        np.testing.assert_array_equal(drive.bumped, joined([end.bumped for end in ends]))
        poses = drive.poses


def test_shares_of_coverage_beliefs() -> None:
    own = np.random.default_rng(0).random((12, 16, 16), dtype=np.float32)
    survey = coverage_belief.CoverageBelief(own, own)
    parts = [coverage_belief.CoverageBelief(part, part) for part in np.split(own, 4)]
    together = coverage_belief.team_share(survey, 4)
    np.testing.assert_array_equal(together, joined([coverage_belief.team_share(part) for part in parts]))
    np.testing.assert_allclose(together, own.reshape(4, 3, 16, 16).max(axis=1).mean(axis=(1, 2)), rtol=1e-6)


def test_padding_is_behind_every_robot_and_hides_nothing() -> None:
    """It is out of every room, crossed by no way in one, and has a length and a front that looks away."""
    along = FAR_FACE_M[1] - FAR_FACE_M[0]
    p_m = np.random.default_rng(0).uniform(0.0, 2_000.0, (100, 2))
    assert np.hypot(*along) > 0.5
    assert ((p_m - FAR_FACE_M[0]) @ [along[1], -along[0]] < 0.0).all()
    assert segments.in_sight(p_m[:50], p_m[50:], FAR_FACE_M[None]).all()
    faces_m = padded([FAR_FACE_M[None][:0], np.ones((3, 2, 2)), np.ones((1, 2, 2))])
    assert (faces_m[0] == FAR_FACE_M).all()
    assert (faces_m[1] == 1.0).all()


@settings(max_examples=40)
@given(st.integers(0, 10_000), st.integers(1, 3))
def test_own_walls_of_each_ray(seed: int, n_walls: int) -> None:
    rng = np.random.default_rng(seed)
    start_m, end_m = rng.uniform(0.0, 4.0, (2, 20, 2))
    walls_m = rng.uniform(0.0, 4.0, (20, n_walls, 2, 2))
    alone = [segments.crossings(start_m[[k]], end_m[[k]], walls_m[k]) for k in range(20)]
    np.testing.assert_array_equal(segments.crossings(start_m, end_m, walls_m), joined(alone))
    away_m = [segments.distance_to_segments(start_m[[k]], walls_m[k]) for k in range(20)]
    np.testing.assert_array_equal(segments.distance_to_segments(start_m, walls_m), joined(away_m))
