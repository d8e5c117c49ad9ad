"""Two-way recordings of a moving receiver in random rooms, with known truth.

Paths come from `wifipgo.radio.propagation.paths`, each with a bounce off floor and ceiling, and are traced
anew at every position of the aperture; point scatterers stand for all that has no flat face.
Forward and reverse channel get symbol timing, noise and 8-bit rounding of their own.
"""

from typing import NamedTuple

import numpy as np

from wifipgo.radio.channel.csi import REPORTED_SUBCARRIERS, SUBCARRIER_SPACING_HZ
from wifipgo.radio.propagation.materials import SPEED_OF_LIGHT_M_S, Slab
from wifipgo.radio.propagation.paths import Paths, surfaces_of, trace_paths
from wifipgo.radio.propagation.surfaces import Surfaces

CARRIER_HZ = 5.54e9
WAVELENGTH_M = SPEED_OF_LIGHT_M_S / CARRIER_HZ
OFFSETS_HZ = SUBCARRIER_SPACING_HZ * REPORTED_SUBCARRIERS
WALLS = (Slab("concrete", 0.2), Slab("brick", 0.12), Slab("plasterboard", 0.025), Slab("glass", 0.01))
BOXES = (
    *(Slab("wood", 0.03), Slab("brick", 0.1), Slab("metal", 0.003)),
    *(Slab("chipboard", 0.02), Slab("concrete", 0.1), Slab("plasterboard", 0.02)),
)
N_PACKETS, N_SCATTERERS = 360, 24
FLOOR, CEILING = -0.35, -0.4  # reflection coefficients of vertical polarisation, middle angles
TIMING_S = (25e-9, 45e-9)  # deviation of symbol timing at either end; a sample of 20 MHz is 50 ns
SNR_DB = 25.0


class Room(NamedTuple):
    """A link in a room."""

    size_m: np.ndarray
    boxes_m: np.ndarray  # x and y of the lower, then of the upper corner
    surfaces: Surfaces
    transmitter_m: np.ndarray
    position_m: np.ndarray  # of the receiver at each packet

    @property
    def truth_rad(self) -> float:
        """Bearing of the transmitter from the mean position."""
        away_m = self.transmitter_m - self.position_m.mean(axis=0)
        return float(np.arctan2(away_m[1], away_m[0]))


def draw_room(rng: np.random.Generator, *, blocked: bool) -> Room:
    """A room of 6 to 14 by 5 to 10 m with two to six boxes, and a link of 2 to 8 m in it."""
    while True:
        size_m = rng.uniform([6.0, 5.0], [14.0, 10.0])
        extent_m = rng.uniform(0.3, 2.5, (rng.integers(2, 7), 2))
        low_m = rng.uniform(0.1, size_m - extent_m - 0.1)
        boxes_m = np.concatenate([low_m, low_m + extent_m], axis=1)
        receiver_m, transmitter_m = rng.uniform(0.8, size_m - 0.8), rng.uniform(0.3, size_m - 0.3)
        position_m = receiver_m + _half_circle(rng)
        sight_m = transmitter_m + np.linspace(0.0, 1.0, 400)[:, None] * (receiver_m - transmitter_m)
        ends_m = np.concatenate([position_m, transmitter_m[None]])
        usable = 2.0 < np.hypot(*(transmitter_m - receiver_m)) < 8.0 and _apart(boxes_m)
        usable &= not _inside(ends_m, boxes_m, margin_m=0.1)
        if usable and _inside(sight_m, boxes_m, margin_m=0.0) == blocked:
            return Room(size_m, boxes_m, _surfaces(size_m, boxes_m, rng), transmitter_m, position_m)


def draw_link(rng: np.random.Generator, *, blocked: bool) -> tuple[Room, np.ndarray]:
    """A room and its channel; rooms in which metal leaves the receiver no path are drawn again."""
    while True:
        room = draw_room(rng, blocked=blocked)
        channel = one_way_channel(room, rng)
        if np.all(np.mean(np.abs(channel) ** 2, axis=1) > 0.0):
            return room, channel


def one_way_channel(room: Room, rng: np.random.Generator) -> np.ndarray:
    """Channel at each packet and subcarrier: traced paths by three heights, and scatterers."""
    far_m = np.tile(room.transmitter_m, (len(room.position_m), 1))
    paths = trace_paths(far_m, room.position_m, room.surfaces, carrier_hz=CARRIER_HZ, max_order=2)
    at_m, from_m, ceiling_m = 0.2, rng.uniform(0.2, 1.0), rng.uniform(2.5, 3.2)
    flat_m, strength = SPEED_OF_LIGHT_M_S * paths.delay_s, _strength(paths)
    bounces = ((at_m - from_m, 1.0), (at_m + from_m, FLOOR), (2.0 * ceiling_m - at_m - from_m, CEILING))
    channel = _scattered(room, from_m - at_m, rng)
    for rise_m, coefficient in bounces:
        channel += _arriving(coefficient * strength, np.hypot(flat_m, rise_m))
    return channel


