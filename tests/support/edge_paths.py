"""A second tracer of diffracted paths: one link, one corner, one face at a time, as in the formulas.

Points are complex numbers and nothing is taken from the package.
"""

import cmath
import math

from scipy.special import fresnel

from support.image_method import C_M_S, Face, crossing, slab


def edge_paths(
    tx: complex, rx: complex, faces: list[Face], *, carrier_hz: float, penetration: bool
) -> list[tuple[float, complex]]:
    """Length and gain of every path over one corner, by length; not those that nothing is left of."""
    found = []
    for ending in faces:
        for beginning in faces:
            if ending.end == beginning.start and ending.blocks and beginning.blocks:
                path = over_corner((tx, rx), (ending, beginning), faces, carrier_hz, penetration)
                found += [path] if path is not None and path[1] != 0.0 else []
    return sorted(found, key=lambda path: path[0])


def over_corner(
    ends: tuple[complex, complex],
    corner: tuple[Face, Face],
    faces: list[Face],
    carrier_hz: float,
    penetration: bool,
) -> tuple[float, complex] | None:
    """Length and gain of the path over a corner, if it sticks out and both ends are in the open."""
    ending, beginning = corner
    edge = ending.end
    opened = turn(ending.start - edge, beginning.end - edge)
    tx_rad, rx_rad = (turn(ending.start - edge, end - edge) for end in ends)
    if opened <= math.pi or tx_rad >= opened or rx_rad >= opened:
        return None
    if tx_rad > opened / 2.0:
        ending, beginning = beginning, ending
        tx_rad, rx_rad = opened - tx_rad, opened - rx_rad
    # A ray at this angle to a face, as one along the real axis to a face turned by the angle.
    near = slab(turned(ending, tx_rad), 1.0, carrier_hz)
    far = slab(turned(beginning, opened - rx_rad), 1.0, carrier_hz)
    through = near[1] * far[1] if penetration else 0.0
    s_tx, s_rx = (abs(end - edge) for end in ends)
    k = 2.0 * math.pi * carrier_hz / C_M_S
    between, across, n, reach = (
        rx_rad - tx_rad,
        rx_rad + tx_rad,
        opened / math.pi,
        s_tx * s_rx / (s_tx + s_rx),
    )
    bent = (1.0 - through) * (term(between, 1, n, k, reach) + term(between, -1, n, k, reach))
    bent += far[0] * term(across, 1, n, k, reach) + near[0] * term(across, -1, n, k, reach)
    gain = bent / (2.0 * k) / math.sqrt(s_tx * s_rx * (s_tx + s_rx)) * cmath.exp(-1j * k * (s_tx + s_rx))
    for start in ends:
        for face in faces:
            if face.blocks and edge not in {face.start, face.end} and crossing(start, edge, face) is not None:
                gain *= slab(face, edge - start, carrier_hz)[1] if penetration else 0.0
    return s_tx + s_rx, gain


def turn(start: complex, end: complex) -> float:
    """Counter-clockwise angle from one direction to another, in (0, 2 pi]."""
    return cmath.phase(end / start) % (2.0 * math.pi) or 2.0 * math.pi


def turned(face: Face, angle_rad: float) -> Face:
    """The same slab at an angle to the real axis."""
    return Face(0.0j, cmath.exp(1j * angle_rad), face.permittivity, face.thickness_m, True)


def term(beta: float, sign: int, n: float, k: float, reach_m: float) -> complex:
    """One of the four terms of the coefficient."""
    turns = round((beta + sign * math.pi) / (2.0 * math.pi * n))
    x = k * reach_m * 2.0 * math.cos(0.5 * (2.0 * n * math.pi * turns - beta)) ** 2
    sine, cosine = fresnel(math.sqrt(2.0 * x / math.pi))
    rest = math.sqrt(0.5 * math.pi) * complex(0.5 - cosine, sine - 0.5)
    transition = 2j * math.sqrt(x) * cmath.exp(1j * x) * rest
    scale = -cmath.exp(-0.25j * math.pi) / (2.0 * n * math.sqrt(2.0 * math.pi * k))
    return scale / math.tan((math.pi + sign * beta) / (2.0 * n)) * transition
