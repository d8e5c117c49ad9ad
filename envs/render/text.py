"""Text on pygame surfaces, in the font that comes with pygame: no font of the machine is looked for."""

import functools

import pygame

from wifipgo.command.palette import INK, Colour

# Letters are drawn this much larger and scaled down: small ones would otherwise stand unevenly.
_OVERSAMPLE = 4


@functools.cache
def _font(size_px: int) -> pygame.font.Font:
    pygame.font.init()  # and nothing else: no display, no sound
    return pygame.font.Font(None, size_px)


@functools.lru_cache(maxsize=256)
def _line(text: str, size_px: int, colour: Colour) -> pygame.Surface:
    large = _font(_OVERSAMPLE * size_px).render(text, True, colour)
    width, height = large.get_size()
    return pygame.transform.smoothscale(large, (round(width / _OVERSAMPLE), round(height / _OVERSAMPLE)))


def write(
    surface: pygame.Surface,
    text: str,
    place_px: tuple[float, float],
    size_px: float,
    colour: Colour = INK,
    *,
    middle: bool = False,
    right: bool = False,
) -> None:
    """Write a line from its top left corner on; ``middle``: the middle of its height, ``right``: its end."""
    if not text:
        return
    line = _line(text, round(size_px), colour)
    x, y = place_px
    width, height = line.get_size()
    surface.blit(line, (x - width if right else x, y - 0.5 * height if middle else y))
