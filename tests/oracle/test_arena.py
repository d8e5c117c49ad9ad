"""Driving and bumping in rooms whose answer is known."""

import pickle

import numpy as np
import pytest

from wifipgo import se2
from wifipgo.world.arena import Arena
from wifipgo.world.contacts import Contacts
from wifipgo.world.layout import ArenaConfig, Layout, room_walls
from wifipgo.world.map_checks import gap_to_obstacles
from wifipgo.world.placing import random_layout

CFG, TURN_RAD = ArenaConfig(size_m=10.0), np.pi / 2.0
BOX = np.array([[4.0, 4.0], [6.0, 4.0], [6.0, 6.0], [4.0, 6.0]])


def arena(*starts: tuple[float, float, float], box: bool = False) -> tuple[Arena, np.ndarray]:
    poses = np.array(starts)
    layout = Layout(walls_m=room_walls(10.0), obstacles_m=[BOX] if box else [], starts=poses)
    return Arena([layout], CFG, turn_rad=TURN_RAD), poses


def test_free_drive_arrives_and_turns() -> None:
    room, poses = arena((2.0, 2.0, 0.5))
    drive = room.drive(poses, np.array([[0.0, 1.0]]))
    expected = [2.0 - 2.0 * np.sin(0.5), 2.0 + 2.0 * np.cos(0.5)]
    np.testing.assert_allclose(drive.poses[0, :2], expected, atol=1e-6)
    turned = 0.5 + np.pi / 2.0 + TURN_RAD  # faced the waypoint, then a quarter turn
    assert np.cos(drive.poses[0, 2] - turned) == pytest.approx(1.0)
    assert not drive.bumped[0]


def test_a_waypoint_beyond_one_step_is_cut() -> None:
    room, poses = arena((2.0, 2.0, 0.0))
    drive = room.drive(poses, np.array([[1.0, 1.0]]))
    assert np.hypot(*(drive.poses[0, :2] - 2.0)) == pytest.approx(CFG.step_m, abs=1e-6)


def test_standing_still_keeps_place_and_turns_only() -> None:
    room, poses = arena((5.0, 5.0, 0.3))
    drive = room.drive(poses, np.zeros((1, 2)))
    np.testing.assert_allclose(drive.poses[0], [5.0, 5.0, 0.3 + TURN_RAD], atol=1e-9)


def test_walls_and_boxes_stop_a_robot() -> None:
    room, poses = arena((9.5, 2.0, 0.0), (3.0, 5.0, 0.0), box=True)
    drive = room.drive(poses, np.array([[1.0, 0.0], [1.0, 0.0]]))
    assert drive.bumped.all()
    np.testing.assert_allclose(
        drive.poses[:, 0], [10.0 - CFG.robot_radius_m, 4.0 - CFG.robot_radius_m], atol=0.02
    )


def test_robots_stop_each_other() -> None:
    room, poses = arena((4.0, 5.0, 0.0), (6.0, 5.0, np.pi))
    drive = room.drive(poses, np.array([[1.0, 0.0], [1.0, 0.0]]))
    gap_m = np.linalg.norm(drive.poses[0, :2] - drive.poses[1, :2])
    assert gap_m == pytest.approx(2.0 * CFG.robot_radius_m, abs=0.02)
    assert drive.bumped.all()


def test_nobody_leaves_the_room() -> None:
    rng = np.random.default_rng(0)
    cfg = ArenaConfig(size_m=8.0, n_obstacles=2)
    layout = random_layout(12, cfg, rng=rng)
    room, poses = Arena([layout], cfg, turn_rad=TURN_RAD), layout.starts
    for _ in range(60):
        poses = room.drive(poses, rng.uniform(-1.0, 1.0, (12, 2))).poses
        assert poses[:, :2].min() > 0.1
        assert poses[:, :2].max() < 7.9


def test_layout_that_does_not_fit_says_what_is_too_many() -> None:
    with pytest.raises(ValueError, match=r"ArenaConfig.n_obstacles must be at most .* got 60"):
        random_layout(2, ArenaConfig(size_m=10.0, n_obstacles=60), rng=np.random.default_rng(0))
    with pytest.raises(ValueError, match=r"n_robots must be at most .* got 500"):
        random_layout(500, ArenaConfig(size_m=5.0), rng=np.random.default_rng(0))


def test_a_crowd_that_fits_is_placed() -> None:
    """Discs thrown at random fill 0.547 of a plane; with the distance they keep, these fill 0.42."""
    starts = random_layout(1000, ArenaConfig(size_m=26.6), rng=np.random.default_rng(0)).starts
    apart_m = np.linalg.norm(starts[:, None, :2] - starts[None, :, :2], axis=-1)
    assert apart_m[~np.eye(1000, dtype=bool)].min() > 4.0 * ArenaConfig().robot_radius_m


