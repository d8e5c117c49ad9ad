"""Propagation paths between points among flat walls, with complex gains.

Where rays can be reflected is found by the image method (`wifipgo.radio.propagation.image_method`), what they
cross on the way in `wifipgo.radio.propagation.obstruction`. Spreading is that of free space in three
dimensions.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float, Int

from wifipgo.arithmetic import harmless_underflow
from wifipgo.errors import require
from wifipgo.radio.propagation._link_ends import checked_ends
from wifipgo.radio.propagation.image_method import Rays, double_bounces, single_bounces
from wifipgo.radio.propagation.materials import (
    CARRIER_LIMITS_HZ,
    SPEED_OF_LIGHT_M_S,
    slab_reflection,
    unit_phasors,
)
from wifipgo.radio.propagation.obstruction import crossed, transmission
from wifipgo.radio.propagation.surfaces import Surfaces, surfaces_of

__all__ = ["Paths", "Surfaces", "reverse", "surfaces_of", "trace_paths"]


class Paths(NamedTuple):
    """Paths of a batch of links: line of sight first, then reflections by order and face.

    A path that is missing has gain 0, order -1 and zeros elsewhere. The gain is the amplitude
    ratio between isotropic antennas and includes ``exp(-j 2 pi f delay)``. An azimuth points
    from an end of the link to where the path arrives from (rx) or leaves to (tx), in (-pi, pi].
    """

    gain: Complex[np.ndarray, "links paths"]
    delay_s: Float[np.ndarray, "links paths"]
    azimuth_rx_rad: Float[np.ndarray, "links paths"]
    azimuth_tx_rad: Float[np.ndarray, "links paths"]
    order: Int[np.ndarray, "links paths"]


@harmless_underflow
def trace_paths(
    tx_m: Float[np.ndarray, "links 2"],
    rx_m: Float[np.ndarray, "links 2"],
    surfaces: Surfaces,
    *,
    carrier_hz: float,
    max_order: int = 1,
    penetration: bool = True,
) -> Paths:
    """Line of sight and reflections of every link, with complex gains.

    ``h = lambda / (4 pi L) R_1 R_2 T_1 T_2 ... exp(-j 2 pi f L / c)``: R the reflection at each
    face, T the transmission through every obstacle face on the way. The slab is a plane without
    extent, as in ITU-R P.2040-3: it neither lengthens nor shifts the ray.

    Args:
        tx_m: Transmitters, inside the room and outside obstacles, m. Up to a millimetre on the
            wrong side of a face is taken as just in front of it.
        rx_m: Receivers, likewise, m.
        surfaces: The scene.
        carrier_hz: Frequency, the one at which the scene's materials are taken.
        max_order: Most reflections of a path: 0, 1 or 2.
        penetration: Whether a ray goes on, weaker, through obstacles that it meets; otherwise it ends.

    Returns:
        As many columns as the link with most paths has, and at least one. A link without any
        path is a row of order -1 and gain 0.

    Raises:
        ValueError: If a coordinate is not finite, a link is shorter than a micrometre or ends
            inside an obstacle or outside the room, or the order or the frequency is none.
    """
    require(max_order in {0, 1, 2}, "max_order", "0, 1 or 2", max_order)
    lowest_hz, highest_hz = CARRIER_LIMITS_HZ
    within = bool(lowest_hz <= carrier_hz <= highest_hz)
    require(within, "carrier_hz", f"in {lowest_hz:g}..{highest_hz:g}", carrier_hz)
    ends, height_m = checked_ends(tx_m, rx_m, surfaces)
    found = [single_bounces(ends, height_m, surfaces, reflect=max_order > 0)]
    if max_order == 2:
        found.append(double_bounces(ends, height_m, surfaces))
    traced = [
        _gained(rays, ends, height_m, surfaces, carrier_hz=carrier_hz, penetration=penetration)
        for rays in found
    ]
    return _padded(traced, n_links=len(tx_m))


def reverse(paths: Paths) -> Paths:
    """Paths of the links with transmitter and receiver swapped."""
    return paths._replace(azimuth_rx_rad=paths.azimuth_tx_rad, azimuth_tx_rad=paths.azimuth_rx_rad)


def _gained(
    rays: Rays,
    ends: Float[np.ndarray, "2 3 links"],
    height_m: Float[np.ndarray, "2 lines links"],
    surfaces: Surfaces,
    *,
    carrier_hz: float,
    penetration: bool,
) -> tuple[Rays, Complex[np.ndarray, " _"]]:
    """Rays that get through, with their gains."""
    if surfaces.n_walls == len(surfaces.ends_m):
        return rays, _unobstructed(rays, surfaces, carrier_hz)
    across = crossed(rays, ends, height_m, surfaces)
    if penetration:
        through = transmission(across, rays, surfaces, carrier_hz)
        return rays, _unobstructed(rays, surfaces, carrier_hz) * through
    rays = rays.only(np.flatnonzero(~across.any(axis=(0, 1))))
    return rays, _unobstructed(rays, surfaces, carrier_hz)


def _unobstructed(rays: Rays, surfaces: Surfaces, carrier_hz: float) -> Complex[np.ndarray, " rays"]:
    """Spreading and reflections of each ray."""
    gain = _spreading(rays.length_m * (carrier_hz / SPEED_OF_LIGHT_M_S))
    reflection = np.ones(rays.face.size, dtype=complex)
    bounced = np.flatnonzero(rays.face)
    face = rays.face.ravel().take(bounced) - 1
    reflection[bounced] = slab_reflection(
        surfaces.permittivity.take(face),
        surfaces.thickness_m.take(face),
        rays.cos_incidence.ravel().take(bounced),
        carrier_hz,
    )
    for each in reflection.reshape(rays.face.shape):
        gain *= each
    return gain


def _spreading(wavelengths: Float[np.ndarray, " rays"]) -> Complex[np.ndarray, " rays"]:
    """Free-space amplitude and phase over a distance in wavelengths."""
    return unit_phasors(2.0 * np.pi * (np.rint(wavelengths) - wavelengths)) / (4.0 * np.pi * wavelengths)


def _padded(traced: list[tuple[Rays, Complex[np.ndarray, " _"]]], *, n_links: int) -> Paths:
    """Rays that something is left of, as rows of equal length."""
    there = [_there(gains) for _, gains in traced]
    links = [rays.link[some] for (rays, _), some in zip(traced, there, strict=True)]
    counts = [np.bincount(link, minlength=n_links) for link in links]
    n_paths = max(1, int(np.add.reduce(counts).max(initial=0)))
    size, begin = n_links * n_paths, np.arange(n_links) * n_paths  # where the next ray of a link goes
    gain, delay_s, order = np.zeros(size, dtype=complex), np.zeros(size), np.full(size, -1)
    azimuth_rad = np.zeros((2, size))
    for (rays, gains), some, link, count in zip(traced, there, links, counts, strict=True):
        place = np.arange(len(link)) + (begin - (count.cumsum() - count)).take(link)
        begin += count
        gain[place] = gains[some]
        delay_s[place] = rays.length_m[some] / SPEED_OF_LIGHT_M_S
        order[place] = np.minimum(rays.face[-1, some], 1) + len(rays.face) - 1
        for azimuth, (x_m, y_m) in zip(azimuth_rad, rays.legs_m[:: len(rays.face)], strict=True):
            azimuth[place] = np.arctan2(y_m[some] + 0.0, x_m[some])  # -0.0 would give -pi
    shape = (n_links, n_paths)
    columns = (gain, delay_s, azimuth_rad[1], azimuth_rad[0], order)
    return Paths(*(column.reshape(shape) for column in columns))


def _there(gains: Complex[np.ndarray, " _"]) -> Int[np.ndarray, " rays"] | slice:
    """Rays that something is left of: nearly always all, which need no copy."""
    some = gains.nonzero()[0]
    return slice(None) if len(some) == len(gains) else some
