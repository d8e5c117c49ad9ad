"""The panel beside the arena: where the episode stands, Err of each robot, and what the marks mean."""

from collections.abc import Callable

import numpy as np
import pygame

from envs.render import legend_marks
from envs.render.config import RenderConfig
from envs.render.scene import Scene
from envs.render.text import write
from wifipgo.command import palette
from wifipgo.radio.channel.bands import band_of
from wifipgo.scenarios import Scenario
from wifipgo.state import World

# Places are given for a panel of this height and scaled.
_HEIGHT = 608.0
_LEFT, _RIGHT, _TEXT_LEFT = 16.0, 226.0, 66.0
_BARS_TOP, _BARS_BOTTOM, _LEGEND_TOP, _ROW = 176.0, 268.0, 306.0, 24.5
_BAR_CEILING = 3.0  # thresholds; a longer bar is cut, and broken before its end
_FEW, _MANY = 3, 8
_LEAST_ERR = 0.001  # less is rounding


class Panel:
    """Draws the panel of one episode; what never changes is drawn once."""

    def __init__(self, world: World, scenario: Scenario, config: RenderConfig) -> None:
        """Write title and legend."""
        self._scenario, self._u = scenario, config.height_px / _HEIGHT
        self._has_obstacles = len(world.layout.obstacles_m) > 0
        self._still = pygame.Surface((config.panel_px, config.height_px))
        self._legend()
        self._still.fill(palette.GROOVE, (0, 0, 1, config.height_px))
        self._write(self._still, scenario.name, 16.0, 24.0)
        self._write(self._still, config.caption, 38.0, 17.0, palette.FAINT_INK)

    def paint(self, scene: Scene, target: pygame.Surface) -> None:
        """Draw a scene's panel on a surface of the panel's size."""
        target.blit(self._still, (0, 0))
        n_steps = self._scenario.n_steps
        self._write(target, f"iteration {scene.t} of {n_steps}", 66.0, 18.0)
        self._bar(target, 86.0, 5.0, min(scene.t / n_steps, 1.0), palette.FAINT_INK)
        self._write(target, f"floor seen: {100.0 * scene.seen_share:.0f} %", 102.0, 18.0)
        self._position_errors(target, scene)
        self._write(target, "Err of each robot", 152.0, 18.0)
        if len(scene.err_share) <= _MANY:
            self._rows(target, scene.err_share)
        else:
            self._columns(target, scene.err_share)

    def _position_errors(self, target: pygame.Surface, scene: Scene) -> None:
        """How far each of few robots is from where it believes to be, in its colour; of many, the whole."""
        if len(scene.error_m) > _FEW:
            self._write(target, f"position error, rms: {scene.rms_error_m:.2f} m", 122.0, 18.0)
            return
        self._write(target, "off by", 122.0, 18.0)
        for robot, off_m in enumerate(scene.error_m.tolist()):
            x = _TEXT_LEFT + 54.0 * robot
            self._write(target, f"{off_m:.1f} m", 122.0, 18.0, palette.robot_colour(robot), x=x)

    def _write(
        self,
        target: pygame.Surface,
        text: str,
        y: float,
        size: float,
        colour: palette.Colour = palette.INK,
        *,
        x: float = _LEFT,
        middle: bool = False,
        right: bool = False,
    ) -> None:
        """Text at a place of the unscaled panel."""
        u = self._u
        write(target, text, (u * x, u * y), u * size, colour, middle=middle, right=right)

    def _rect(self, left: float, top: float, right: float, bottom: float) -> pygame.Rect:
        """Rectangle at a place of the unscaled panel."""
        x, y = round(self._u * left), round(self._u * top)
        return pygame.Rect(x, y, round(self._u * right) - x, max(round(self._u * bottom) - y, 1))

    def _bar(
        self, target: pygame.Surface, top: float, height: float, share: float, colour: palette.Colour
    ) -> None:
        """A groove, filled from the left."""
        end = _LEFT + (_RIGHT - _LEFT) * share
        target.fill(palette.GROOVE, self._rect(_LEFT, top, _RIGHT, top + height))
        target.fill(colour, self._rect(_LEFT, top, end, top + height))

    def _threshold(self) -> float:
        return self._scenario.rendezvous.err_threshold

    def _rows(self, target: pygame.Surface, err_share: np.ndarray) -> None:
        """A row for each of few robots, its Err beside it, and the threshold across all."""
        pitch = min((_BARS_BOTTOM - _BARS_TOP) / len(err_share), 30.0)
        scale = (_RIGHT - 50.0 - _LEFT) / _BAR_CEILING
        for robot, share in enumerate(err_share.tolist()):
            top, colour = _BARS_TOP + pitch * robot, palette.robot_colour(robot)
            bottom = top + 0.72 * pitch
            target.fill(palette.GROOVE, self._rect(_LEFT, top, _LEFT + scale * _BAR_CEILING, bottom))
            target.fill(colour, self._rect(_LEFT, top, _LEFT + scale * min(share, _BAR_CEILING), bottom))
            if share > _BAR_CEILING:
                cut = _LEFT + scale * _BAR_CEILING - 8.0
                target.fill(palette.PAPER, self._rect(cut, top, cut + 2.0, bottom))
            err = share * self._threshold()
            shown = "> 99 x" if share >= 100.0 else f"{err:.3g}" if err >= _LEAST_ERR else "0"
            colour = palette.CALL if share > 1.0 else palette.INK
            self._write(target, shown, 0.5 * (top + bottom), 18.0, colour, x=_RIGHT, middle=True, right=True)
        x, end = _LEFT + scale, _BARS_TOP + pitch * len(err_share)
        target.fill(palette.CALL, self._rect(x - 1.0, _BARS_TOP - 5.0, x + 1.0, end))
        self._write(target, f"threshold {self._threshold():g}", end + 2.0, 16.0, palette.CALL, x=x - 1.0)

    def _columns(self, target: pygame.Surface, err_share: np.ndarray) -> None:
        """A column for each of many robots, and the threshold across all."""
        width = (_RIGHT - _LEFT) / len(err_share)
        scale = (_BARS_BOTTOM - _BARS_TOP) / _BAR_CEILING
        target.fill(palette.GROOVE, self._rect(_LEFT, _BARS_TOP, _RIGHT, _BARS_BOTTOM))
        lefts = _LEFT + width * np.arange(len(err_share))
        tops = _BARS_BOTTOM - scale * np.minimum(err_share, _BAR_CEILING)
        bars = np.stack([lefts, tops, lefts + 0.8 * width, np.full_like(lefts, _BARS_BOTTOM)], axis=1)
        bars_px = np.rint(self._u * bars).astype(int)
        bars_px[:, 2:] = np.maximum(bars_px[:, 2:] - bars_px[:, :2], 1)  # width and height
        for robot, (bar, share) in enumerate(zip(bars_px.tolist(), err_share.tolist(), strict=True)):
            target.fill(palette.CALL if share > 1.0 else palette.robot_colour(robot), bar)
        for left in lefts[err_share > _BAR_CEILING].tolist():
            cut = self._rect(left, _BARS_TOP + 6.0, left + 0.8 * width, _BARS_TOP + 8.0)
            target.fill(palette.PAPER, cut)
        y = _BARS_BOTTOM - scale
        target.fill(palette.CALL, self._rect(_LEFT, y - 1.0, _RIGHT, y + 1.0))
        n_over = int((err_share > 1.0).sum())
        text = f"{n_over} of {len(err_share)} above the threshold of {self._threshold():g}"
        self._write(target, text, _BARS_BOTTOM + 4.0, 16.0, palette.CALL)

    def _legend(self) -> None:
        """Every mark beside its meaning; marks are drawn large and scaled down, as in the arena."""
        rows = self._marks()
        large = pygame.Surface((2 * self._still.get_width(), 2 * self._still.get_height()))
        large.fill(palette.PAPER)
        unit, middle = 2.0 * self._u, 0.5 * (_LEFT + _TEXT_LEFT - 8.0)
        for k, (draw, _) in enumerate(rows):
            draw(large, unit * np.array([middle, _LEGEND_TOP + _ROW * k]), unit * 6.0)
        pygame.transform.smoothscale(large, self._still.get_size(), self._still)
        for k, (_, text) in enumerate(rows):
            self._write(self._still, text, _LEGEND_TOP + _ROW * k, 17.0, x=_TEXT_LEFT, middle=True)

    def _marks(self) -> list[tuple[Callable[[pygame.Surface, np.ndarray, float], None], str]]:
        """How to draw each mark around a place, and what it means."""
        top_mbit_s = band_of(self._scenario.radio.bandwidth_hz).top_rate_mbit_s
        rows = [
            (legend_marks.robot, "robot, where it is"),
            (legend_marks.ghost, "where it believes to be"),
            (legend_marks.ribbon, "its path"),
            (legend_marks.thread, "its path as estimated"),
            (legend_marks.ring, "95 % sure to be in here"),
            (legend_marks.links, f"link, up to {top_mbit_s:g} Mb/s"),
            (legend_marks.call, "call: come here"),
            (legend_marks.lobe, "caller's bearing (AOA)"),
            (legend_marks.star, "last rendezvous"),
            (legend_marks.glow, "rendezvous now"),
            (legend_marks.floor, "floor seen, not seen"),
        ]
        return rows + [(legend_marks.obstacle, "obstacle")] * self._has_obstacles
