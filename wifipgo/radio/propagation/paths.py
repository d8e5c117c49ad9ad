"""Propagation paths between points among flat walls, with complex gains.

Where rays can be reflected is found by the image method (`wifipgo.radio.propagation.image_method`),
where they bend in `wifipgo.radio.propagation.edge_rays`, what they cross on the way in
`wifipgo.radio.propagation.obstruction`. Spreading is that of free space in three dimensions.
"""

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float, Int

from wifipgo.arithmetic import harmless_underflow
from wifipgo.radio.propagation.edge_rays import (
    DIFFRACTED,
    EdgeRays,
    EdgeViews,
    directions_of,
    edge_rays,
    edge_views,
)
from wifipgo.radio.propagation.image_method import (
    Ends,
    Rays,
    course_of,
    double_bounces,
    every_ray,
    single_bounces,
)
from wifipgo.radio.propagation.link_ends import check_apart, checked_points
from wifipgo.radio.propagation.materials import SPEED_OF_LIGHT_M_S
from wifipgo.radio.propagation.ray_gains import Medium, gained
from wifipgo.radio.propagation.scenes import Scenes, check_worlds, scenes_of
from wifipgo.radio.propagation.surfaces import Surfaces, surfaces_of

__all__ = ["DIFFRACTED", "Paths", "Scenes", "Surfaces", "reverse", "surfaces_of", "trace_paths"]


class Paths(NamedTuple):
    """Paths of a batch of links: line of sight first, then reflections by order and face, then edges.

    The order is the number of reflections, or `DIFFRACTED` of a path over an edge. A path that is
    missing has gain 0, order -1 and zeros elsewhere. The gain is the amplitude ratio between
    isotropic antennas and includes ``exp(-j 2 pi f delay)``. An azimuth points from an end of the
    link to where the path arrives from (rx) or leaves to (tx), in (-pi, pi].
    """

    gain: Complex[np.ndarray, "links paths"]
    delay_s: Float[np.ndarray, "links paths"]
    azimuth_rx_rad: Float[np.ndarray, "links paths"]
    azimuth_tx_rad: Float[np.ndarray, "links paths"]
    order: Int[np.ndarray, "links paths"]

    def only(self, links: Int[np.ndarray, " some"]) -> "Paths":
        """Paths of some links."""
        return Paths(*(column.take(links, axis=0) for column in self))

    def of(self, block: slice) -> "Paths":
        """Paths of links one after the other."""
        if block.start == 0 and block.stop >= len(self.gain):
            return self
        return Paths(*(column[block] for column in self))

    def padded(self, multiple: int) -> "Paths":
        """The same with so many columns, or a multiple of that."""
        n = -self.order.shape[1] % multiple
        values = (-1 if column is self.order else 0 for column in self)
        columns = zip(self, values, strict=True)
        return Paths(*(np.pad(column, ((0, 0), (0, n)), constant_values=value) for column, value in columns))


class Traced(NamedTuple):
    """Rays that something is left of: those of up to one bounce, of two, and those over an edge.

    Attributes:
        ends: Both ends of the links.
        rays: The rays.
        gains: Their gains.
        numbers: Number of each ray among those of its link.
        n_paths: Most rays of a link, at least one.
    """

    ends: Ends
    rays: list[Rays | EdgeRays]
    gains: list[Complex[np.ndarray, " _"]]
    numbers: list[Int[np.ndarray, " _"]]
    n_paths: int


@harmless_underflow
def trace_paths(
    tx_m: Float[np.ndarray, "links 2"],
    rx_m: Float[np.ndarray, "links 2"],
    surfaces: Surfaces | Scenes,
    *,
    carrier_hz: float,
    max_order: int = 1,
    penetration: bool = True,
    diffraction: bool = False,
    world: Int[np.ndarray, " links"] | None = None,
) -> Paths:
    """Line of sight, reflections and, if wanted, diffractions of every link, with complex gains.

    ``h = lambda / (4 pi L) R_1 R_2 T_1 T_2 ... exp(-j 2 pi f L / c)``: R the reflection at each
    face, T the transmission through every obstacle face on the way. The slab is a plane without
    extent, as in ITU-R P.2040-3: it neither lengthens nor shifts the ray. Over an edge there is the
    factor of `wifipgo.radio.propagation.diffraction` in place of reflections. A link has the same
    paths, to the bit, whatever is traced beside it.

    Args:
        tx_m: Transmitters, inside the room and outside obstacles, m. Up to a millimetre on the
            wrong side of a face is taken as just in front of it.
        rx_m: Receivers, likewise, m.
        surfaces: The scene, or the scenes of several worlds.
        carrier_hz: Frequency, the one at which the scene's materials are taken.
        max_order: Most reflections of a path: 0, 1 or 2.
        penetration: Whether a ray goes on, weaker, through obstacles that it meets; otherwise it ends.
        diffraction: Whether rays bend, once and without a reflection, at edges that stick out.
        world: Which of several scenes each link is in.

    Returns:
        As many columns as the link with most paths has, and at least one. A link without any
        path is a row of order -1 and gain 0.

    Raises:
        ValueError: If a coordinate is not finite, a link is shorter than a micrometre or ends
            inside an obstacle or outside the room, or the order or the frequency is none.
    """
    medium = Medium(scenes_of(surfaces), carrier_hz, max_order, penetration, diffraction)
    medium.check()
    n = len(tx_m)
    world = check_worlds(medium.scenes, world, n)
    points = checked_points(
        np.concatenate([tx_m, rx_m]),
        np.concatenate([world, world]),
        medium.scenes,
        lambda k: ("tx_m" if k < n else "rx_m", f"link {k % n}"),
    )
    ends = Ends.of(points.some(slice(n)), points.some(slice(n, None)))
    check_apart(ends.gap_m, ends.tx.at_m, lambda k: ("tx_m and rx_m", f"link {k}"))
    views = edge_views(points, medium) if diffraction else None
    both = None if views is None else (views.some(slice(n)), views.some(slice(n, None)))
    return paths_of(traced(ends, medium, both), medium)


