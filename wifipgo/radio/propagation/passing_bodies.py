"""People who walk through the room and stand in the way of paths.

A body is a screen as wide as it, tall, across the leg that it shadows: blockage model B of 3GPP TR 38.901,
Sec. 7.6.4.2, without the upper and lower edge. Only the radio meets bodies: nobody bumps into them, and they
pass through boxes. During a turn they stand.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from wifipgo.arithmetic import harmless_underflow
from wifipgo.radio.propagation.materials import SPEED_OF_LIGHT_M_S
from wifipgo.radio.propagation.paths import Paths
from wifipgo.rows import Chance

RADIUS_M = 0.25  # of a body
_LEAST_M = 0.05  # from the screen to an end: closer, a body would stand on the antenna


class Bodies(NamedTuple):
    """People of an episode, of one world or, with worlds first, of several.

    Attributes:
        start_m: Where each is at iteration 0, if walls did not turn it back.
        stride_m: How far each walks in an iteration, as a vector.
        size_m: Side of the square room.
    """

    start_m: Float[np.ndarray, "worlds bodies 2"]
    stride_m: Float[np.ndarray, "worlds bodies 2"]
    size_m: float

    def at(self, t: int) -> Float[np.ndarray, "worlds bodies 2"]:
        """Places at an iteration: straight on, and back from the walls."""
        straight_m = self.start_m + t * self.stride_m
        return self.size_m - np.abs(np.mod(straight_m, 2.0 * self.size_m) - self.size_m)


def draw_bodies(*, count: int, step_m: float, size_m: float, rng: Chance, n_worlds: int = 1) -> Bodies:
    """Bodies anywhere in square rooms, each with a direction of its own."""
    start_m = rng.uniform(0.0, size_m, (n_worlds, count, 2))
    towards_rad = rng.uniform(-np.pi, np.pi, (n_worlds, count))
    stride_m = step_m * np.stack([np.cos(towards_rad), np.sin(towards_rad)], axis=-1)
    return Bodies(start_m, stride_m, size_m)


@harmless_underflow
def behind_bodies(
    paths: Paths,
    tx_m: Float[np.ndarray, "links 2"],
    rx_m: Float[np.ndarray, "links 2"],
    bodies_m: Float[np.ndarray, "links bodies 2"],
    *,
    carrier_hz: float,
) -> Paths:
    """Paths, weakened by the bodies in the way of their first and their last leg.

    A path of one turn has no other; of a second reflection's middle leg nothing is known here.

    Args:
        paths: Of each link.
        tx_m: Transmitters.
        rx_m: Receivers.
        bodies_m: Bodies in the room of each link.
        carrier_hz: Frequency.
    """
    way = (tx_m - rx_m)[:, None]
    leaves, arrives = (_unit(azimuth) for azimuth in (paths.azimuth_tx_rad, paths.azimuth_rx_rad))
    length_m = paths.delay_s * SPEED_OF_LIGHT_M_S
    last_m = np.where(paths.order == 0, length_m, _last_leg(way, arrives, length_m))
    wavelength_m = SPEED_OF_LIGHT_M_S / carrier_hz
    factor = np.ones(paths.gain.shape)
    for body_m in np.moveaxis(bodies_m, 1, 0):
        factor *= _past_screen((body_m - rx_m)[:, None], arrives, last_m, wavelength_m)
        first = _past_screen((body_m - tx_m)[:, None], leaves, length_m - last_m, wavelength_m)
        factor *= np.where(paths.order == 0, 1.0, first)
    return paths._replace(gain=paths.gain * factor)


def _unit(azimuth_rad: Float[np.ndarray, "links paths"]) -> Float[np.ndarray, "links paths 2"]:
    return np.stack([np.cos(azimuth_rad), np.sin(azimuth_rad)], axis=-1)


def _last_leg(
    way_m: Float[np.ndarray, "links 1 2"],
    arrives: Float[np.ndarray, "links paths 2"],
    length_m: Float[np.ndarray, "links paths"],
) -> Float[np.ndarray, "links paths"]:
    """Length of the leg that ends at the receiver, of a path with one turn.

    The triangle of receiver, transmitter and turn: with legs a and L - a and a gap d between the ends,
    ``a = (L^2 - d^2) / (2 (L - d cos))``, the angle at the receiver between path and gap. What turns
    twice is cut somewhere between.
    """
    gap2_m2 = (way_m**2).sum(axis=-1)
    along_m = (way_m * arrives).sum(axis=-1)
    return 0.5 * (length_m**2 - gap2_m2) / np.maximum(length_m - along_m, 1e-9)


def _past_screen(
    body_m: Float[np.ndarray, "links 1 2"],
    direction: Float[np.ndarray, "links paths 2"],
    leg_m: Float[np.ndarray, "links paths"],
    wavelength_m: float,
) -> Float[np.ndarray, "links paths"]:
    """Amplitude past a screen across a leg, ``1 - (F(right edge) - F(left edge))``: (7.6-29, 30)."""
    along_m = (body_m * direction).sum(axis=-1)
    across_m = body_m[..., 1] * direction[..., 0] - body_m[..., 0] * direction[..., 1]
    beside = (along_m > _LEAST_M) & (along_m < leg_m - _LEAST_M)
    near_m, across_m = along_m[beside], across_m[beside]
    far_m = leg_m[beside] - near_m
    right, left = (_edge(across_m + side * RADIUS_M, near_m, far_m, wavelength_m) for side in (1.0, -1.0))
    factor = np.ones(along_m.shape)
    factor[beside] = 1.0 - (right - left)
    return factor


def _edge(
    across_m: Float[np.ndarray, " legs"],
    near_m: Float[np.ndarray, " legs"],
    far_m: Float[np.ndarray, " legs"],
    wavelength_m: float,
) -> Float[np.ndarray, " legs"]:
    """Signed F of one edge: ``atan(pi / 2 sqrt(pi / lambda (D1 + D2 - r))) / pi``."""
    across2_m2 = across_m * across_m
    detour_m = np.sqrt(near_m * near_m + across2_m2) + np.sqrt(far_m * far_m + across2_m2) - near_m - far_m
    depth = np.arctan(0.5 * np.pi * np.sqrt(np.pi / wavelength_m * np.maximum(detour_m, 0.0))) / np.pi
    return np.sign(across_m) * depth
