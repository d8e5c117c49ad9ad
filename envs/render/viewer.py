"""Pictures of an episode: pure functions of tick, world and scenario, drawn without a display.

`Viewer` remembers what it drew last, and only to be fast: any tick of any episode, in any
order, gives the picture that a new viewer would draw. The only modules that know
pygame are this one and its parts; they are imported when the first picture is asked for.
"""

import os

os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")

import numpy as np
import pygame
from jaxtyping import UInt8

from envs.render.arena import ArenaPainter
from envs.render.config import RenderConfig
from envs.render.panel import Panel
from envs.render.scene import Scene, scene_of
from wifipgo.arithmetic import plain_arithmetic
from wifipgo.scenarios import Scenario
from wifipgo.state import Tick, World


class Viewer:
    """Draws ticks as pictures of one size."""

    def __init__(self, config: RenderConfig | None = None) -> None:
        """Draw with a configuration, or with the default."""
        self.config = config or RenderConfig()
        self._surface = pygame.Surface(self.config.size_px)
        side = self.config.height_px
        self._left = self._surface.subsurface((0, 0, side, side))
        self._right = self._surface.subsurface((side, 0, self.config.panel_px, side))
        self._of: tuple[World, Scenario] | None = None

    @plain_arithmetic
    def surface(self, tick: Tick, world: World, scenario: Scenario) -> pygame.Surface:
        """Draw a tick; the next call draws over it."""
        return self.surface_of(scene_of(tick, scenario), world, scenario)

    @plain_arithmetic
    def surface_of(self, scene: Scene, world: World, scenario: Scenario) -> pygame.Surface:
        """Draw a scene; the next call draws over it."""
        if not self._same(world, scenario):
            self._arena = ArenaPainter(world, scenario, self.config.height_px)
            self._panel = Panel(world, scenario, self.config)
            self._of = world, scenario
        self._arena.paint(scene, self._left)
        self._panel.paint(scene, self._right)
        return self._surface

    def frame(self, tick: Tick, world: World, scenario: Scenario) -> UInt8[np.ndarray, "height width 3"]:
        """Draw a tick as an array of its own."""
        return array_of(self.surface(tick, world, scenario))

    def frame_of(self, scene: Scene, world: World, scenario: Scenario) -> UInt8[np.ndarray, "height width 3"]:
        """Draw a scene as an array of its own."""
        return array_of(self.surface_of(scene, world, scenario))

    def _same(self, world: World, scenario: Scenario) -> bool:
        """Whether what is kept of the last picture is still of use."""
        return self._of is not None and self._of[0] is world and self._of[1] == scenario


def array_of(surface: pygame.Surface) -> UInt8[np.ndarray, "height width 3"]:
    """Pixels as an array of its own."""
    width, height = surface.get_size()
    frame = np.empty((height, width, 3), dtype=np.uint8)
    # A surface on the array's memory: twice as fast as numpy, and more than that as pygame's own copies.
    pygame.image.frombuffer(frame.data, (width, height), "RGB").blit(surface, (0, 0))
    return frame
