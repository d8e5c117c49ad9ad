"""Rays that bend once, at an edge: which there are, how long, and what is left of them."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Complex, Float, Int

from wifipgo.radio.propagation.diffraction import diffraction_factor
from wifipgo.radio.propagation.edges import edges_of, points_at
from wifipgo.radio.propagation.image_method import Ends, Rays, course_of
from wifipgo.radio.propagation.link_ends import Points
from wifipgo.radio.propagation.materials import (
    SPEED_OF_LIGHT_M_S,
    slab_reflection,
    slab_transmission,
)
from wifipgo.radio.propagation.obstruction import crossed, transmission
from wifipgo.radio.propagation.ray_gains import Medium, spreading
from wifipgo.radio.propagation.scenes import Scenes

# Rays that bend at an edge, in the column `Paths.order`.
DIFFRACTED = 8
# Faces times legs looked at in one go.
_BLOCK = 1 << 16


class EdgeViews(NamedTuple):
    """Edges as each point sees them.

    Attributes:
        seen: Whether something of a ray from the edge arrives.
        angle_rad: Angle of the point about the edge, as in `Edges`.
        distance_m: Distance.
        through: What the obstacles in between let through.
    """

    seen: Bool[np.ndarray, "edges points"]
    angle_rad: Float[np.ndarray, "edges points"]
    distance_m: Float[np.ndarray, "edges points"]
    through: Complex[np.ndarray, "edges points"]

    def some(self, chosen: slice | Int[np.ndarray, " some"]) -> "EdgeViews":
        """Views of some of the points, in this order."""
        return EdgeViews(*(column[:, chosen] for column in self))


class EdgeRays(NamedTuple):
    """Rays by edge and then by link.

    Attributes:
        link: Link that each belongs to.
        edge: Edge at which it bends.
        length_m: Length of both legs.
    """

    link: Int[np.ndarray, " rays"]
    edge: Int[np.ndarray, " rays"]
    length_m: Float[np.ndarray, " rays"]

    def only(self, kept: Int[np.ndarray, " kept"]) -> "EdgeRays":
        """Some of the rays."""
        return EdgeRays(*(column.take(kept) for column in self))


def edge_views(points: Points, medium: Medium) -> EdgeViews:
    """Which edges each point sees, from where, and through what."""
    scenes = medium.scenes
    edges = edges_of(scenes)
    at_m, along, open_rad = (scenes.by_world(column, points.world) for column in edges[:3])
    x_m, y_m = points.at_m[:, None] - at_m
    ahead_m, left_m = along[0] * x_m + along[1] * y_m, along[0] * y_m - along[1] * x_m
    angle_rad = np.mod(np.arctan2(left_m, ahead_m), 2.0 * np.pi)
    seen = (angle_rad > 0.0) & (angle_rad < open_rad)
    through = np.ones(seen.shape, dtype=complex)
    views = EdgeViews(seen, angle_rad, np.sqrt(x_m * x_m + y_m * y_m), through)
    legs = np.flatnonzero(seen)
    step = max(1, _BLOCK // len(edges.beside)) if len(edges.beside) else 1
    for begin in range(0, len(legs), step):
        _obstruct(views, legs[begin : begin + step], points, medium)
    return views


def _obstruct(views: EdgeViews, legs: Int[np.ndarray, " legs"], points: Points, medium: Medium) -> None:
    """Note, in place, what stands in the way of some legs: lines of sight between a point and an edge.

    The faces that meet at the edge do not: a leg through the open touches them there alone.
    """
    scenes, n = medium.scenes, views.seen.shape[1]
    edge, point = np.divmod(legs, n)
    at = scenes.at(edge, points.world.take(point))
    ends = Ends.of(points.some(point), points_at(scenes).some(at))
    straight = np.zeros((1, len(legs)), dtype=np.int64)
    rays = Rays(np.arange(len(legs)), straight, straight + 1.0, views.distance_m.take(legs))
    course = course_of(rays, ends, scenes)
    across = crossed(rays, course, ends, scenes)
    across &= ~edges_of(scenes).beside.reshape(across.shape[1], -1).take(at, axis=1)
    if not medium.penetration:
        views.seen.reshape(-1)[legs[across.any(axis=(0, 1))]] = False
        return
    views.through.reshape(-1)[legs] = transmission(
        across,
        rays,
        course,
        world=ends.tx.world,
        scenes=scenes,
        carrier_hz=medium.carrier_hz,
        single=medium.single,
    )


def edge_rays(
    views: tuple[EdgeViews, EdgeViews], ends: Ends, medium: Medium
) -> tuple[EdgeRays, Complex[np.ndarray, " _"]]:
    """Rays of links over every edge that both ends see, and their gains.

    Args:
        views: What transmitters and receivers see.
        ends: The links.
        medium: What they are in.
    """
    both = np.flatnonzero(views[0].seen & views[1].seen)
    edge, link = np.divmod(both, max(1, ends.n_links))
    tx, rx = (EdgeViews(*(column.take(both) for column in view)) for view in views)
    length_m = tx.distance_m + rx.distance_m
    factor = _factor(tx, rx, medium.scenes.at(edge, ends.tx.world.take(link)), medium)
    through = tx.through * rx.through
    kept = factor * through
    free = spreading(length_m * (medium.carrier_hz / SPEED_OF_LIGHT_M_S), single=medium.single)
    gains = free * kept.astype(free.dtype, copy=False)
    left = gains.nonzero()[0]
    return EdgeRays(link, edge, length_m).only(left), gains.take(left)


def _factor(
    tx: EdgeViews, rx: EdgeViews, at: Int[np.ndarray, " rays"], medium: Medium
) -> Complex[np.ndarray, " rays"]:
    """What an edge makes of a field, over that of free space; face 0 is the one nearer to the transmitter."""
    scenes, edges, carrier_hz = medium.scenes, edges_of(medium.scenes), medium.carrier_hz
    open_rad, ending, beginning = (
        column.ravel().take(at) for column in (edges.open_rad, edges.ending, edges.beginning)
    )
    swap = 2.0 * tx.angle_rad > open_rad
    tx_rad, rx_rad = (np.where(swap, open_rad - end.angle_rad, end.angle_rad) for end in (tx, rx))
    faces = np.where(swap, [beginning, ending], [ending, beginning])
    line = scenes.at(faces, at % scenes.n_worlds)
    slabs = (
        scenes.permittivity.ravel().take(line),
        scenes.thickness_m.ravel().take(line),
        np.abs(np.sin([tx_rad, open_rad - rx_rad])),
        carrier_hz,
    )
    reflection_0, reflection_n = slab_reflection(*slabs)
    distance_m = tx.distance_m * rx.distance_m / (tx.distance_m + rx.distance_m)
    return diffraction_factor(
        tx_rad,
        rx_rad,
        open_rad,
        (2.0 * np.pi * carrier_hz / SPEED_OF_LIGHT_M_S) * distance_m,
        reflection_0=reflection_0,
        reflection_n=reflection_n,
        blocked=_blocked(*slab_transmission(*slabs)) if medium.penetration else 1.0,
    )


def _blocked(
    through_0: Complex[np.ndarray, " rays"], through_n: Complex[np.ndarray, " rays"]
) -> Complex[np.ndarray, " rays"]:
    """Share of the direct field that ends at an edge: what both faces let through goes on behind it."""
    through = through_0 * through_n
    return 1.0 - through


def directions_of(
    rays: EdgeRays, ends: Ends, scenes: Scenes
) -> tuple[Float[np.ndarray, "2 rays"], Float[np.ndarray, "2 rays"]]:
    """Ways from the transmitter and from the receiver to the edge, m."""
    at = scenes.at(rays.edge, ends.tx.world.take(rays.link))
    edge_m = points_at(scenes).at_m.take(at, axis=1)
    tx_m, rx_m = (end.at_m.take(rays.link, axis=1) for end in (ends.tx, ends.rx))
    return edge_m - tx_m, edge_m - rx_m
