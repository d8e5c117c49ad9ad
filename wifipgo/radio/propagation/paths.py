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
from wifipgo.radio.propagation.image_method import (
    Ends,
    Rays,
    course_of,
    double_bounces,
    every_ray,
    single_bounces,
)
from wifipgo.radio.propagation.link_ends import check_apart, checked_points
from wifipgo.radio.propagation.materials import (
    CARRIER_LIMITS_HZ,
    SPEED_OF_LIGHT_M_S,
    slab_reflection,
    unit_phasors,
)
from wifipgo.radio.propagation.obstruction import crossed, transmission
from wifipgo.radio.propagation.scenes import Scenes, check_worlds, scenes_of
from wifipgo.radio.propagation.surfaces import Surfaces, surfaces_of

__all__ = ["Paths", "Scenes", "Surfaces", "reverse", "surfaces_of", "trace_paths"]


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


class Medium(NamedTuple):
    """What rays are traced through, and how far.

    Attributes:
        scenes: What stands where.
        carrier_hz: Frequency.
        max_order: Most reflections of a path: 0, 1 or 2.
        penetration: Whether a ray goes on, weaker, through obstacles that it meets.
        single: Whether gains in single precision will do; lengths and phases are worked out in double.
    """

    scenes: Scenes
    carrier_hz: float
    max_order: int
    penetration: bool
    single: bool = False

    def check(self) -> None:
        """Refuse an order or a frequency that is none."""
        require(self.max_order in {0, 1, 2}, "max_order", "0, 1 or 2", self.max_order)
        lowest_hz, highest_hz = CARRIER_LIMITS_HZ
        within = bool(lowest_hz <= self.carrier_hz <= highest_hz)
        require(within, "carrier_hz", f"in {lowest_hz:g}..{highest_hz:g}", self.carrier_hz)


class Traced(NamedTuple):
    """Rays that something is left of: those of up to one bounce, then those of two.

    Attributes:
        ends: Both ends of the links.
        rays: The rays.
        gains: Their gains.
        numbers: Number of each ray among those of its link.
        n_paths: Most rays of a link, at least one.
    """

    ends: Ends
    rays: list[Rays]
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
    world: Int[np.ndarray, " links"] | None = None,
) -> Paths:
    """Line of sight and reflections of every link, with complex gains.

    ``h = lambda / (4 pi L) R_1 R_2 T_1 T_2 ... exp(-j 2 pi f L / c)``: R the reflection at each
    face, T the transmission through every obstacle face on the way. The slab is a plane without
    extent, as in ITU-R P.2040-3: it neither lengthens nor shifts the ray. A link has the same
    paths, to the bit, whatever is traced beside it.

    Args:
        tx_m: Transmitters, inside the room and outside obstacles, m. Up to a millimetre on the
            wrong side of a face is taken as just in front of it.
        rx_m: Receivers, likewise, m.
        surfaces: The scene, or the scenes of several worlds.
        carrier_hz: Frequency, the one at which the scene's materials are taken.
        max_order: Most reflections of a path: 0, 1 or 2.
        penetration: Whether a ray goes on, weaker, through obstacles that it meets; otherwise it ends.
        world: Which of several scenes each link is in.

    Returns:
        As many columns as the link with most paths has, and at least one. A link without any
        path is a row of order -1 and gain 0.

    Raises:
        ValueError: If a coordinate is not finite, a link is shorter than a micrometre or ends
            inside an obstacle or outside the room, or the order or the frequency is none.
    """
    medium = Medium(scenes_of(surfaces), carrier_hz, max_order, penetration)
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
    return paths_of(traced(ends, medium), medium)


def reverse(paths: Paths) -> Paths:
    """Paths of the links with transmitter and receiver swapped."""
    return paths._replace(azimuth_rx_rad=paths.azimuth_tx_rad, azimuth_tx_rad=paths.azimuth_rx_rad)


def traced(ends: Ends, medium: Medium) -> Traced:
    """Rays of links between points that were checked."""
    rays, gains = _gained(single_bounces(ends, medium.scenes, reflect=medium.max_order > 0), ends, medium)
    if medium.max_order < 2:
        n_paths, number = _numbered(rays.link, ends.n_links)
        return Traced(ends, [rays], [gains], [number], n_paths)
    more_rays, more_gains = _gained(double_bounces(ends, medium.scenes), ends, medium)
    n_paths, number = _numbered(np.concatenate([rays.link, more_rays.link]), ends.n_links)
    numbers = [number[: len(rays.link)], number[len(rays.link) :]]
    return Traced(ends, [rays, more_rays], [gains, more_gains], numbers, n_paths)


