"""A picture is a function of the tick alone, and what it shows is where it belongs."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from baselines.evaluation.episodes import run_episode
from envs.render.config import RenderConfig
from envs.render.scene import SIGMAS_95, Camera, lobes, rings, scene_of
from envs.render.viewer import Viewer
from wifipgo.command import palette
from wifipgo.rendezvous import NOBODY
from wifipgo.scenarios import Scenario, scenario_named
from wifipgo.state import Tick, World

HEIGHT_PX = 608
SCENARIO = scenario_named("paper-hw-2-obstacles", n_steps=26)
TEAM = scenario_named("paper-sim-50", n_robots=12, size_m=30.0, n_steps=8, sigma_t_m=0.6, sensor_range_m=1.2)


def episode(scenario: Scenario, seed: int) -> tuple[list[Tick], World]:
    """Every tick of an episode of the active policy."""
    ticks: list[Tick] = []
    worlds: list[World] = []

    def keep(tick: Tick, world: World) -> None:
        ticks.append(tick)
        worlds.append(world)

    run_episode(scenario, "active", seed, on_tick=keep)
    return ticks, worlds[0]


@pytest.fixture(scope="module")
def played() -> tuple[list[Tick], World]:
    """An episode with calls and a rendezvous."""
    ticks, world = episode(SCENARIO, 0)
    assert any(tick.belief.team.met for tick in ticks)
    assert any((tick.belief.team.calls.callee != NOBODY).any() for tick in ticks)
    return ticks, world


def arena_camera(scenario: Scenario, height_px: int = HEIGHT_PX) -> Camera:
    """Where the room lies on a picture: the margin of 4.5 % is on all sides."""
    return Camera.on_square(height_px, scenario.arena.size_m, margin_px=0.045 * height_px)


def near(frame: np.ndarray, colour: palette.Colour, *, within: int = 12) -> np.ndarray:
    """Which pixels have a colour, but for smoothed edges."""
    return (np.abs(frame.astype(int) - np.array(colour)) <= within).all(axis=-1)


@pytest.mark.parametrize("scenario", [SCENARIO, TEAM], ids=lambda scenario: scenario.name)
def test_order_of_drawing_does_not_matter(scenario: Scenario) -> None:
    """One viewer that draws forwards, backwards and two worlds in turn draws as new viewers do."""
    ticks, world = episode(scenario, 0)
    others, other_world = episode(scenario, 1)
    some = list(range(0, len(ticks), max(len(ticks) // 4, 1)))
    fresh = {t: Viewer().frame(ticks[t], world, scenario) for t in some}
    used = Viewer()
    for tick in ticks:
        frame = used.frame(tick, world, scenario)
        if tick.belief.t in fresh:
            np.testing.assert_array_equal(frame, fresh[tick.belief.t])
    for t in some[::-1]:
        np.testing.assert_array_equal(used.frame(ticks[t], world, scenario), fresh[t])
        used.frame(others[t], other_world, scenario)


def test_pictures_are_arrays_of_their_own(played: tuple[list[Tick], World]) -> None:
    ticks, world = played
    viewer = Viewer()
    first = viewer.frame(ticks[0], world, SCENARIO)
    kept = first.copy()
    viewer.frame(ticks[-1], world, SCENARIO)
    np.testing.assert_array_equal(first, kept)


@pytest.mark.parametrize("height_px", [320, 608, 1024])
def test_robots_and_obstacles_are_where_they_are(played: tuple[list[Tick], World], height_px: int) -> None:
    """In a picture, y grows downwards and the room's corner (0, 0) is at the bottom left."""
    ticks, world = played
    frame = Viewer(RenderConfig(height_px=height_px)).frame(ticks[5], world, SCENARIO)
    camera = arena_camera(SCENARIO, height_px)
    for robot, pose in enumerate(ticks[5].truth.poses[:, -1]):
        x, y = np.rint(camera.px(pose[:2])).astype(int)
        assert near(frame[y - 1 : y + 2, x - 1 : x + 2], palette.robot_colour(robot)).all()
    for corners in world.layout.obstacles_m:
        x, y = np.rint(camera.px(corners.mean(axis=0))).astype(int)
        assert near(frame[y, x], palette.OBSTACLE)
    assert camera.px(np.zeros(2)) == pytest.approx([0.045 * height_px, 0.955 * height_px])


def test_seen_floor_is_bright(played: tuple[list[Tick], World]) -> None:
    """Pixels of bright floor grow with the cells that were seen."""
    ticks, world = played
    bright = [
        near(Viewer().frame(ticks[t], world, SCENARIO)[:, :HEIGHT_PX], palette.SEEN).sum()
        for t in (0, 10, 26)
    ]
    assert bright[0] < bright[1] < bright[2]


