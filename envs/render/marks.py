"""Marks of the pictures, drawn on a pygame surface; every length is in pixels of that surface."""

import functools
from collections.abc import Iterable, Sequence
from itertools import repeat

import numpy as np
import pygame
from jaxtyping import Float
from pygame import gfxdraw

from wifipgo.command.palette import CALL, INK, LOBE, MEETING, PAPER, SEEN, Colour, mixed, rate_colours

Surface = pygame.Surface

_TIPS_RAD = np.pi / 2.0 + np.pi / 5.0 * np.arange(10)
_STAR = np.where(np.arange(10) % 2 == 0, 1.0, 0.45)[:, None] * np.stack(
    [np.cos(_TIPS_RAD), -np.sin(_TIPS_RAD)], axis=1
)
# A robot's nose: ahead and to the left, in its radius.
_NOSE = np.array([[1.85, 0.0], [0.45, 0.9], [0.45, -0.9]])


def robots(
    surface: Surface,
    places: Float[np.ndarray, "robots 2"],
    yaw_rad: Float[np.ndarray, " robots"],
    of: Sequence[Colour],
    size: float,
) -> None:
    """Discs with a nose, as they are: filled."""
    _bodies(surface, places, yaw_rad, ((1.3 * size, repeat(PAPER)), (size, of)))


def ghosts(
    surface: Surface,
    places: Float[np.ndarray, "robots 2"],
    yaw_rad: Float[np.ndarray, " robots"],
    of: Sequence[Colour],
    size: float,
) -> None:
    """The same as they believe to be: hollow."""
    _bodies(surface, places, yaw_rad, ((size, of), (0.66 * size, repeat(PAPER))))


def _bodies(
    surface: Surface,
    places: Float[np.ndarray, "robots 2"],
    yaw_rad: Float[np.ndarray, " robots"],
    layers: Sequence[tuple[float, Iterable[Colour]]],
) -> None:
    """Discs with a nose, one body after the other, each in layers of a radius and a colour."""
    c, s = np.cos(yaw_rad), np.sin(yaw_rad)
    noses = _NOSE @ np.array([[c, -s], [-s, -c]]).transpose(2, 0, 1)  # y points down
    middles = places.tolist()
    shapes = [
        zip((places[:, None] + radius * noses).tolist(), fills, strict=False) for radius, fills in layers
    ]
    for middle, *body in zip(middles, *shapes, strict=True):
        for (radius, _), (nose, fill) in zip(layers, body, strict=True):
            pygame.draw.polygon(surface, fill, nose)
            pygame.draw.circle(surface, fill, middle, radius)


def links(
    surface: Surface,
    ends: Float[np.ndarray, "links 2 2"],
    rate_share: Float[np.ndarray, " links"],
    size: float,
) -> None:
    """Links, dark and broad by their rates over the top rate."""
    widths = np.maximum(np.rint(size * (0.1 + 0.22 * rate_share)), 1.0).astype(int)
    for (begin, end), colour, width in zip(
        ends.tolist(), rate_colours(rate_share), widths.tolist(), strict=True
    ):
        pygame.draw.line(surface, colour, begin, end, width)


def stars(surface: Surface, places: Float[np.ndarray, "stars 2"], size: float) -> None:
    """Rendezvous."""
    sprite = _star(round(size))
    corners = places - 0.5 * np.array(sprite.get_size())
    surface.fblits([(sprite, corner) for corner in corners.tolist()])


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
    across = np.array([-along[1], along[0]])
    tip, foot = caller + end * along, caller + (end - 1.5 * size) * along
    start, width = caller + begin * along, max(1, round(0.3 * size))
    dashes(surface, start[None], foot[None], (CALL,), size, width=width)
    pygame.draw.polygon(surface, CALL, [tip, foot + 0.8 * size * across, foot - 0.8 * size * across])


def dashes(
    surface: Surface,
    begins: Float[np.ndarray, "lines 2"],
    ends: Float[np.ndarray, "lines 2"],
    of: Sequence[Colour],
    size: float,
    *,
    width: int,
) -> None:
    """Broken lines, each of dashes of a length and smaller gaps."""
    spans = ends - begins
    lengths = np.sqrt((spans**2).sum(axis=1))
    counts = np.ceil(lengths / (1.7 * size)).astype(int)
    line = np.repeat(np.arange(len(counts)), counts)
    from_px = 1.7 * size * (np.arange(len(line)) - np.repeat(counts.cumsum() - counts, counts))
    shares = np.stack([from_px, np.minimum(from_px + size, lengths[line])], axis=1) / lengths[line, None]
    points = begins[line, None] + shares[..., None] * spans[line, None]
    for robot, (begin, end) in zip(line.tolist(), points.tolist(), strict=True):
        pygame.draw.line(surface, of[robot], begin, end, width)


def lobe(surface: Surface, outline: Float[np.ndarray, "grid 2"]) -> None:
    """An AOA profile: long where much of the signal comes from."""
    corners = outline.tolist()
    gfxdraw.filled_polygon(surface, corners, (*LOBE, 130))
    pygame.draw.polygon(surface, mixed(LOBE, INK, 0.25), corners, 2)


def rings(
    surface: Surface, outlines: Float[np.ndarray, "rings steps 2"], of: Sequence[Colour], size: float
) -> None:
    """Uncertainty or error of estimates."""
    width = max(1, round(0.2 * size))
    for outline, colour in zip(outlines, of, strict=True):
        pygame.draw.polygon(surface, mixed(colour, SEEN, 0.35), outline.tolist(), width)


def ribbons(
    surface: Surface, paths: Float[np.ndarray, "robots times 2"], of: Sequence[Colour], size: float
) -> None:
    """True trajectories: broad and pale."""
    width = max(2, round(1.1 * size))
    for points, colour in zip(paths.tolist(), of, strict=True):
        pale = mixed(colour, SEEN, 0.62)
        if len(points) > 1:
            pygame.draw.lines(surface, pale, False, points, width)
        for point in points:
            pygame.draw.circle(surface, pale, point, 0.5 * width)


def threads(
    surface: Surface, paths: Float[np.ndarray, "robots times 2"], of: Sequence[Colour], size: float
) -> None:
    """Estimated trajectories: thin and dark."""
    width = max(1, int(0.3 * size))
    for path, colour in zip(paths, of, strict=True):
        if len(path) > 1:
            pygame.draw.lines(surface, mixed(colour, INK, 0.3), False, path.tolist(), width)