def least_gap_m(layout: Layout, target_m: np.ndarray) -> np.ndarray:
    """How near each robot's hull comes to anything if all drive straight at once, looked up 200 times."""
    start_m, radius_m = layout.starts[:, :2], CFG.robot_radius_m
    p_m = start_m + np.linspace(0.0, 1.0, 200)[:, None, None] * (target_m - start_m)
    wall_m = np.minimum(p_m, layout.walls_m.max() - p_m).min(axis=2)
    box_m = gap_to_obstacles(p_m.reshape(-1, 2), layout.obstacles_m).reshape(wall_m.shape)
    apart_m = np.linalg.norm(p_m[:, :, None] - p_m[:, None], axis=-1) - radius_m
    apart_m[:, np.eye(len(start_m), dtype=bool)] = np.inf
    return np.min([wall_m, box_m, apart_m.min(axis=2)], axis=(0, 1)) - radius_m


def test_the_engine_is_asked_where_it_says_something_else_than_straight_on(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Whoever touches nothing ends where the engine would take it; a touch by more than rounding needs it."""
    rng, cfg, counts = np.random.default_rng(0), ArenaConfig(size_m=12.0, n_obstacles=2), np.zeros(3, int)
    everybody, sees = lambda *_: np.ones(5, dtype=bool), Contacts.may_touch
    for _ in range(100):
        layout, waypoints = random_layout(5, cfg, rng=rng), rng.uniform(-0.7, 0.7, (5, 2))
        quick = Arena([layout], cfg, turn_rad=TURN_RAD).drive(layout.starts, waypoints)
        with monkeypatch.context() as patch:
            patch.setattr(Contacts, "may_touch", everybody)
            careful = Arena([layout], cfg, turn_rad=TURN_RAD).drive(layout.starts, waypoints)
        np.testing.assert_allclose(quick.poses, careful.poses, rtol=0.0, atol=1e-9)
        np.testing.assert_array_equal(quick.bumped, careful.bumped)
        target_m = se2.apply(layout.starts, cfg.step_m * waypoints)
        asked = sees(Contacts([layout], radius_m=0.15, longest_m=2.0), layout.starts[:, :2], target_m)
        gap_m = least_gap_m(layout, target_m)
        strays = np.abs(careful.poses[:, :2] - target_m).max(axis=1) > 1e-9
        assert asked[gap_m < -1e-9].all()
        assert not strays[~asked].any()
        if gap_m.min() > 1e-3:  # between two looks it may come a little nearer
            assert not asked.any()
        counts += [strays.sum(), (asked & ~strays).sum(), (~asked).sum()]
    assert counts[2] > 300
    assert counts[0] > 60
    assert counts[1] < 80  # robots in reach of a bump, and those pushed aside that arrive all the same


def test_a_robot_inside_an_obstacle_is_taken_out_by_the_engine() -> None:
    """Deep inside, further from all edges than a robot is wide."""
    room, poses = arena((5.0, 5.5, 0.0), box=True)
    end = room.drive(poses, np.zeros((1, 2))).poses[0]
    assert end[1] > 6.0


@pytest.mark.parametrize("seed", range(4))
def test_a_drive_depends_on_its_arguments_alone(seed: int) -> None:
    """Twelve robots jostle in a small room: contacts of one drive must not be felt in another."""
    rng, cfg = np.random.default_rng(seed), ArenaConfig(size_m=5.0, n_obstacles=1)
    layout = random_layout(12, cfg, rng=rng)
    room, poses = Arena([layout], cfg, turn_rad=TURN_RAD), [layout.starts]
    waypoints = rng.uniform(-1.0, 1.0, (30, 12, 2))
    for one in waypoints:
        poses.append(room.drive(poses[-1], one).poses)
    travelled = pickle.loads(pickle.dumps(room))
    for k in rng.permutation(30).tolist():
        for again in (room, travelled):
            np.testing.assert_array_equal(again.drive(poses[k], waypoints[k]).poses, poses[k + 1])


@pytest.mark.parametrize("n_substeps", [1, 2, 3, 5, 7, 18])
def test_any_number_of_substeps_arrives(n_substeps: int) -> None:
    """So near to another that the way is driven in substeps, and still a way that nobody blocks."""
    starts = np.array([(2.0, 2.0, 0.0), (2.0, 2.31, 0.0)])
    layout = Layout(walls_m=room_walls(10.0), obstacles_m=[], starts=starts)
    cfg = ArenaConfig(size_m=10.0, step_m=0.14, n_substeps=n_substeps)
    drive = Arena([layout], cfg, turn_rad=TURN_RAD).drive(starts, np.array([[1.0, 0.0], [1.0, 0.0]]))
    np.testing.assert_allclose(drive.poses[:, :2] - starts[:, :2], [[0.14, 0.0]] * 2, atol=1e-6)
    assert not drive.bumped.any()
