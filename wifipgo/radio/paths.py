"""Propagation paths between points among flat walls: image method in the plane.

A face is a line with a front side. For each face, a point has a height over the line
and a position along it; reflection, length and incidence follow from these two numbers
of both ends. The line of sight is treated as one more face, with a normal of zero: its
image is the point itself. Spreading is that of free space in three dimensions.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Complex, Float, Int

from wifipgo.errors import require
from wifipgo.radio.materials import (
    MATERIALS,
    SPEED_OF_LIGHT_M_S,
    Slab,
    relative_permittivity,
    slab_reflection,
    slab_transmission,
)
from wifipgo.segments import cross, polygon_edges


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Surfaces:
    """The static scene as the radio sees it, with what every call needs worked out once.

    Attributes:
        ends_m: Both ends of every face, m.
        permittivity: Complex relative permittivity of every face at the carrier.
        thickness_m: Thickness of the slab behind every face, m.
        n_walls: The first ``n_walls`` faces are the outer walls of a convex room: their inner
            side reflects and, with every robot inside, they never stand in the way. The other
            faces belong to obstacles, counter-clockwise, so their front is on the right.
        direction: Unit vector along each face; row 0 (zeros) is the line of sight.
        normal: Unit vector out of the front of each face; row 0 (zeros) is the line of sight.
        to_along: Columns that take ``(x, y, 1)`` to the position along each face, m.
        to_height: Columns that take ``(x, y, 1)`` to the height over each face, m.
        length_m: Length of each face, infinite for the line of sight.
    """

    ends_m: Float[np.ndarray, "faces 2 2"]
    permittivity: Complex[np.ndarray, " faces"]
    thickness_m: Float[np.ndarray, " faces"]
    n_walls: int
    direction: Float[np.ndarray, "faces+1 2"] = field(init=False, repr=False)
    normal: Float[np.ndarray, "faces+1 2"] = field(init=False, repr=False)
    to_along: Float[np.ndarray, "3 faces+1"] = field(init=False, repr=False)
    to_height: Float[np.ndarray, "3 faces+1"] = field(init=False, repr=False)
    length_m: Float[np.ndarray, " faces+1"] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Refuse faces without length and rooms that are not convex; work out the frames."""
        require(0 <= self.n_walls <= len(self.ends_m), "Surfaces.n_walls", "in 0..faces", self.n_walls)
        base_m, edge_m = self.ends_m[:, 0], self.ends_m[:, 1] - self.ends_m[:, 0]
        length_m = np.hypot(edge_m[:, 0], edge_m[:, 1])
        require(bool(np.all(length_m > 0.0)), "Surfaces.ends_m", "faces longer than 0", length_m)
        direction = edge_m / length_m[:, None]
        normal = np.stack([direction[:, 1], -direction[:, 0]], axis=-1)
        _turn_inwards(normal[: self.n_walls], self.ends_m[: self.n_walls])
        set_field = object.__setattr__
        set_field(self, "direction", np.concatenate([np.zeros((1, 2)), direction]))
        set_field(self, "normal", np.concatenate([np.zeros((1, 2)), normal]))
        set_field(self, "to_along", _affine(direction, base_m, at_sight=0.0))
        set_field(self, "to_height", _affine(normal, base_m, at_sight=1.0))
        set_field(self, "length_m", np.concatenate([[np.inf], length_m]))


class Paths(NamedTuple):
    """Paths of a batch of links: line of sight first, then reflections in the order of the faces.

    A path that is missing has gain 0, order -1 and zeros elsewhere. The gain is that of
    the amplitude between isotropic antennas and includes ``exp(-j 2 pi f delay)``. An
    azimuth points from an end of the link to where the path arrives from (rx) or leaves
    to (tx), in (-pi, pi].
    """

    gain: Complex[np.ndarray, "links paths"]
    delay_s: Float[np.ndarray, "links paths"]
    azimuth_rx_rad: Float[np.ndarray, "links paths"]
    azimuth_tx_rad: Float[np.ndarray, "links paths"]
    order: Int[np.ndarray, "links paths"]