def reverse(paths: Paths) -> Paths:
    """Paths of the links with transmitter and receiver swapped."""
    return paths._replace(azimuth_rx_rad=paths.azimuth_tx_rad, azimuth_tx_rad=paths.azimuth_rx_rad)


def traced(ends: Ends, medium: Medium, views: tuple[EdgeViews, EdgeViews] | None = None) -> Traced:
    """Rays of links between points that were checked; over edges too, if it is told what both ends see."""
    found: list[tuple[Rays | EdgeRays, np.ndarray]] = [
        gained(single_bounces(ends, medium.scenes, reflect=medium.max_order > 0), ends, medium)
    ]
    if medium.max_order == 2:
        found.append(gained(double_bounces(ends, medium.scenes), ends, medium))
    if views is not None:
        found.append(edge_rays(views, ends, medium))
    rays, gains = [part for part, _ in found], [gain for _, gain in found]
    n_paths, numbers = _numbered([part.link for part in rays], ends.n_links)
    return Traced(ends, rays, gains, numbers, n_paths)


def _numbered(
    links: Sequence[Int[np.ndarray, " _"]], n_links: int
) -> tuple[int, list[Int[np.ndarray, " _"]]]:
    """Most rays of a link, at least one, and the number of each ray of each list among those of its link."""
    if len(links) == 1 and _is_dense(links[0], n_links):
        n_each = len(links[0]) // n_links
        return n_each, [every_ray(n_each, n_links)[1]]
    link = links[0] if len(links) == 1 else np.concatenate(links)
    count, number = np.bincount(link, minlength=n_links), np.empty(len(link), dtype=np.int64)
    order = np.argsort(link, kind="stable")
    number[order] = np.arange(len(link)) - np.repeat(count.cumsum() - count, count)
    ends = itertools.accumulate(map(len, links))
    numbers = [number[end - len(one) : end] for one, end in zip(links, ends, strict=True)]
    return max(1, int(count.max(initial=0))), numbers


def _is_dense(link: Int[np.ndarray, " rays"], n_links: int) -> bool:
    """Whether every link has as many rays, in order: known of the list that says so."""
    return n_links > 0 and link is every_ray(len(link) // n_links, n_links)[0]


def columns_of(found: Traced) -> tuple[Complex[np.ndarray, "paths links"], Float[np.ndarray, "paths links"]]:
    """Gain and length, m, of the rays of each link, padded with zeros: all that a channel needs."""
    shape = (found.n_paths, found.ends.n_links)
    if len(found.rays) == 1 and _is_dense(found.rays[0].link, shape[1]):
        return found.gains[0].reshape(shape), found.rays[0].length_m.reshape(shape)
    gain, length_m = np.zeros(shape, dtype=found.gains[0].dtype), np.zeros(shape)
    for rays, gains, number in zip(found.rays, found.gains, found.numbers, strict=True):
        place = number * shape[1] + rays.link
        gain.reshape(-1)[place], length_m.reshape(-1)[place] = gains, rays.length_m
    return gain, length_m


def paths_of(found: Traced, medium: Medium) -> Paths:
    """Rays as rows of equal length, with the directions in which they leave and arrive."""
    parts = [
        _columns(rays, gains, found.ends, medium) for rays, gains in zip(found.rays, found.gains, strict=True)
    ]
    n_paths, n_links = found.n_paths, found.ends.n_links
    if len(parts) == 1 and _is_dense(found.rays[0].link, n_links):
        return Paths(*(np.ascontiguousarray(column.reshape(n_paths, n_links).T) for column in parts[0]))
    size = n_links * n_paths
    out = [np.zeros(size, dtype=complex), *np.zeros((3, size)), np.full(size, -1)]
    for rays, number, columns in zip(found.rays, found.numbers, parts, strict=True):
        place = rays.link * n_paths + number
        for whole, column in zip(out, columns, strict=True):
            whole[place] = column
    return Paths(*(column.reshape(n_links, n_paths) for column in out))


def _columns(
    rays: Rays | EdgeRays, gains: Complex[np.ndarray, " rays"], ends: Ends, medium: Medium
) -> tuple[np.ndarray, ...]:
    """What `Paths` says of some rays."""
    if isinstance(rays, EdgeRays):
        leaves_m, arrives_m = directions_of(rays, ends, medium.scenes)
        order = np.full(len(gains), DIFFRACTED)
    else:
        legs_m = course_of(rays, ends, medium.scenes).legs_m
        leaves_m, arrives_m = legs_m[0], legs_m[-1]
        order = np.minimum(rays.face[-1], 1) + len(rays.face) - 1
    return (
        gains.astype(complex, copy=False),
        rays.length_m / SPEED_OF_LIGHT_M_S,
        np.arctan2(arrives_m[1] + 0.0, arrives_m[0]),  # -0.0 would give -pi
        np.arctan2(leaves_m[1] + 0.0, leaves_m[0]),
        order,
    )
