"""Several policies in one world side by side: an arena each, its name above, how it stands below."""

from collections.abc import Sequence

import numpy as np
import pygame
from jaxtyping import UInt8

from envs.render.arena import ArenaPainter
from envs.render.config import BLOCK_PX
from envs.render.legend_marks import key
from envs.render.scene import Scene
from envs.render.text import write
from envs.render.viewer import array_of
from wifipgo.command import palette
from wifipgo.scenarios import Scenario
from wifipgo.state import World

_HEIGHT = 320.0  # places are given for arenas of this side and scaled
_HEAD, _FOOT, _KEY = 26.0, 66.0, 26.0
_FEW = 4


class SideBySide:
    """Draws scenes of several policies as pictures of one size.

    Args:
        worlds: One a policy; the same room, if their seeds are.
        scenario: What is played.
        names: Of the policies.
        side_px: Side of an arena.
    """

    def __init__(
        self, worlds: Sequence[World], scenario: Scenario, names: Sequence[str], side_px: int
    ) -> None:
        """Write what stays."""
        self._painters = [ArenaPainter(world, scenario, side_px) for world in worlds]
        self._scenario, self._side_px, self._u = scenario, side_px, side_px / _HEIGHT
        height_px = side_px + (_HEAD + _FOOT + _KEY) * self._u
        size_px = (side_px * len(names), BLOCK_PX * int(np.ceil(height_px / BLOCK_PX)))
        self._surface = pygame.Surface(size_px)
        self._still = pygame.Surface(size_px)
        self._still.fill(palette.PAPER)
        for k, name in enumerate(names):
            write(self._still, name, self._at(k, 14.0, 8.0), 22.0 * self._u)
        top = (_HEAD + _HEIGHT + _FOOT) * self._u
        self._still.blit(key(size_px[0], round(_KEY * self._u), self._u), (0, round(top)))

    def frame(self, scenes: Sequence[Scene]) -> UInt8[np.ndarray, "height width 3"]:
        """Draw a scene of each policy."""
        self._surface.blit(self._still, (0, 0))
        for k, (painter, scene) in enumerate(zip(self._painters, scenes, strict=True)):
            corner = (k * self._side_px, round(_HEAD * self._u))
            painter.paint(scene, self._surface.subsurface((*corner, self._side_px, self._side_px)))
            self._stand(k, scene)
        return array_of(self._surface)

    def _at(self, k: int, x: float, y: float) -> tuple[float, float]:
        """Place of a point that is given beside policy ``k``, px."""
        return k * self._side_px + self._u * x, self._u * y

    def _stand(self, k: int, scene: Scene) -> None:
        """Iteration, score, Err of each robot, red above the threshold, and how far it is off."""
        threshold, y = self._scenario.rendezvous.err_threshold, _HEAD + _HEIGHT + 24.0
        mapped, seen = (f"{100.0 * share:.0f} %" for share in (scene.mapped_share, scene.seen_share))
        score = f"mapped {mapped} of the floor, saw {seen}"
        write(self._surface, score, self._at(k, 14.0, y - 22.0), 20.0 * self._u)
        write(
            self._surface,
            f"iteration {scene.t} of {self._scenario.n_steps}",
            self._at(k, 306.0, 12.0),
            16.0 * self._u,
            palette.FAINT_INK,
            right=True,
        )
        few = scene.err_share[:_FEW] if len(scene.err_share) <= _FEW else scene.err_share.max(keepdims=True)
        word = "Err" if len(scene.err_share) <= _FEW else "highest Err"
        write(self._surface, word, self._at(k, 14.0, y), 20.0 * self._u)
        x = 50.0 if word == "Err" else 104.0
        for share in few.tolist():
            colour = palette.CALL if share > 1.0 else palette.INK
            write(self._surface, f"{share * threshold:.1f}", self._at(k, x, y), 20.0 * self._u, colour)
            x += 54.0
        told = f"threshold {threshold:g}; off by {scene.rms_error_m:.1f} m (rms)"
        write(self._surface, told, self._at(k, 14.0, y + 21.0), 17.0 * self._u, palette.FAINT_INK)
