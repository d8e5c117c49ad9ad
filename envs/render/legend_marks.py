"""Marks of the legend: those of the arena, of one robot, around a place."""

import numpy as np
import pygame

from envs.render import marks
from envs.render.text import write
from wifipgo.command import palette

_ONE = palette.SCREEN_ROBOTS[:1]
_YAW_RAD = np.array([0.5])


def robot(surface: pygame.Surface, place: np.ndarray, size: float) -> None:
    """Where it is."""
    marks.robots(surface, place[None], _YAW_RAD, _ONE, size)


def ghost(surface: pygame.Surface, place: np.ndarray, size: float) -> None:
    """Tied to the robot."""
    left, right = place - np.array([2.2 * size, 0.0]), place + np.array([2.0 * size, 0.0])
    marks.dashes(surface, left[None], right[None], _ONE, 0.5 * size, width=2)
    marks.ghosts(surface, left[None], _YAW_RAD, _ONE, size)
    marks.robots(surface, right[None], _YAW_RAD, _ONE, 0.6 * size)


def _wave(place: np.ndarray, size: float) -> np.ndarray:
    """A little path."""
    x = np.linspace(-1.0, 1.0, 9)
    return place + size * np.stack([2.8 * x, 0.7 * np.sin(3.0 * x)], axis=1)


def ribbon(surface: pygame.Surface, place: np.ndarray, size: float) -> None:
    """Its path."""
    marks.ribbons(surface, _wave(place, size)[None], _ONE, size)


def thread(surface: pygame.Surface, place: np.ndarray, size: float) -> None:
    """Its path as estimated."""
    marks.threads(surface, _wave(place, size)[None], _ONE, size)


def ring(surface: pygame.Surface, place: np.ndarray, size: float) -> None:
    """Where it is sure to be."""
    turn_rad = np.linspace(0.0, 2.0 * np.pi, 48)
    outline = place + 1.6 * size * np.stack([np.cos(turn_rad), np.sin(turn_rad)], axis=1)
    marks.rings(surface, outline[None], _ONE, size)


def links(surface: pygame.Surface, place: np.ndarray, size: float) -> None:
    """Slow to fast, left to right."""
    edges = place + size * np.stack([np.linspace(-3.0, 3.0, 7), np.zeros(7)], axis=1)
    ends = np.stack([edges[:-1], edges[1:]], axis=1)
    marks.links(surface, ends, np.linspace(0.1, 1.0, 6), 1.4 * size)


def call(surface: pygame.Surface, place: np.ndarray, size: float) -> None:
    """Who calls whom."""
    caller = place - np.array([2.2 * size, 0.0])
    marks.call(surface, caller, place + np.array([4.0 * size, 0.0]), 0.62 * size)
    marks.waves(surface, caller, 0.42 * size)
    marks.robots(surface, caller[None], np.zeros(1), palette.SCREEN_ROBOTS[1:2], 0.5 * size)


def lobe(surface: pygame.Surface, place: np.ndarray, size: float) -> None:
    """From where a call is heard."""
    turn_rad = np.linspace(-np.pi, np.pi, 72)
    radius = 4.4 * size * np.exp(3.0 * (np.cos(turn_rad) - 1.0)) + 0.2 * size
    outline = np.stack([radius * np.cos(turn_rad), radius * np.sin(turn_rad)], axis=1)
    marks.lobe(surface, place - np.array([2.0 * size, 0.0]) + outline)


def star(surface: pygame.Surface, place: np.ndarray, size: float) -> None:
    """Where it met."""
    marks.stars(surface, place[None], 1.6 * size)


def glow(surface: pygame.Surface, place: np.ndarray, size: float) -> None:
    """Meeting now."""
    marks.glow(surface, place, 1.9 * size)
    marks.robots(surface, place[None], _YAW_RAD, _ONE, 0.7 * size)


def floor(surface: pygame.Surface, place: np.ndarray, size: float) -> None:
    """Seen, and not."""
    for colour, left in ((palette.SEEN, -2.8), (palette.UNSEEN, 0.0)):
        corner = place + size * np.array([left, -1.2])
        box = pygame.Rect(corner.tolist(), (2.8 * size, 2.4 * size))
        surface.fill(colour, box)
        pygame.draw.rect(surface, palette.FAINT_INK, box, 2)


def obstacle(surface: pygame.Surface, place: np.ndarray, size: float) -> None:
    """A box."""
    box = pygame.Rect((place - size * np.array([1.6, 1.1])).tolist(), (3.2 * size, 2.2 * size))
    surface.fill(palette.OBSTACLE, box)
    pygame.draw.rect(surface, palette.WALL, box, 3)


def key(width_px: int, height_px: int, unit: float) -> pygame.Surface:
    """The marks that matter most in a row, each beside its meaning; drawn large and scaled down."""
    rows = (
        (robot, "robot"),
        (ghost, "as it believes"),
        (ribbon, "path"),
        (thread, "as estimated"),
        (call, "call"),
        (glow, "rendezvous"),
    )
    pitch, y = width_px / len(rows), 0.5 * height_px
    large = pygame.Surface((2 * width_px, 2 * height_px))
    large.fill(palette.PAPER)
    for k, (draw, _) in enumerate(rows):
        draw(large, 2.0 * np.array([pitch * k + 17.0 * unit, y]), 8.0 * unit)
    out = pygame.transform.smoothscale(large, (width_px, height_px))
    for k, (_, text) in enumerate(rows):
        write(out, text, (pitch * k + 35.0 * unit, y), 15.0 * unit, middle=True)
    return out
