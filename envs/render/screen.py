"""Where an environment's pictures go: into arrays, or into a window."""

import os

import numpy as np
import pygame

from envs.render.config import RenderConfig
from envs.render.viewer import Viewer
from wifipgo.scenarios import Scenario
from wifipgo.state import Tick, World


class Frames:
    """Ticks as arrays; needs no display."""

    def __init__(self, config: RenderConfig) -> None:
        """Draw pictures of a size."""
        self._viewer = Viewer(config)

    def show(self, tick: Tick, world: World, scenario: Scenario) -> np.ndarray | None:
        """The tick as an array."""
        return self._viewer.frame(tick, world, scenario)

    def close(self) -> None:
        """Nothing to release."""


class Window:
    """Ticks in a window, not faster than a rate. Once its user closes it, it stays closed."""

    def __init__(self, config: RenderConfig, fps: int) -> None:
        """Open the window.

        Raises:
            RuntimeError: There is no display; says what to do without one.
        """
        self._viewer, self._fps = Viewer(config), fps
        self._shown: Tick | None = None
        try:
            pygame.display.init()
            unseen = pygame.display.get_driver() == "offscreen" and "SDL_VIDEODRIVER" not in os.environ
            window = None if unseen else pygame.Window("wifipgo", config.size_px)
        except pygame.error:
            window = None
        if window is None:
            raise RuntimeError("there is no display to open a window on: use render_mode='rgb_array'")
        self._window: pygame.Window | None = window
        self._clock = pygame.time.Clock()

    def show(self, tick: Tick, world: World, scenario: Scenario) -> np.ndarray | None:
        """Draw the tick, unless it is shown already or the window was closed."""
        self._listen()
        if self._window is None or tick is self._shown:
            return None
        self._window.title = f"wifipgo: {scenario.name}"
        self._window.get_surface().blit(self._viewer.surface(tick, world, scenario), (0, 0))
        self._window.flip()
        self._clock.tick(self._fps)
        self._shown = tick
        return None

    def _listen(self) -> None:
        """Close the window if its user asks for it."""
        asked = (pygame.QUIT, pygame.WINDOWCLOSE)
        if self._window is not None and any(event.type in asked for event in pygame.event.get()):
            self.close()

    def close(self) -> None:
        """Close the window."""
        if self._window is not None:
            self._window.destroy()
            self._window = None


Screen = Frames | Window


def screen_for(mode: str, config: RenderConfig, fps: int) -> Screen:
    """The screen of a render mode."""
    return Window(config, fps) if mode == "human" else Frames(config)
