"""What stands in the way of rays: obstacle faces across a leg, and what they let through."""

import numpy as np
from jaxtyping import Bool, Complex, Int

from wifipgo.radio.propagation.image_method import Course, Ends, Rays
from wifipgo.radio.propagation.materials import slab_transmission
from wifipgo.radio.propagation.scenes import Scenes


def crossed(
    rays: Rays, course: Course, ends: Ends, scenes: Scenes
) -> Bool[np.ndarray, "legs obstacle_faces rays"]:
    """Which obstacle faces lie across which leg of each ray.

    The ends of the leg are on different sides of the face, and the ends of the face on
    different sides of the leg.
    """
    front, outline = _in_front(rays, course, ends, scenes), scenes.outline
    world = scenes.of_some(ends.tx.world, rays.link)
    tx_m, rx_m = (end.at_m.take(rays.link, axis=1) for end in (ends.tx, ends.rx))
    on_leg_m = np.concatenate([tx_m[None], course.hit_m[:-1], rx_m[None]])
    x_m, y_m = -course.legs_m[:, 1], course.legs_m[:, 0]  # across each leg
    corner_x_m, corner_y_m = scenes.by_world(outline.corners_m, world)
    beyond = corner_x_m * x_m[:, None]
    beyond += corner_y_m * y_m[:, None]
    left = beyond > (x_m * on_leg_m[:, 0] + y_m * on_leg_m[:, 1])[:, None]
    if scenes.n_worlds == 1:
        start, end = (left.take(corner[:, 0], axis=1) for corner in (outline.start, outline.end))
    else:
        n, flat = left.shape[2], left.reshape(len(left), -1)
        corners = (scenes.by_world(n * corner, world) for corner in (outline.start, outline.end))
        start, end = (flat.take(corner + np.arange(n), axis=1) for corner in corners)
    return (start != end) & (front[:-1] != front[1:])


def _in_front(
    rays: Rays, course: Course, ends: Ends, scenes: Scenes
) -> Bool[np.ndarray, "nodes obstacle_faces rays"]:
    """Whether the ends and hits of each ray, from the transmitter on, are in front of each obstacle face."""
    first, world = scenes.n_walls + 1, scenes.of_some(ends.tx.world, rays.link)
    x, y, base_m = scenes.by_world(scenes.to_height[:, first:], world)
    front = np.empty((len(rays.face) + 2, len(x), len(rays.link)), dtype=bool)
    for at, end in ((0, ends.tx), (-1, ends.rx)):
        front[at] = (end.height_m[first:] > 0.0).take(rays.link, axis=1)
    hit_x_m, hit_y_m = course.hit_m[:, 0, None], course.hit_m[:, 1, None]
    np.greater(x * hit_x_m + y * hit_y_m, -base_m, out=front[1:-1])
    own = np.flatnonzero(rays.face >= first)
    face = rays.face.ravel().take(own) - first
    front[1:-1, face, own % max(1, len(rays.link))] = True  # a ray stays in front of what it bounces off
    if scenes.coplanar is not None:  # and on its side of all that touches it in the same plane
        for at, bounced in zip(front[1:-1], rays.face, strict=True):
            ray, other, alike = scenes.coplanar.beside(scenes.at(bounced, world))
            at[other, ray] = alike
    return front


def transmission(
    across: Bool[np.ndarray, "legs obstacle_faces rays"],
    rays: Rays,
    course: Course,
    *,
    world: Int[np.ndarray, " rays"],
    scenes: Scenes,
    carrier_hz: float,
    single: bool,
) -> Complex[np.ndarray, " rays"]:
    """Product of the transmission coefficients of all obstacle faces that each ray crosses."""
    out = np.ones(across.shape[2], dtype=np.complex64 if single else complex)
    place, ray = np.divmod(np.flatnonzero(across), max(1, across.shape[2]))
    if len(ray):
        leg, face = np.divmod(place, across.shape[1])
        at = scenes.at(face + scenes.n_walls + 1, world.take(ray))
        x_m, y_m = course.legs_m.swapaxes(0, 1).reshape(2, -1).take(leg * across.shape[2] + ray, axis=1)
        normal_x, normal_y = scenes.normal_at(at)
        each = slab_transmission(
            scenes.permittivity.ravel().take(at),
            scenes.thickness_m.ravel().take(at),
            np.abs(x_m * normal_x + y_m * normal_y) / rays.length_m.take(ray),
            carrier_hz,
            single=single,
        )
        np.multiply.at(out, ray, each)
    return out
