"""The panel beside the arena: where the episode stands, Err of each robot, and what the marks mean."""

from collections.abc import Callable

import numpy as np
import pygame

from envs.render import marks
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
_BARS_TOP, _BARS_BOTTOM, _LEGEND_TOP, _ROW = 176.0, 268.0, 306.0, 25.0
_BAR_CEILING = 3.0  # thresholds; a longer bar is cut, and broken before its end
_MANY = 8


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
        self._write(target, f"position error, rms: {scene.rms_error_m:.2f} m", 122.0, 18.0)
        self._write(target, "Err of each robot", 152.0, 18.0)
        if len(scene.err_share) <= _MANY:
            self._rows(target, scene.err_share)
        else:
            self._columns(target, scene.err_share)

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
            shown = f"{share * self._threshold():.3g}" if share < 100.0 else "> 99 x"
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
            (_robot, "robot, where it is"),
            (_ghost, "where it believes to be"),
            (_ribbon, "its path"),
            (_thread, "its path as estimated"),
            (_ring, "95 % sure to be in here"),
            (_links, f"link, up to {top_mbit_s:g} Mb/s"),
            (_call, "call: come here"),
            (_lobe, "caller's bearing (AOA)"),
            (_star, "rendezvous"),
            (_floor, "floor seen, not seen"),
        ]
        return rows + [(_obstacle, "obstacle")] * self._has_obstacles


# The legend's marks are the arena's, of one robot.
_ONE = palette.SCREEN_ROBOTS[:1]
_YAW_RAD = np.array([0.5])


def _robot(surface: pygame.Surface, place: np.ndarray, size: float) -> None:
    marks.robots(surface, place[None], _YAW_RAD, _ONE, size)


def _ghost(surface: pygame.Surface, place: np.ndarray, size: float) -> None:
    """Tied to the robot."""
    left, right = place - np.array([2.2 * size, 0.0]), place + np.array([2.0 * size, 0.0])
    marks.dashes(surface, left[None], right[None], _ONE, 0.5 * size, width=2)
    marks.ghosts(surface, left[None], _YAW_RAD, _ONE, size)
    marks.robots(surface, right[None], _YAW_RAD, _ONE, 0.6 * size)


def _wave(place: np.ndarray, size: float) -> np.ndarray:
    """A little path."""
    x = np.linspace(-1.0, 1.0, 9)
    return place + size * np.stack([2.8 * x, 0.7 * np.sin(3.0 * x)], axis=1)


def _ribbon(surface: pygame.Surface, place: np.ndarray, size: float) -> None:
    marks.ribbons(surface, _wave(place, size)[None], _ONE, size)


def _thread(surface: pygame.Surface, place: np.ndarray, size: float) -> None:
    marks.threads(surface, _wave(place, size)[None], _ONE, size)


def _ring(surface: pygame.Surface, place: np.ndarray, size: float) -> None:
    turn_rad = np.linspace(0.0, 2.0 * np.pi, 48)
    outline = place + 1.6 * size * np.stack([np.cos(turn_rad), np.sin(turn_rad)], axis=1)
    marks.rings(surface, outline[None], _ONE, size)


def _links(surface: pygame.Surface, place: np.ndarray, size: float) -> None:
    """Slow to fast, left to right."""
    edges = place + size * np.stack([np.linspace(-3.0, 3.0, 7), np.zeros(7)], axis=1)
    ends = np.stack([edges[:-1], edges[1:]], axis=1)
    marks.links(surface, ends, np.linspace(0.1, 1.0, 6), 1.4 * size)


def _call(surface: pygame.Surface, place: np.ndarray, size: float) -> None:
    caller = place - np.array([2.2 * size, 0.0])
    marks.call(surface, caller, place + np.array([4.0 * size, 0.0]), 0.62 * size)
    marks.waves(surface, caller, 0.42 * size)
    marks.robots(surface, caller[None], np.zeros(1), palette.SCREEN_ROBOTS[1:2], 0.5 * size)


def _lobe(surface: pygame.Surface, place: np.ndarray, size: float) -> None:
    turn_rad = np.linspace(-np.pi, np.pi, 72)
    radius = 4.4 * size * np.exp(3.0 * (np.cos(turn_rad) - 1.0)) + 0.2 * size
    outline = np.stack([radius * np.cos(turn_rad), radius * np.sin(turn_rad)], axis=1)
    marks.lobe(surface, place - np.array([2.0 * size, 0.0]) + outline)


def _star(surface: pygame.Surface, place: np.ndarray, size: float) -> None:
    marks.stars(surface, place[None], 1.6 * size)


def _floor(surface: pygame.Surface, place: np.ndarray, size: float) -> None:
    for colour, left in ((palette.SEEN, -2.8), (palette.UNSEEN, 0.0)):
        corner = place + size * np.array([left, -1.2])
        box = pygame.Rect(corner.tolist(), (2.8 * size, 2.4 * size))
        surface.fill(colour, box)
        pygame.draw.rect(surface, palette.FAINT_INK, box, 2)


def _obstacle(surface: pygame.Surface, place: np.ndarray, size: float) -> None:
    box = pygame.Rect((place - size * np.array([1.6, 1.1])).tolist(), (3.2 * size, 2.2 * size))
    surface.fill(palette.OBSTACLE, box)
    pygame.draw.rect(surface, palette.WALL, box, 3)