class _Rays(NamedTuple):
    """Paths in one flat list: which link, off which face (0: line of sight), and the geometry."""

    link: Int[np.ndarray, " rays"]
    face: Int[np.ndarray, " rays"]
    to_tx_m: Float[np.ndarray, "rays 2"]  # from the receiver to the image of the transmitter
    to_rx_m: Float[np.ndarray, "rays 2"]  # from the transmitter to the image of the receiver
    length_m: Float[np.ndarray, " rays"]
    cos_incidence: Float[np.ndarray, " rays"]
    hit_m: Float[np.ndarray, "rays 2"]  # where it meets the face; halfway on the line of sight

    def only(self, keep: Bool[np.ndarray, " rays"]) -> "_Rays":
        """The rays that are kept."""
        return _Rays(*(column[keep] for column in self))


def surfaces_of(
    walls_m: Float[np.ndarray, "walls 2 2"],
    obstacles_m: Sequence[Float[np.ndarray, "_ 2"]] = (),
    *,
    carrier_hz: float,
    wall: Slab | Sequence[Slab],
    obstacle: Slab | Sequence[Slab] = (),
) -> Surfaces:
    """Faces of a convex room and the obstacles in it.

    Args:
        walls_m: Outer walls, m, in any order and direction.
        obstacles_m: Corners of each obstacle, m, counter-clockwise.
        carrier_hz: Frequency at which the materials are taken.
        wall: What the walls are made of; one for all, or one each.
        obstacle: What the faces of the obstacles are made of; one for all, or one per obstacle.

    Returns:
        The scene for `trace_paths`.

    Raises:
        ValueError: If an obstacle is clockwise, a room not convex, a face without length, or
            the number of slabs does not fit.
    """
    for index, corners_m in enumerate(obstacles_m):
        area_m2 = 0.5 * float(cross(corners_m, np.roll(corners_m, -1, axis=0)).sum())
        require(area_m2 >= 0.0, f"obstacles_m[{index}]", "counter-clockwise", corners_m.tolist())
    per_obstacle = _one_each(obstacle, len(obstacles_m), "obstacle")
    slabs = _one_each(wall, len(walls_m), "wall")
    slabs += [slab for slab, corners_m in zip(per_obstacle, obstacles_m, strict=True) for _ in corners_m]
    permittivity = [relative_permittivity(MATERIALS[slab.material], carrier_hz) for slab in slabs]
    return Surfaces(
        ends_m=np.concatenate([walls_m, *map(polygon_edges, obstacles_m)]),
        permittivity=np.array(permittivity, dtype=complex),
        thickness_m=np.array([slab.thickness_m for slab in slabs], dtype=float),
        n_walls=len(walls_m),
    )


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
    _check_links(tx_m, rx_m)
    rays = _rays(tx_m, rx_m, surfaces, n_faces=1 + max_order * len(surfaces.ends_m))
    gain = np.ones(len(rays.link), dtype=complex)
    if surfaces.n_walls < len(surfaces.ends_m):
        gain = _through(rays, tx_m, rx_m, surfaces, carrier_hz=carrier_hz, penetration=penetration)
        rays, gain = rays.only(gain != 0.0), gain[gain != 0.0]
    bounced = rays.face > 0
    face = rays.face[bounced] - 1
    gain[bounced] *= slab_reflection(
        surfaces.permittivity[face], surfaces.thickness_m[face], rays.cos_incidence[bounced], carrier_hz
    )
    wavelength_m = SPEED_OF_LIGHT_M_S / carrier_hz
    turns = rays.length_m / wavelength_m
    gain *= np.exp(-2j * np.pi * turns) / (4.0 * np.pi * turns)
    return _padded(rays, gain, n_links=len(tx_m))


def reverse(paths: Paths) -> Paths:
    """Paths of the links with transmitter and receiver swapped."""
    return paths._replace(azimuth_rx_rad=paths.azimuth_tx_rad, azimuth_tx_rad=paths.azimuth_rx_rad)


