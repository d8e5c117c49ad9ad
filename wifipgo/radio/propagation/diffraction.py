"""Uniform theory of diffraction: what a straight edge between two slabs sends round the corner.

The coefficient of Kouyoumjian and Pathak (Proc. IEEE 62, 1974) for a field along the edge, with the
reflection terms of Luebbers (IEEE Trans. AP 32, 1984) where faces do not conduct. Time factor
``exp(+j 2 pi f t)``.
"""

import numpy as np
from jaxtyping import Complex, Float
from scipy.special import wofz

_TURN_OF_TRANSITION = np.exp(0.75j * np.pi)


def diffraction_factor(
    tx_rad: Float[np.ndarray, "*n"],
    rx_rad: Float[np.ndarray, "*n"],
    open_rad: Float[np.ndarray, "*n"],
    distance: Float[np.ndarray, "*n"],
    *,
    reflection_0: Complex[np.ndarray, "*n"],
    reflection_n: Complex[np.ndarray, "*n"],
    blocked: Complex[np.ndarray, "*n"] | float = 1.0,
) -> Complex[np.ndarray, "*n"]:
    """Field that an edge diffracts over the free-space field as far away as the way round it is long.

    ``D sqrt((s + s') / (s s')) = blocked (d1 + d2) + R_n d3 + R_0 d4``, every d over ``sqrt(L)``. At a shadow
    or reflection boundary one of them has half of what geometrical optics gains or loses there, with the
    other sign on either side, so that the sum with it is continuous.

    Args:
        tx_rad: Angle of the transmitter about the edge, counted from face 0 through the open.
        rx_rad: That of the receiver.
        open_rad: Angle of the open, from face 0 to face n: pi in front of a plane, 2 pi round a screen.
        distance: ``k L = k s s' / (s + s')``, with the distances of both from the edge.
        reflection_0: Of face 0 at the angle at which the transmitter lights it.
        reflection_n: Of face n at the angle at which the receiver sees it.
        blocked: Share of the direct field that is lost behind the edge: 1 less what the faces let through.
    """
    between_rad, across_rad = rx_rad - tx_rad, rx_rad + tx_rad
    ahead, astern, of_n, of_0 = (
        _boundary_term(angle_rad, open_rad, distance)
        for angle_rad in (np.pi + between_rad, np.pi - between_rad, np.pi + across_rad, np.pi - across_rad)
    )
    shadow = ahead + astern
    direct, far_face, near_face = blocked * shadow, reflection_n * of_n, reflection_0 * of_0
    return direct + far_face + near_face


def _boundary_term(
    angle_rad: Float[np.ndarray, "*n"], open_rad: Float[np.ndarray, "*n"], distance: Float[np.ndarray, "*n"]
) -> Complex[np.ndarray, "*n"]:
    """``-exp(-j pi/4) / (2 n sqrt(2 pi k L)) cot(angle / 2n) F(k L a)``, without the infinity times zero.

    With the angle e from the nearest boundary ``a = 2 sin(e/2)^2``, and with the Faddeeva function w ``F(x) =
    sqrt(pi x) exp(j pi/4) w(exp(3j pi/4) sqrt(x))``. The cotangent's pole and the root of x then leave, over
    ``sqrt(L)``, ``-sgn(e) / 2n sin(e/2) / tan(e/2n) w(...)``.
    """
    half_turns = open_rad / np.pi  # n
    period_rad = 2.0 * open_rad
    half_rad = 0.5 * (angle_rad - period_rad * np.rint(angle_rad / period_rad))
    sine, tangent = np.sin(half_rad), np.tan(half_rad / half_turns)
    at_boundary = tangent == 0.0
    ratio = np.where(at_boundary, half_turns, sine / np.where(at_boundary, 1.0, tangent))
    amplitude = np.copysign(0.5 / half_turns, -half_rad) * ratio
    transition = wofz(_TURN_OF_TRANSITION * (np.sqrt(2.0 * distance) * np.abs(sine)))
    return amplitude * transition
