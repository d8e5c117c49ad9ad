"""What stands in the way of rays: obstacle faces across a leg, and what they let through."""

import numpy as np
from jaxtyping import Bool, Complex, Float

from wifipgo.radio.propagation.image_method import Rays
from wifipgo.radio.propagation.materials import slab_transmission
from wifipgo.radio.propagation.surfaces import Surfaces

_QUARTER_TURN = np.array([[-1.0], [1.0]])  # with the coordinates swapped


def crossed(
    rays: Rays,
    ends: Float[np.ndarray, "2 3 links"],
    height_m: Float[np.ndarray, "2 lines links"],
    surfaces: Surfaces,
) -> Bool[np.ndarray, "legs obstacle_faces rays"]:
    """Which obstacle faces lie across which leg of each ray.

    The ends of the leg are on different sides of the face, and the ends of the face on
    different sides of the leg.
    """
    front, outline = _in_front(rays, height_m, surfaces), surfaces.outline
    ends_m = ends[:, :2].take(rays.link, axis=2)
    on_leg_m = np.concatenate([ends_m[:1], rays.hit_m[:-1], ends_m[1:]])
    across = rays.legs_m[:, ::-1] * _QUARTER_TURN
    left = outline.corners_m @ across > (across * on_leg_m).sum(axis=1, keepdims=True)
    separated = left.take(outline.start, axis=1) != left.take(outline.end, axis=1)
    return separated & (front[:-1] != front[1:])


def _in_front(
    rays: Rays, height_m: Float[np.ndarray, "2 lines links"], surfaces: Surfaces
) -> Bool[np.ndarray, "nodes obstacle_faces rays"]:
    """Whether the ends and hits of each ray, from the transmitter on, are in front of each obstacle face."""
    first = surfaces.n_walls + 1
    to_height = surfaces.to_height[first:]
    front = np.empty((len(rays.face) + 2, len(to_height), len(rays.link)), dtype=bool)
    front[:: len(front) - 1] = (height_m[:, first:] > 0.0).take(rays.link, axis=2)
    np.greater(to_height[:, :2] @ rays.hit_m, -to_height[:, 2:], out=front[1:-1])
    own = np.flatnonzero(rays.face >= first)
    face = rays.face.ravel().take(own) - first
    front[1:-1, face, own % max(1, len(rays.link))] = True  # a ray stays in front of what it bounces off
    if surfaces.coplanar is not None:  # and on its side of all that touches it in the same plane
        for at, bounced in zip(front[1:-1], rays.face, strict=True):
            ray, other, alike = surfaces.coplanar.beside(bounced)
            at[other, ray] = alike
    return front


def transmission(
    across: Bool[np.ndarray, "legs obstacle_faces rays"], rays: Rays, surfaces: Surfaces, carrier_hz: float
) -> Complex[np.ndarray, " rays"]:
    """Product of the transmission coefficients of all obstacle faces that each ray crosses."""
    out = np.ones(across.shape[2], dtype=complex)
    place, ray = np.divmod(np.flatnonzero(across), across.shape[2])
    if len(ray):
        leg, face = np.divmod(place, across.shape[1])
        face += surfaces.n_walls
        x_m, y_m = rays.legs_m.swapaxes(0, 1).reshape(2, -1).take(leg * across.shape[2] + ray, axis=1)
        normal_x, normal_y = surfaces.normal.take(face + 1, axis=1)
        each = slab_transmission(
            surfaces.permittivity.take(face),
            surfaces.thickness_m.take(face),
            np.abs(x_m * normal_x + y_m * normal_y) / rays.length_m.take(ray),
            carrier_hz,
        )
        np.multiply.at(out, ray, each)
    return out
