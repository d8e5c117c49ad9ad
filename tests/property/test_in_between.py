"""Pictures between two iterations: robots move evenly from one to the next, and nothing is known early."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from baselines.evaluation.episodes import run_episode
from baselines.film.reel import FASTEST, pictures_an_iteration, together
from envs.render.config import RenderConfig
from envs.render.in_between import in_between
from envs.render.scene import Scene, scene_of
from envs.render.viewer import Viewer
from wifipgo.scenarios import scenario_named
from wifipgo.se2 import wrap_angle
from wifipgo.state import Tick, World

SCENARIO = scenario_named("paper-hw-2-obstacles", n_steps=26)
N = 3


@pytest.fixture(scope="module")
def played() -> tuple[list[Scene], World]:
    """Scenes of an episode with a rendezvous."""
    scenes: list[Scene] = []
    worlds: list[World] = []

    def look(tick: Tick, world: World) -> None:
        scenes.append(scene_of(tick, SCENARIO))
        worlds.append(world)

    run_episode(SCENARIO, "active", 0, on_tick=look)
    assert any(scene.met for scene in scenes)
    return scenes, worlds[0]


def test_robots_drive_evenly(played: tuple[list[Scene], World]) -> None:
    """Positions are on the line from pose to pose, in equal steps, and turns take the shorter way."""
    scenes, _ = played
    for before, after in pairwise(scenes):
        way = [before, *in_between(before, after, N), after]
        poses = np.array([scene.true[:, -1] for scene in way])
        steps = np.diff(poses, axis=0)
        turns_rad = wrap_angle(steps[..., 2])
        np.testing.assert_allclose(
            steps[..., :2], np.broadcast_to(steps[:1, :, :2], steps[..., :2].shape), atol=1e-9
        )
        np.testing.assert_allclose(
            turns_rad.sum(axis=0), wrap_angle(after.true[:, -1, 2] - before.true[:, -1, 2])
        )
        assert np.abs(turns_rad).max() <= np.pi / (N + 1) + 1e-9


def test_nothing_is_known_early(played: tuple[list[Scene], World]) -> None:
    """Paths, calls, meetings and Err are those of the iteration before; what is corrected shows then."""
    scenes, _ = played
    for before, after in pairwise(scenes):
        for scene in in_between(before, after, N):
            np.testing.assert_array_equal(scene.true[:, :-1], before.true)
            np.testing.assert_array_equal(scene.estimate[:, :-1], before.estimate)
            assert (scene.met, scene.t) == (before.met, before.t)
            assert scene.calls is before.calls
            assert scene.err_share is before.err_share


def test_belief_arrives_where_nobody_corrected_it(played: tuple[list[Scene], World]) -> None:
    scenes, _ = played
    pairs = list(pairwise(scenes))
    plain = [(a, b) for a, b in pairs if np.array_equal(a.estimate, b.estimate[:, :-1])]
    assert 0 < len(plain) < len(pairs)
    for before, after in plain:
        poses = np.array([s.estimate[:, -1, :2] for s in [before, *in_between(before, after, N), after]])
        np.testing.assert_allclose(np.diff(poses, n=2, axis=0), 0.0, atol=1e-9)


def test_a_film_through_all_scenes_is_each_drawn_alone(played: tuple[list[Scene], World]) -> None:
    scenes, world = played
    used = Viewer(RenderConfig(height_px=320))
    for before, after in pairwise(scenes[8:13]):
        for scene in [before, *in_between(before, after, 1)]:
            frame = used.frame_of(scene, world, SCENARIO)
            fresh = Viewer(RenderConfig(height_px=320)).frame_of(scene, world, SCENARIO)
            np.testing.assert_array_equal(frame, fresh)


def test_a_second_has_room_for_so_many_pictures() -> None:
    assert pictures_an_iteration(3, 5) == 4
    assert pictures_an_iteration(0, 5) == 1
    assert all(fps * pictures_an_iteration(9, fps) <= max(FASTEST, fps) for fps in range(1, 101))


def test_who_ended_early_stands_still(played: tuple[list[Scene], World]) -> None:
    scenes, _ = played
    long, short = scenes[:3], [replace(scenes[0], t=7)]
    assert [[a.t, b.t] for a, b in together([long, short])] == [[0, 7], [1, 7], [2, 7]]
