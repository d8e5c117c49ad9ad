"""Render modes keep their word: headless arrays, a window, nothing of pygame before it is asked for."""

import importlib.util
import subprocess
import sys
import types
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gymnasium.error import DependencyNotInstalled
from pettingzoo.test import render_test
from support.small_teams import KINDS

from envs import rendezvous_v0


@pytest.fixture
def window(monkeypatch: pytest.MonkeyPatch) -> None:
    """A window that nobody sees and that does not wait."""
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    monkeypatch.setitem(rendezvous_v0.RendezvousEnv.metadata, "render_fps", 1000)


def fresh_process(code: str) -> str:
    """What a program prints in a process of its own, without a display."""
    environment = {"PATH": "", "PYTHONPATH": ":".join(sys.path)}
    run = subprocess.run(
        [sys.executable, "-W", "error", "-c", code],
        capture_output=True,
        text=True,
        check=False,
        env=environment,
    )
    assert run.returncode == 0, run.stderr
    return run.stdout.strip()


def actions(env: rendezvous_v0.RendezvousEnv) -> dict[str, np.ndarray]:
    return {agent: np.array([0.5, 0.5, 1.0], np.float32) for agent in env.agents}


@pytest.mark.usefixtures("window")
@pytest.mark.parametrize("observation", ["flat", "dict"])
@pytest.mark.parametrize("scenario", KINDS)
def test_pettingzoo_accepts_every_mode(scenario: str, observation: Any) -> None:
    def make(render_mode: str) -> Any:
        return rendezvous_v0.env(scenario=scenario, observation=observation, render_mode=render_mode)

    render_test(make)


def test_without_a_mode_pygame_is_not_loaded() -> None:
    code = (
        "import sys, envs, numpy as np\n"
        "from envs.rendezvous_v0 import parallel_env\n"
        "env = parallel_env(); env.reset(seed=0)\n"
        "env.step({a: np.zeros(3) for a in env.agents}); env.close()\n"
        "print('pygame' in sys.modules)"
    )
    assert fresh_process(code) == "False"


def test_arrays_need_no_display() -> None:
    code = (
        "from envs.rendezvous_v0 import parallel_env\n"
        "env = parallel_env(render_mode='rgb_array'); env.reset(seed=0)\n"
        "shape = env.render().shape\n"
        "import pygame\n"
        "print(shape, pygame.get_init(), pygame.display.get_init())"
    )
    assert fresh_process(code) == "(608, 848, 3) False False"


def test_a_window_without_a_display_says_what_to_do() -> None:
    code = (
        "from envs.rendezvous_v0 import parallel_env\n"
        "env = parallel_env(render_mode='human')\n"
        "try: env.reset(seed=0)\n"
        "except RuntimeError as problem: print(problem)"
    )
    assert "render_mode='rgb_array'" in fresh_process(code)


@pytest.mark.parametrize("height_px", [320, 608, 1024])
def test_sides_are_what_codecs_want(height_px: int) -> None:
    env = rendezvous_v0.parallel_env(render_mode="rgb_array", render_height_px=height_px)
    env.reset(seed=0)
    frame = env.render()
    assert frame is not None
    assert frame.shape[0] == height_px
    assert frame.shape[1] % 16 == 0
    assert frame.flags.owndata
    assert frame.flags.writeable


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"render_mode": "ascii"}, r"unknown render_mode 'ascii'; known: human, rgb_array"),
        ({"render_height_px": 600}, r"height_px must be a multiple of 16 in 320..4096, got 600"),
        ({"render_height_px": 16}, r"height_px must be .* got 16"),
    ],
)
def test_bad_arguments_say_what_would_do(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        rendezvous_v0.parallel_env(**arguments)


def test_without_pygame_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    found = importlib.util.find_spec

    def without_pygame(name: str, package: str | None = None) -> object:
        return None if name == "pygame" else found(name, package)

    monkeypatch.setattr(importlib.util, "find_spec", without_pygame)
    with pytest.raises(DependencyNotInstalled, match=r"pygame-ce: pip install 'wifipgo\[video\]'"):
        rendezvous_v0.parallel_env(render_mode="rgb_array")
    rendezvous_v0.parallel_env()


def test_rendering_without_a_mode_warns() -> None:
    env = rendezvous_v0.parallel_env()
    env.reset(seed=0)
    with pytest.warns(UserWarning, match="draws nothing without a render_mode"):
        assert env.render() is None


def test_rendering_before_the_first_reset_is_an_error() -> None:
    env = rendezvous_v0.parallel_env(render_mode="rgb_array")
    with pytest.raises(RuntimeError, match="reset"):
        env.render()


def test_pictures_do_not_change_the_episode() -> None:
    seen, unseen = (rendezvous_v0.parallel_env(render_mode=mode) for mode in ("rgb_array", None))
    for env in (seen, unseen):
        env.reset(seed=4)
    for _ in range(5):
        seen.render()
        here, there = (env.step(actions(env))[0] for env in (seen, unseen))
        for agent in here:
            np.testing.assert_array_equal(here[agent], there[agent])


@pytest.mark.usefixtures("window")
def test_the_window_shows_each_tick_once_and_stays_closed_when_closed() -> None:
    import pygame  # noqa: PLC0415 (after the fixture has chosen a display)

    env = rendezvous_v0.parallel_env(render_mode="human", n_steps=3)
    env.reset(seed=0)
    assert env.render() is None
    pygame.event.post(pygame.event.Event(pygame.QUIT))
    while env.agents:
        env.step(actions(env))
    env.close()
    env.close()
    env.reset(seed=1)  # opens another
    env.close()


def fake_moviepy(written: list[Sequence[np.ndarray]]) -> dict[str, types.ModuleType]:
    """What RecordVideoParallel needs of moviepy, keeping the frames instead of encoding them."""

    class Clip:
        def __init__(self, frames: Sequence[np.ndarray], fps: int) -> None:
            self.frames, self.fps = frames, fps

        def write_videofile(self, path: str, logger: object) -> None:
            written.append(self.frames)
            Path(path).write_bytes(b"film")

    name, modules = "moviepy", {}
    for part in ("", ".video", ".video.io", ".video.io.ImageSequenceClip"):
        modules[name + part] = types.ModuleType(name + part)
    modules["moviepy.video.io.ImageSequenceClip"].ImageSequenceClip = Clip  # type: ignore[attr-defined]
    return modules


def test_pettingzoos_recorder_films_every_step(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from pettingzoo.utils.wrappers import RecordVideoParallel  # noqa: PLC0415 (absent from old releases)

    written: list[Sequence[np.ndarray]] = []
    for name, module in fake_moviepy(written).items():
        monkeypatch.setitem(sys.modules, name, module)
    always: Callable[[int], bool] = lambda episode: True  # noqa: E731
    raw = rendezvous_v0.parallel_env(render_mode="rgb_array", n_steps=4)
    env = RecordVideoParallel(raw, str(tmp_path / "films"), episode_trigger=always)
    env.reset(seed=0)
    while raw.agents:
        env.step(actions(raw))
    env.close()
    assert [len(frames) for frames in written] == [5]
    assert all(frame.shape == (608, 848, 3) for frame in written[0])
    assert not np.array_equal(written[0][0], written[0][-1])