def test_bars_cross_the_threshold_when_err_does(played: tuple[list[Tick], World]) -> None:
    """The bar of Err ends at a third of its groove where Err is at the threshold."""
    ticks, world = played
    tick = ticks[3]
    lengths = []
    for share in (0.5, 1.0, 2.0, 50.0):
        err = np.array([share * SCENARIO.rendezvous.err_threshold, 0.0])
        frame = Viewer().frame(tick._replace(belief=tick.belief._replace(err=err)), world, SCENARIO)
        row = near(frame[185, HEIGHT_PX:], palette.robot_colour(0))
        lengths.append(int(row.sum()))
    assert lengths[1] == pytest.approx(160 / 3, abs=3.0)  # the line of the threshold hides two pixels
    assert lengths[0] == pytest.approx(lengths[1] / 2, abs=3.0)
    assert lengths[2] == pytest.approx(2 * lengths[1], abs=5.0)
    assert lengths[3] == pytest.approx(160, abs=5.0)  # cut, not drawn over the figures


def test_bars_that_are_cut_are_broken(played: tuple[list[Tick], World]) -> None:
    """A bar that ends at the end of its groove is whole; a longer one has a gap before it."""
    ticks, world = played
    gaps = []
    tick = ticks[3]
    for share in (3.0, 3.1):
        err = np.array([share * SCENARIO.rendezvous.err_threshold, 0.0])
        drawn = tick._replace(belief=tick.belief._replace(err=err))
        row = Viewer().frame(drawn, world, SCENARIO)[185, HEIGHT_PX + 120 : HEIGHT_PX + 174]
        gaps.append(int(near(row, palette.PAPER).sum()))
    assert gaps == [0, 2]


def test_a_lobe_points_at_the_caller_in_an_empty_room() -> None:
    """Line of sight and nothing in it: the direction of the longest ray is the direction of the caller."""
    scenario = scenario_named("paper-hw-2", n_steps=30, sigma_t_m=0.5)
    ticks, _ = episode(scenario, 2)
    off_rad = []
    for tick in ticks:
        scene = scene_of(tick, scenario)
        for (caller, callee), lobe in zip(scene.calls.tolist(), scene.lobes, strict=True):
            ahead = lobe[np.hypot(*lobe.T).argmax()]
            there = scene.true[caller, -1, :2] - scene.true[callee, -1, :2]
            cross, dot = ahead[0] * there[1] - ahead[1] * there[0], ahead @ there
            off_rad.append(abs(np.arctan2(cross, dot)))
    assert len(off_rad) > 5
    assert np.median(off_rad) < np.deg2rad(8.0)  # bins are 5 degrees wide


def test_links_are_those_that_robots_listen_to(played: tuple[list[Tick], World]) -> None:
    ticks, _ = episode(TEAM, 3)
    scene, belief = scene_of(ticks[-1], TEAM), ticks[-1].belief
    listens = {
        tuple(sorted((i, int(j)))) for i, row in enumerate(belief.radio.slots) for j in row if j != NOBODY
    }
    assert {tuple(pair) for pair in scene.pairs.tolist()} == listens
    assert ((scene.rate_share > 0.0) & (scene.rate_share <= 1.0)).all()


@given(st.floats(-np.pi, np.pi), st.integers(0, 71))
def test_lobes_turn_with_the_robot(yaw_rad: float, place: int) -> None:
    """A profile with one ray points where body azimuth and heading add up to."""
    profile = np.zeros((1, 72))
    profile[0, place] = 3.0
    outline = lobes(profile, np.array([yaw_rad]))[0]
    tip = outline[np.hypot(*outline.T).argmax()]
    expected_rad = yaw_rad - np.pi + 2.0 * np.pi * (place + 0.5) / 72.0
    np.testing.assert_allclose(tip, [np.cos(expected_rad), np.sin(expected_rad)], atol=1e-12)
    assert (np.hypot(*outline.T) > 1e-12).sum() == 1


def test_covariances_become_regions_of_95_percent() -> None:
    """Of draws from a Gaussian, 95 % lie within the region drawn for its covariance."""
    covariance_m2 = np.array([[[2.0, 1.1], [1.1, 0.9]]])
    ring_m = rings(np.zeros((1, 2)), covariance_m2)[0]
    squares = np.einsum("ki,ij,kj->k", ring_m, np.linalg.inv(covariance_m2[0]), ring_m)
    np.testing.assert_allclose(squares, SIGMAS_95**2, rtol=1e-9)
    draws_m = np.random.default_rng(0).multivariate_normal(np.zeros(2), covariance_m2[0], 20_000)
    distance = np.einsum("ki,ij,kj->k", draws_m, np.linalg.inv(covariance_m2[0]), draws_m)
    assert (distance < squares.mean()).mean() == pytest.approx(0.95, abs=0.006)
