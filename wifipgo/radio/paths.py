"""Propagation paths between points among flat walls: image method in the plane.

Reflection point, length and incidence follow from the height of both ends of a link over
a face and their positions along it (`Surfaces`). The line of sight counts as a face whose
images are the points themselves. Spreading is that of free space in three dimensions.

In the working arrays the first axis is the end of the link (0 transmitter, 1 receiver), the
second the coordinate; links or rays come last, which is what makes them fast.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Complex, Float, Int

from wifipgo.errors import require
from wifipgo.radio.materials import SPEED_OF_LIGHT_M_S, slab_reflection, slab_transmission
from wifipgo.radio.surfaces import Surfaces, surfaces_of

__all__ = ["Paths", "Surfaces", "reverse", "surfaces_of", "trace_paths"]


class Paths(NamedTuple):
    """Paths of a batch of links: line of sight first, then reflections in the order of the faces.

    A path that is missing has gain 0, order -1 and zeros elsewhere. The gain is the amplitude
    ratio between isotropic antennas and includes ``exp(-j 2 pi f delay)``. An azimuth points
    from an end of the link to where the path arrives from (rx) or leaves to (tx), in (-pi, pi].
    """

    gain: Complex[np.ndarray, "links paths"]
    delay_s: Float[np.ndarray, "links paths"]
    azimuth_rx_rad: Float[np.ndarray, "links paths"]
    azimuth_tx_rad: Float[np.ndarray, "links paths"]
    order: Int[np.ndarray, "links paths"]


class _Rays(NamedTuple):
    """Candidate paths in one flat list, sorted by link."""

    link: Int[np.ndarray, " rays"]
    face: Int[np.ndarray, " rays"]  # 0 is the line of sight
    to_image_m: Float[np.ndarray, "2 2 rays"]  # from each end to the image of the other
    length_m: Float[np.ndarray, " rays"]
    cos_incidence: Float[np.ndarray, " rays"]
    hit_m: Float[np.ndarray, "2 rays"]  # where it meets the face; halfway on the line of sight


def trace_paths(
    tx_m: Float[np.ndarray, "links 2"],
    rx_m: Float[np.ndarray, "links 2"],
    surfaces: Surfaces,
    *,
    carrier_hz: float,
    max_order: int = 1,
    penetration: bool = True,
) -> Paths:
    """Line of sight and single reflections of every link, with complex gains.

    ``h = lambda / (4 pi L) R T_1 T_2 ... exp(-j 2 pi f L / c)``: R the reflection at the face, T
    the transmission through every obstacle face on the way. The slab is a plane without
    extent, as in ITU-R P.2040-3: it neither lengthens nor shifts the ray.

    Args:
        tx_m: Transmitters, inside the room, m.
        rx_m: Receivers, inside the room, m.
        surfaces: The scene.
        carrier_hz: Frequency.
        max_order: 0 for the line of sight only, 1 for reflections too.
        penetration: Whether a ray goes on, weaker, through obstacles that it meets; otherwise it ends.

    Returns:
        As many columns as the link with most paths has, and at least one.

    Raises:
        ValueError: If a coordinate is not finite, a link has no length, or an order is not there.
    """
    require(max_order in {0, 1}, "max_order", "0 or 1 (order 2 is not there yet)", max_order)
    ends = np.ones((2, 3, len(tx_m)))
    ends[0, :2], ends[1, :2] = tx_m.T, rx_m.T
    _check_links(ends)
    height_m = surfaces.to_height @ ends
    rays = _rays(ends, height_m, surfaces, max_order=max_order)
    gain = _spreading(rays.length_m * (carrier_hz / SPEED_OF_LIGHT_M_S))
    gain *= _reflection(rays, surfaces, carrier_hz)
    if surfaces.n_walls < len(surfaces.ends_m):
        crossed = _crossed(rays, ends, height_m, surfaces)
        gain *= (
            _transmission(crossed, rays, surfaces, carrier_hz) if penetration else ~crossed.any(axis=(0, 2))
        )
    return _padded(rays, gain, n_links=len(tx_m))


def reverse(paths: Paths) -> Paths:
    """Paths of the links with transmitter and receiver swapped."""
    return paths._replace(azimuth_rx_rad=paths.azimuth_tx_rad, azimuth_tx_rad=paths.azimuth_rx_rad)


def _check_links(ends: Float[np.ndarray, "2 3 links"]) -> None:
    """Refuse ends that are not finite or coincide."""
    if not np.isfinite(ends).all():
        end, index = np.argwhere(~np.isfinite(ends).all(axis=1))[0]
        got = ends[end, :2, index].tolist()
        raise ValueError(f"{('tx_m', 'rx_m')[end]} must be finite, got {got} at link {index}")
    apart = (ends[0] != ends[1]).any(axis=0)
    if not apart.all():
        index = np.argmin(apart)
        raise ValueError(f"tx_m and rx_m must differ, both are {ends[0, :2, index].tolist()} at link {index}")


def _rays(
    ends: Float[np.ndarray, "2 3 links"],
    height_m: Float[np.ndarray, "2 lines links"],
    surfaces: Surfaces,
    *,
    max_order: int,
) -> _Rays:
    """Every line of sight and reflection that exists if nothing stands in the way.

    A face reflects when both ends are in front of it and the straight line from one end
    to the image of the other passes between the ends of the face.
    """
    along_m, sum_m = surfaces.to_along @ ends, height_m[0] + height_m[1]
    weighted = along_m[0] * height_m[1] + along_m[1] * height_m[0]  # position of the hit, times sum_m
    exists = (weighted >= 0.0) & (weighted < surfaces.length_m[:, None] * sum_m)
    exists &= (height_m[0] > 0.0) & (height_m[1] > 0.0)
    exists[1:] &= max_order > 0
    link, face = np.divmod(np.flatnonzero(exists.T), len(exists))
    up_m = height_m.reshape(2, -1).take(face * ends.shape[-1] + link, axis=1)
    both_up_m = up_m[0] + up_m[1]
    gap_m, normal = (ends[1, :2] - ends[0, :2]).take(link, axis=1), surfaces.normal.take(face, axis=1)
    to_image_m = np.stack([gap_m - 2.0 * up_m[1] * normal, -gap_m - 2.0 * up_m[0] * normal])
    length_m = np.sqrt(to_image_m[0, 0] ** 2 + to_image_m[0, 1] ** 2)
    hit_m = ends[0, :2].take(link, axis=1) + up_m[0] / both_up_m * to_image_m[0]
    return _Rays(link, face, to_image_m, length_m, np.minimum(both_up_m / length_m, 1.0), hit_m)


def _spreading(wavelengths: Float[np.ndarray, " rays"]) -> Complex[np.ndarray, " rays"]:
    """Free-space amplitude and phase over a distance in wavelengths."""
    return np.exp(-2j * np.pi * wavelengths) / (4.0 * np.pi * wavelengths)


def _reflection(rays: _Rays, surfaces: Surfaces, carrier_hz: float) -> Complex[np.ndarray, " rays"]:
    """Reflection coefficient of each ray at its face; 1 on the line of sight."""
    out = np.ones(len(rays.face), dtype=complex)
    bounced = np.flatnonzero(rays.face)
    face, cos_incidence = rays.face.take(bounced) - 1, rays.cos_incidence.take(bounced)
    out[bounced] = slab_reflection(
        surfaces.permittivity.take(face), surfaces.thickness_m.take(face), cos_incidence, carrier_hz
    )
    return out


def _crossed(
    rays: _Rays,
    ends: Float[np.ndarray, "2 3 links"],
    height_m: Float[np.ndarray, "2 lines links"],
    surfaces: Surfaces,
) -> Bool[np.ndarray, "2 rays obstacle_faces"]:
    """Which obstacle faces lie across the way of each ray from either end to the hit.

    The ends of that leg are on different sides of the face, and the ends of the face on
    different sides of the leg.
    """
    first = surfaces.n_walls + 1
    to_height, corners_m = surfaces.to_height[first:], surfaces.ends_m[first - 1 :]
    front_hit = rays.hit_m.T @ to_height[:, :2].T + to_height[:, 2] > 0.0
    own = np.flatnonzero(rays.face >= first)
    front_hit[own, rays.face[own] - first] = True  # both legs stay in front of the face that they end on
    front_end = (height_m[:, first:] > 0.0).swapaxes(1, 2).take(rays.link, axis=1)
    across = rays.to_image_m[:, ::-1].swapaxes(1, 2) * (-1.0, 1.0)
    offset = np.einsum("erk,ekr->er", across, ends[:, :2].take(rays.link, axis=2))[..., None]
    left_start, left_end = (across @ corners_m[:, k].T > offset for k in (0, 1))
    return (front_end != front_hit) & (left_start != left_end)


def _transmission(
    crossed: Bool[np.ndarray, "2 rays obstacle_faces"], rays: _Rays, surfaces: Surfaces, carrier_hz: float
) -> Complex[np.ndarray, " rays"]:
    """Product of the transmission coefficients of all obstacle faces that each ray crosses."""
    out = np.ones(crossed.shape[:2], dtype=complex)
    leg, face = np.divmod(np.flatnonzero(crossed), crossed.shape[2])
    if len(leg):
        face += surfaces.n_walls
        end, ray = np.divmod(leg, crossed.shape[1])
        climb_m = (rays.to_image_m[end, :, ray] * surfaces.normal.T[face + 1]).sum(axis=-1)
        cos_incidence = np.minimum(np.abs(climb_m) / rays.length_m[ray], 1.0)
        each = slab_transmission(
            surfaces.permittivity[face], surfaces.thickness_m[face], cos_incidence, carrier_hz
        )
        start = np.flatnonzero(np.diff(leg, prepend=-1))
        out.reshape(-1)[leg[start]] = np.multiply.reduceat(each, start)
    return out[0] * out[1]


def _padded(rays: _Rays, gain: Complex[np.ndarray, " rays"], *, n_links: int) -> Paths:
    """Rays that something is left of, as rows of equal length."""
    kept = np.flatnonzero(gain != 0.0)
    link = rays.link.take(kept)
    count = np.bincount(link, minlength=n_links)
    n_paths = max(1, int(count.max(initial=0)))
    place = link * n_paths + np.arange(len(kept)) - (np.cumsum(count) - count).take(link)

    def rows(values: np.ndarray, missing: int = 0) -> np.ndarray:
        out = np.full(n_links * n_paths, missing, dtype=values.dtype)
        out[place] = values.take(kept)
        return out.reshape(n_links, n_paths)

    azimuth_rad = np.arctan2(rays.to_image_m[:, 1] + 0.0, rays.to_image_m[:, 0])  # -0.0 would give -pi
    return Paths(
        gain=rows(gain),
        delay_s=rows(rays.length_m / SPEED_OF_LIGHT_M_S),
        azimuth_rx_rad=rows(azimuth_rad[1]),
        azimuth_tx_rad=rows(azimuth_rad[0]),
        order=rows(np.minimum(rays.face, 1), missing=-1),
    )