def _gained(rays: Rays, ends: Ends, medium: Medium) -> tuple[Rays, Complex[np.ndarray, " _"]]:
    """Rays that something is left of, with their gains."""
    scenes, carrier_hz = medium.scenes, medium.carrier_hz
    if scenes.n_walls + 1 == scenes.n_lines:
        return _there(rays, _unobstructed(rays, ends, medium))
    course = course_of(rays, ends, scenes)
    across = crossed(rays, course, ends, scenes)
    if medium.penetration:
        world = scenes.of_some(ends.tx.world, rays.link)
        through = transmission(
            across, rays, course, world=world, scenes=scenes, carrier_hz=carrier_hz, single=medium.single
        )
        free = _unobstructed(rays, ends, medium)
        return _there(rays, free * through)
    rays = rays.only(np.flatnonzero(~across.any(axis=(0, 1))))
    return _there(rays, _unobstructed(rays, ends, medium))


def _there(rays: Rays, gains: Complex[np.ndarray, " _"]) -> tuple[Rays, Complex[np.ndarray, " _"]]:
    """Rays that something is left of: nearly always all, which need no copy."""
    if gains.all():
        return rays, gains
    some = gains.nonzero()[0]
    return rays.only(some), gains.take(some)


def _unobstructed(rays: Rays, ends: Ends, medium: Medium) -> Complex[np.ndarray, " rays"]:
    """Spreading and reflections of each ray."""
    scenes, single = medium.scenes, medium.single
    gain = _spreading(rays.length_m * (medium.carrier_hz / SPEED_OF_LIGHT_M_S), single=single)
    # Of single bounces the lines of sight come first.
    bounced = slice(np.count_nonzero(rays.face[0] == 0) if len(rays.face) == 1 else 0, None)
    world = scenes.of_some(ends.tx.world, rays.link[bounced])
    for face, cos_incidence in zip(rays.face[:, bounced], rays.cos_incidence[:, bounced], strict=True):
        at = scenes.at(face, world)
        permittivity, thickness_m = scenes.permittivity.ravel().take(at), scenes.thickness_m.ravel().take(at)
        reflection = slab_reflection(
            permittivity, thickness_m, cos_incidence, medium.carrier_hz, single=single
        )
        gain[bounced] = gain[bounced] * reflection  # not in place: numpy rounds one alone otherwise there
    return gain


def _spreading(wavelengths: Float[np.ndarray, " rays"], *, single: bool) -> Complex[np.ndarray, " rays"]:
    """Free-space amplitude and phase over a distance in wavelengths."""
    phasor = unit_phasors(-wavelengths, single=single)
    amplitude = (0.25 / np.pi / wavelengths).astype(phasor.real.dtype, copy=False)
    return phasor * amplitude


def _numbered(link: Int[np.ndarray, " rays"], n_links: int) -> tuple[int, Int[np.ndarray, " rays"]]:
    """Most rays of a link, at least one, and the number of each ray among those of its link."""
    if _is_dense(link, n_links):
        n_each = len(link) // n_links
        return n_each, every_ray(n_each, n_links)[1]
    count, number = np.bincount(link, minlength=n_links), np.empty(len(link), dtype=np.int64)
    order = np.argsort(link, kind="stable")
    number[order] = np.arange(len(link)) - np.repeat(count.cumsum() - count, count)
    return max(1, int(count.max(initial=0))), number


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
    rays: Rays, gains: Complex[np.ndarray, " rays"], ends: Ends, medium: Medium
) -> tuple[np.ndarray, ...]:
    """What `Paths` says of some rays."""
    legs_m = course_of(rays, ends, medium.scenes).legs_m
    (leaves_x, leaves_y), (arrives_x, arrives_y) = legs_m[0], legs_m[-1]
    return (
        gains.astype(complex, copy=False),
        rays.length_m / SPEED_OF_LIGHT_M_S,
        np.arctan2(arrives_y + 0.0, arrives_x),  # -0.0 would give -pi
        np.arctan2(leaves_y + 0.0, leaves_x),
        np.minimum(rays.face[-1], 1) + len(rays.face) - 1,
    )