def two_way_product(channel: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Forward times reverse channel as two cards report them; oscillators cancel and are left out."""
    product = np.ones_like(channel)
    for timing_s in TIMING_S:
        product *= reported(channel, timing_s, rng)
    return product.astype(np.complex64)


def reported(channel: np.ndarray, timing_s: float, rng: np.random.Generator) -> np.ndarray:
    """What a card makes of a channel: symbol timing, noise, gain control, signed bytes."""
    level = channel / np.sqrt(np.mean(np.abs(channel) ** 2))
    late_s = rng.normal(0.0, timing_s, (len(channel), 1))
    noise = rng.normal(size=channel.shape) + 1j * rng.normal(size=channel.shape)
    heard = level * np.exp(-2j * np.pi * OFFSETS_HZ * late_s)
    heard += np.sqrt(0.5) * 10.0 ** (-SNR_DB / 20.0) * noise
    heard *= 30.0 / np.sqrt(np.mean(np.abs(heard) ** 2, axis=1, keepdims=True))  # gain control
    whole: np.ndarray = np.clip(heard.real.round(), -128, 127) + 1j * np.clip(heard.imag.round(), -128, 127)
    return whole


def _half_circle(rng: np.random.Generator) -> np.ndarray:
    """About half a circle of 0.62 m, in any direction, around its mean."""
    turned_rad, towards_rad = np.linspace(0.0, np.pi, N_PACKETS), rng.uniform(-np.pi, np.pi)
    c, s = np.cos(towards_rad), np.sin(towards_rad)
    path_m = 0.31 * np.stack([rng.uniform(0.8, 1.2) * np.sin(turned_rad), -np.cos(turned_rad)], axis=1)
    turned_m = path_m @ np.array([[c, s], [-s, c]])
    return turned_m - turned_m.mean(axis=0)


def _apart(boxes_m: np.ndarray) -> bool:
    """Whether no two boxes overlap."""
    below = np.all(boxes_m[:, None, :2] < boxes_m[None, :, 2:], axis=2)
    return not bool(np.any(below & below.T & ~np.eye(len(boxes_m), dtype=bool)))


def _inside(point_m: np.ndarray, boxes_m: np.ndarray, *, margin_m: float) -> bool:
    """Whether any point lies in any box."""
    over, under = point_m[:, None] > boxes_m[:, :2] - margin_m, point_m[:, None] < boxes_m[:, 2:] + margin_m
    return bool(np.any(np.all(over & under, axis=2)))


def _surfaces(size_m: np.ndarray, boxes_m: np.ndarray, rng: np.random.Generator) -> Surfaces:
    """The faces of a room and its boxes, of random materials."""
    corner_m = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    walls_m = np.stack([corner_m, np.roll(corner_m, -1, axis=0)], axis=1) * size_m
    return surfaces_of(
        walls_m,
        [box[:2] + corner_m * (box[2:] - box[:2]) for box in boxes_m],
        carrier_hz=CARRIER_HZ,
        wall=WALLS[rng.integers(len(WALLS))],
        obstacle=[BOXES[k] for k in rng.integers(len(BOXES), size=len(boxes_m))],
    )


def _strength(paths: Paths) -> np.ndarray:
    """Gain of each path without spreading and delay: 1 on a free line of sight."""
    wavelengths = CARRIER_HZ * np.where(paths.gain != 0.0, paths.delay_s, 0.0)
    return paths.gain * 4.0 * np.pi * wavelengths * np.exp(2j * np.pi * wavelengths)


def _arriving(strength: np.ndarray, length_m: np.ndarray) -> np.ndarray:
    """Sum over paths of spherical waves at each subcarrier."""
    gain = strength * WAVELENGTH_M / (4.0 * np.pi * np.maximum(length_m, 0.1))
    delay_s = length_m[..., None] / SPEED_OF_LIGHT_M_S
    return np.einsum("np,nps->ns", gain, np.exp(-2j * np.pi * (CARRIER_HZ + OFFSETS_HZ) * delay_s))


def _free_spots(room: Room, rng: np.random.Generator) -> np.ndarray:
    """Points of the room outside its boxes."""
    free: list[np.ndarray] = []
    while len(free) < N_SCATTERERS:
        spot_m = rng.uniform(0.05, room.size_m - 0.05)
        if not _inside(spot_m[None], room.boxes_m, margin_m=0.05):
            free.append(spot_m)
    return np.array(free)


def _scattered(room: Room, rise_m: float, rng: np.random.Generator) -> np.ndarray:
    """Waves off points of 1 to 3 square metres (mean) anywhere in the room, by the radar equation."""
    spot_m = _free_spots(room, rng)
    from_m = np.hypot(np.linalg.norm(spot_m - room.transmitter_m, axis=1), rise_m)
    away_m = np.linalg.norm(room.position_m[:, None] - spot_m, axis=2)
    strength = np.exp(2j * np.pi * rng.random(N_SCATTERERS))
    for end_m in (room.transmitter_m, room.position_m.mean(axis=0)):
        ends_m = np.tile(end_m, (N_SCATTERERS, 1))
        legs = trace_paths(ends_m, spot_m, room.surfaces, carrier_hz=CARRIER_HZ, max_order=0)
        strength *= np.abs(_strength(legs)[:, 0])
    section_m2 = rng.exponential(rng.uniform(1.0, 3.0), N_SCATTERERS)
    near = (from_m < 0.3) | (away_m.min(axis=0) < 0.3)
    strength *= np.where(near, 0.0, np.sqrt(section_m2 / (4.0 * np.pi)))
    length_m = from_m + away_m
    return _arriving(strength * length_m / np.maximum(from_m * away_m, 0.09), length_m)
