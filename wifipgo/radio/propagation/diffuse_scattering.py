"""A diffuse cluster: power from many small scatterers beside the traced paths.

The scatterers are points in the room, drawn once an episode. A link reaches each by one
bounce, so delay and both directions follow from the geometry: the same poses give the same
channel, nearby poses nearly the same, and both ends agree. How much each adds falls with the
angle between its direction and the straight line between the robots, at either end.
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float, Int

from wifipgo.arithmetic import harmless_underflow
from wifipgo.radio.propagation.materials import SPEED_OF_LIGHT_M_S
from wifipgo.radio.propagation.paths import Paths
from wifipgo.rows import Chance
from wifipgo.se2 import wrap_angle

# Paths that only a scatterer explains, in the column `Paths.order`.
SCATTERED = 9
N_SCATTERERS = 64
_NOTHING_TAKEN = 1.0 - 1e-5  # of free space: gains may be in single precision
Lines = Float[np.ndarray, "links 2"]


class Diffuse(NamedTuple):
    """Scatterers of an episode, of one world or, with worlds first, of several.

    Attributes:
        at_m: Their places.
        reflectivity: Amplitude and phase of each, unitless.
        ratio: Power of the cluster over that of ``power_of``.
        spread_rad: Standard deviation of the Gaussian taper of power over angle.
        power_of: A name in `DIFFUSE_POWERS`.
    """

    at_m: Float[np.ndarray, "*worlds scatterers 2"]
    reflectivity: Complex[np.ndarray, "*worlds scatterers"]
    ratio: float
    spread_rad: float
    power_of: str = "paths"


def draw_diffuse(
    *,
    ratio: float,
    spread_rad: float,
    size_m: float,
    rng: Chance,
    n_worlds: int = 1,
    power_of: str = "paths",
) -> Diffuse:
    """Scatterers anywhere in square rooms with a corner at the origin, circular normal."""
    at_m = rng.uniform(0.0, size_m, (n_worlds, N_SCATTERERS, 2))
    parts = rng.standard_normal((n_worlds, 2, N_SCATTERERS))
    return Diffuse(at_m, parts[:, 0] + 1j * parts[:, 1], ratio, spread_rad, power_of)


def _power_of_paths(paths: Paths, line_m: Lines, carrier_hz: float) -> Float[np.ndarray, " links"]:
    """Power of the traced paths, the same however far they are padded."""
    power: np.ndarray = np.add.accumulate(np.abs(paths.gain) ** 2, axis=1)[:, -1]
    return power


def _power_taken(paths: Paths, line_m: Lines, carrier_hz: float) -> Float[np.ndarray, " links"]:
    """Power that obstacles take from the straight line: that of free space without what is left."""
    apart_m = np.hypot(line_m[:, 0], line_m[:, 1])
    free = (SPEED_OF_LIGHT_M_S / (4.0 * np.pi * carrier_hz * apart_m)) ** 2
    straight = np.where(paths.order == 0, np.abs(paths.gain) ** 2, 0.0).max(axis=1)
    taken: np.ndarray = np.where(straight < _NOTHING_TAKEN * free, free - straight, 0.0)
    return taken


# What the power of the cluster is a share of.
DIFFUSE_POWERS: Mapping[str, Callable[[Paths, Lines, float], Float[np.ndarray, " links"]]] = MappingProxyType(
    {"paths": _power_of_paths, "obstructed": _power_taken}
)


@harmless_underflow
def with_diffuse(
    paths: Paths,
    tx_m: Float[np.ndarray, "links 2"],
    rx_m: Float[np.ndarray, "links 2"],
    diffuse: Diffuse,
    *,
    carrier_hz: float,
    world: Int[np.ndarray, " links"] | None = None,
) -> Paths:
    """Paths of each link with those over the scatterers behind them.

    Their power adds up to ``ratio`` times that of the traced paths, so that a link without a path stays
    without; or times what obstacles take from the straight line, of which a share goes on scattered, as real
    ones are no even slabs and have an end. Taper: ``exp(-(a_rx^2 + a_tx^2) / (2 spread^2))`` in power,
    with ``a`` the angle from the straight line at that end.

    Args:
        paths: Traced paths.
        tx_m: Transmitters.
        rx_m: Receivers.
        diffuse: Scatterers.
        carrier_hz: Frequency.
        world: World of each link; the first without.
    """
    own = np.zeros(len(tx_m), dtype=np.int64) if world is None else world
    at_m = diffuse.at_m.reshape(-1, *diffuse.at_m.shape[-2:])[own]
    to_rx, to_tx = (at_m - end_m[:, None] for end_m in (rx_m, tx_m))
    azimuth_rx, azimuth_tx = (np.arctan2(way[..., 1], way[..., 0]) for way in (to_rx, to_tx))
    line_m = tx_m - rx_m
    line_rad = np.arctan2(*line_m.T[::-1])[:, None]
    off = wrap_angle(azimuth_rx - line_rad) ** 2 + wrap_angle(azimuth_tx - line_rad - np.pi) ** 2
    nearest = off.min(axis=1, keepdims=True)  # taken out, so that not all of them underflow
    reflectivity = diffuse.reflectivity.reshape(-1, at_m.shape[1])[own]
    taper = np.exp(-(off - nearest) / (4.0 * diffuse.spread_rad**2))
    amplitude = reflectivity * taper
    length_m = np.linalg.norm(to_rx, axis=-1) + np.linalg.norm(to_tx, axis=-1)
    delay_s = length_m / SPEED_OF_LIGHT_M_S
    whole = DIFFUSE_POWERS[diffuse.power_of](paths, line_m, carrier_hz)
    power = diffuse.ratio * whole / (np.abs(amplitude) ** 2).sum(axis=1)
    # Factors are named: a product in place of a large nameless one is rounded otherwise.
    scale, phasor = np.sqrt(power)[:, None], np.exp(-2j * np.pi * carrier_hz * delay_s)
    scaled = scale * amplitude
    gain = scaled * phasor
    there = gain != 0.0
    order = np.where(there, SCATTERED, -1)
    added = (gain, delay_s * there, azimuth_rx * there, azimuth_tx * there, order)
    return Paths(*(np.concatenate(pair, axis=1) for pair in zip(paths, added, strict=True)))