def _one_each(slabs: Slab | Sequence[Slab], count: int, name: str) -> list[Slab]:
    """One slab per place, from one for all or a list of the right length."""
    if isinstance(slabs, Slab):
        return [slabs] * count
    require(len(slabs) == count, f"number of {name} slabs", f"{count}", len(slabs))
    return list(slabs)


def _turn_inwards(normal: Float[np.ndarray, "walls 2"], walls_m: Float[np.ndarray, "walls 2 2"]) -> None:
    """Flip, in place, the normals of walls that point out of the room; refuse a room that is not convex."""
    middle_m = walls_m.reshape(-1, 2).mean(axis=0) if len(walls_m) else np.zeros(2)
    normal *= np.where(((middle_m - walls_m[:, 0]) * normal).sum(-1) < 0.0, -1.0, 1.0)[:, None]
    height_m = np.einsum("fk,fwek->fwe", normal, walls_m[None] - walls_m[:, None, :1])
    lowest_m = float(height_m.min(initial=0.0))
    require(lowest_m >= -1e-6, "Surfaces.ends_m", "a convex room in its first n_walls faces", lowest_m)


def _affine(
    axis: Float[np.ndarray, "faces 2"], base_m: Float[np.ndarray, "faces 2"], *, at_sight: float
) -> Float[np.ndarray, "3 faces+1"]:
    """Columns that take ``(x, y, 1)`` to ``axis . (p - base)``, after one that is ``at_sight`` everywhere."""
    columns = np.concatenate([axis, -(axis * base_m).sum(-1, keepdims=True)], axis=1)
    return np.concatenate([[[0.0, 0.0, at_sight]], columns]).T.copy()


def _check_links(tx_m: Float[np.ndarray, "links 2"], rx_m: Float[np.ndarray, "links 2"]) -> None:
    """Refuse ends that are not finite or coincide."""
    for name, ends_m in (("tx_m", tx_m), ("rx_m", rx_m)):
        if not np.isfinite(ends_m).all():
            index = int(np.argmin(np.isfinite(ends_m).all(axis=1)))
            raise ValueError(f"{name} must be finite, got {ends_m[index].tolist()} at link {index}")
    same = (tx_m == rx_m).all(axis=1)
    if same.any():
        index = int(np.argmax(same))
        raise ValueError(f"tx_m and rx_m must differ, both are {tx_m[index].tolist()} at link {index}")


def _with_one(p_m: Float[np.ndarray, "points 2"]) -> Float[np.ndarray, "points 3"]:
    """Points as ``(x, y, 1)``."""
    out = np.ones((len(p_m), 3))
    out[:, :2] = p_m
    return out


def _rays(
    tx_m: Float[np.ndarray, "links 2"],
    rx_m: Float[np.ndarray, "links 2"],
    surfaces: Surfaces,
    *,
    n_faces: int,
) -> _Rays:
    """Every line of sight and reflection that exists if nothing stands in the way.

    A face reflects when both ends are in front of it and the straight line from one end
    to the image of the other passes between the ends of the face.
    """
    tx, rx = _with_one(tx_m), _with_one(rx_m)
    to_along, to_height = surfaces.to_along[:, :n_faces], surfaces.to_height[:, :n_faces]
    height_tx, height_rx = tx @ to_height, rx @ to_height
    total = height_tx + height_rx
    weighted = (tx @ to_along) * height_rx + (rx @ to_along) * height_tx  # along at the hit, times total
    on_face = (weighted >= 0.0) & (weighted < surfaces.length_m[:n_faces] * total)
    link, face = np.nonzero(on_face & (height_tx > 0.0) & (height_rx > 0.0))
    up_tx, up_rx, up = height_tx[link, face], height_rx[link, face], total[link, face]
    normal, gap_m = surfaces.normal[face], (tx_m - rx_m)[link]
    to_tx_m = gap_m - (2.0 * up_tx)[:, None] * normal
    to_rx_m = -gap_m - (2.0 * up_rx)[:, None] * normal
    length_m = np.sqrt(to_tx_m[:, 0] ** 2 + to_tx_m[:, 1] ** 2)
    hit_m = rx_m[link] + (up_rx / up)[:, None] * to_tx_m
    return _Rays(link, face, to_tx_m, to_rx_m, length_m, np.minimum(up / length_m, 1.0), hit_m)


