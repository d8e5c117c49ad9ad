"""Colours of all pictures: what a robot, a link, a call has, wherever it is drawn.

Figures take Okabe and Ito's colours, which colour-blind readers tell apart, as matplotlib reads them; the
screen and Rerun take triples from 0 to 255.
"""

import functools
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

Colour = tuple[int, int, int]

BLUE, VERMILION, GREEN, ORANGE = "#0072B2", "#D55E00", "#009E73", "#E69F00"
PURPLE, SKY, YELLOW, REJECTED = "#CC79A7", "#56B4E9", "#F0E442", "#D00000"
# What is beside the point: other methods, labels; frames; the lines of a grid.
GREY, FRAME, GRID = "#6b7280", "#c9ced6", "#e3e6ea"
SERIES = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY)

# Robots, on the screen and in figures: away from calls and links, and apart for colour-blind readers too.
SCREEN_ROBOTS: tuple[Colour, ...] = (
    (0, 158, 115),
    (186, 85, 150),
    (146, 116, 0),
    (92, 82, 178),
    (110, 55, 20),
    (0, 85, 95),
)
ROBOTS = tuple(f"#{red:02X}{green:02X}{blue:02X}" for red, green, blue in SCREEN_ROBOTS)
INK: Colour = (45, 48, 56)
FAINT_INK: Colour = (112, 117, 128)
PAPER: Colour = (250, 250, 247)
GROOVE: Colour = (228, 229, 226)
UNSEEN: Colour = (226, 228, 230)
SEEN: Colour = (252, 252, 250)
OBSTACLE: Colour = (150, 154, 160)
WALL: Colour = (70, 74, 82)
CALL: Colour = (213, 66, 0)
LOBE: Colour = (240, 150, 20)
MEETING: Colour = (255, 208, 0)
_SLOW: Colour = (196, 216, 234)
_FAST: Colour = (0, 74, 150)
_EDGES = (0.35, 0.62)


def robot_colour(robot: int) -> Colour:
    """Colour of a robot on the screen; colours repeat where there are many."""
    return SCREEN_ROBOTS[robot % len(SCREEN_ROBOTS)]


@functools.lru_cache(maxsize=256)
def mixed(colour: Colour, other: Colour, share: float) -> Colour:
    """Colour between two; ``share`` of the second."""
    red, green, blue = (round(a + (b - a) * share) for a, b in zip(colour, other, strict=True))
    return red, green, blue


def rate_colours(share: Float[np.ndarray, " links"]) -> Sequence[Colour]:
    """Colours of links by their rates over the top rate."""
    mix = np.array(_SLOW) + share[:, None] * (np.array(_FAST) - np.array(_SLOW))
    return [(red, green, blue) for red, green, blue in np.rint(mix).astype(int).tolist()]


def screen_colours() -> list[Colour]:
    """Colours of the screen for pictures that have a few only: all that is drawn, and its soft edges."""
    drawn = (*SCREEN_ROBOTS, INK, FAINT_INK, OBSTACLE, WALL, CALL, LOBE, MEETING, _SLOW, _FAST)
    grounds = (PAPER, UNSEEN, SEEN, GROOVE)
    soft = [mixed(colour, ground, share) for colour in drawn for ground in (SEEN, UNSEEN) for share in _EDGES]
    return list(dict.fromkeys([*grounds, *drawn, *soft]))
