"""Marks of the pictures, drawn on a pygame surface; every length is in pixels of that surface."""

import functools
import math

import numpy as np
import pygame
from jaxtyping import Float
from pygame import gfxdraw

from envs._render_colours import CALL, INK, LOBE, MEETING, PAPER, SEEN, Colour, mixed

Surface = pygame.Surface

_TIPS_RAD = np.pi / 2.0 + np.pi / 5.0 * np.arange(10)
_STAR = np.where(np.arange(10) % 2 == 0, 1.0, 0.45)[:, None] * np.stack(
    [np.cos(_TIPS_RAD), -np.sin(_TIPS_RAD)], axis=1
)
# A robot's nose, ahead along x.
_NOSE = ((1.85, 0.0), (0.45, 0.9), (0.45, -0.9))


def rate_width(share: float, size: float) -> int:
    """Width of a link by its rate over the top rate."""
    return max(1, round(size * (0.1 + 0.22 * share)))


def _nose(place: Float[np.ndarray, "2"], yaw_rad: float, size: float) -> list[tuple[float, float]]:
    """Corners of the nose of a robot of a radius."""
    x, y = place.tolist()
    c, s = size * math.cos(yaw_rad), size * math.sin(yaw_rad)
    return [(x + c * ahead - s * left, y - s * ahead - c * left) for ahead, left in _NOSE]


def robot(
    surface: Surface, place: Float[np.ndarray, "2"], yaw_rad: float, size: float, colour: Colour
) -> None:
    """A disc with a nose, as it is: filled."""
    for radius, fill in ((1.3 * size, PAPER), (size, colour)):
        pygame.draw.polygon(surface, fill, _nose(place, yaw_rad, radius))
        pygame.draw.circle(surface, fill, place, radius)


def ghost(
    surface: Surface, place: Float[np.ndarray, "2"], yaw_rad: float, size: float, colour: Colour
) -> None:
    """The same as it believes to be: hollow."""
    for radius, fill in ((size, colour), (0.66 * size, PAPER)):
        pygame.draw.polygon(surface, fill, _nose(place, yaw_rad, radius))
        pygame.draw.circle(surface, fill, place, radius)


def star(surface: Surface, place: Float[np.ndarray, "2"], size: float) -> None:
    """A rendezvous."""
    sprite = _star(round(size))
    surface.blit(sprite, place - 0.5 * np.array(sprite.get_size()))


@functools.lru_cache(maxsize=8)
def _star(size: int) -> Surface:
    """A star on a clear surface."""
    sprite = pygame.Surface((2 * size + 5, 2 * size + 5), pygame.SRCALPHA)
    corners = (size + 2.0 + size * _STAR).tolist()
    pygame.draw.polygon(sprite, MEETING, corners)
    pygame.draw.polygon(sprite, INK, corners, max(1, round(0.12 * size)))
    return sprite


def glow(surface: Surface, place: Float[np.ndarray, "2"], size: float) -> None:
    """Light around robots that meet now."""
    x, y = np.rint(place).astype(int).tolist()
    for share, alpha in ((1.0, 70), (0.72, 80), (0.45, 90)):
        gfxdraw.filled_circle(surface, x, y, round(share * size), (*MEETING, alpha))


def waves(surface: Surface, place: Float[np.ndarray, "2"], size: float) -> None:
    """Rings around a robot that calls."""
    for k, share in enumerate((2.3, 3.2, 4.1)):
        colour = mixed(CALL, SEEN, 0.25 * k)
        pygame.draw.circle(surface, colour, place, share * size, max(1, round(0.24 * size)))


def call(
    surface: Surface, caller: Float[np.ndarray, "2"], callee: Float[np.ndarray, "2"], size: float
) -> None:
    """Dashes from caller to callee, with a head where they arrive."""
    span = callee - caller
    length = float(np.hypot(*span))
    begin, end = 4.1 * size, length - 2.4 * size
    if end <= begin:
        return
    along = span / length
    width = max(1, round(0.3 * size))
    for place in np.arange(begin, end - size, 1.7 * size).tolist():
        pygame.draw.line(surface, CALL, caller + place * along, caller + (place + size) * along, width)
    across = np.array([-along[1], along[0]])
    tip, foot = caller + end * along, caller + (end - 1.5 * size) * along
    pygame.draw.polygon(
        surface,
        CALL,
        [tip.tolist(), (foot + 0.8 * size * across).tolist(), (foot - 0.8 * size * across).tolist()],
    )


def lobe(surface: Surface, outline: Float[np.ndarray, "grid 2"]) -> None:
    """An AOA profile: long where much of the signal comes from."""
    corners = outline.tolist()
    gfxdraw.filled_polygon(surface, corners, (*LOBE, 130))
    pygame.draw.polygon(surface, mixed(LOBE, INK, 0.25), corners, 2)


def ring(surface: Surface, outline: Float[np.ndarray, "steps 2"], colour: Colour, size: float) -> None:
    """Uncertainty or error of an estimate."""
    pygame.draw.polygon(surface, mixed(colour, SEEN, 0.35), outline.tolist(), max(1, round(0.2 * size)))


def ribbon(surface: Surface, path: Float[np.ndarray, "times 2"], colour: Colour, size: float) -> None:
    """A true trajectory: broad and pale."""
    pale, width = mixed(colour, SEEN, 0.62), max(2, round(1.1 * size))
    points = path.tolist()
    if len(points) > 1:
        pygame.draw.lines(surface, pale, False, points, width)
    for point in points:
        pygame.draw.circle(surface, pale, point, 0.5 * width)


def thread(surface: Surface, path: Float[np.ndarray, "times 2"], colour: Colour, size: float) -> None:
    """An estimated trajectory: thin and dark."""
    if len(path) > 1:
        pygame.draw.lines(surface, mixed(colour, INK, 0.3), False, path.tolist(), max(1, int(0.3 * size)))