def _through(
    rays: _Rays,
    tx_m: Float[np.ndarray, "links 2"],
    rx_m: Float[np.ndarray, "links 2"],
    surfaces: Surfaces,
    *,
    carrier_hz: float,
    penetration: bool,
) -> Complex[np.ndarray, " rays"]:
    """What is left of each ray behind the obstacle faces that it crosses: product of their transmissions."""
    first = surfaces.n_walls
    front_hit = _with_one(rays.hit_m) @ surfaces.to_height[:, first + 1 :] > 0.0
    own = np.flatnonzero(rays.face > first)
    front_hit[own, rays.face[own] - first - 1] = True  # its own face, which both legs end on
    crossed = np.concatenate(
        [
            _crossed(tx_m, rays.to_rx_m, front_hit, rays, surfaces),
            _crossed(rx_m, rays.to_tx_m, front_hit, rays, surfaces),
        ],
        axis=1,
    )
    if not penetration:
        return np.where(crossed.any(axis=1), 0.0, 1.0).astype(complex)
    gain = np.ones(len(crossed), dtype=complex)
    ray, column = np.nonzero(crossed)
    if len(ray):
        n = len(surfaces.ends_m) - first
        leg_m = np.where((column < n)[:, None], rays.to_rx_m[ray], rays.to_tx_m[ray])
        face = first + column % n
        cos_incidence = np.abs((leg_m * surfaces.normal[face + 1]).sum(-1)) / rays.length_m[ray]
        loss = slab_transmission(
            surfaces.permittivity[face], surfaces.thickness_m[face], cos_incidence, carrier_hz
        )
        start = np.flatnonzero(np.diff(ray, prepend=-1))
        gain[ray[start]] = np.multiply.reduceat(loss, start)
    return gain


def _crossed(
    from_m: Float[np.ndarray, "links 2"],
    leg_m: Float[np.ndarray, "rays 2"],
    front_hit: Bool[np.ndarray, "rays obstacles"],
    rays: _Rays,
    surfaces: Surfaces,
) -> Bool[np.ndarray, "rays obstacles"]:
    """Which obstacle faces lie across the leg of each ray from its end to the hit.

    The ends of the leg are on different sides of the face, and the ends of the face on
    different sides of the leg.
    """
    first = surfaces.n_walls
    front = (_with_one(from_m) @ surfaces.to_height[:, first + 1 :] > 0.0)[rays.link]
    line = np.stack([-leg_m[:, 1], leg_m[:, 0], -cross(leg_m, from_m[rays.link])], axis=1)
    left = (line @ _with_one(surfaces.ends_m[first:].reshape(-1, 2)).T > 0.0).reshape(len(line), -1, 2)
    return (front != front_hit) & (left[..., 0] != left[..., 1])


def _padded(rays: _Rays, gain: Complex[np.ndarray, " rays"], *, n_links: int) -> Paths:
    """Rays, sorted by link, as rows of equal length."""
    count = np.bincount(rays.link, minlength=n_links)
    n_paths = max(1, int(count.max(initial=0)))
    place = rays.link * n_paths + np.arange(len(gain)) - (np.cumsum(count) - count)[rays.link]

    def rows(values: np.ndarray, fill: complex) -> np.ndarray:
        out = np.full(n_links * n_paths, fill, dtype=values.dtype)
        out[place] = values
        return out.reshape(n_links, n_paths)

    return Paths(
        gain=rows(gain, 0.0),
        delay_s=rows(rays.length_m / SPEED_OF_LIGHT_M_S, 0.0),
        azimuth_rx_rad=rows(np.arctan2(rays.to_tx_m[:, 1], rays.to_tx_m[:, 0]), 0.0),
        azimuth_tx_rad=rows(np.arctan2(rays.to_rx_m[:, 1], rays.to_rx_m[:, 0]), 0.0),
        order=rows((rays.face > 0).astype(np.int64), -1),
    )
