"""What is left of rays: spreading, reflections, and transmissions through what stands in the way."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float

from wifipgo.errors import require
from wifipgo.radio.propagation.image_method import Ends, Rays, course_of
from wifipgo.radio.propagation.materials import (
    CARRIER_LIMITS_HZ,
    SPEED_OF_LIGHT_M_S,
    slab_reflection,
    unit_phasors,
)
from wifipgo.radio.propagation.obstruction import crossed, transmission
from wifipgo.radio.propagation.scenes import Scenes


class Medium(NamedTuple):
    """What rays are traced through, and how far.

    Attributes:
        scenes: What stands where.
        carrier_hz: Frequency.
        max_order: Most reflections of a path: 0, 1 or 2.
        penetration: Whether a ray goes on, weaker, through obstacles that it meets.
        diffraction: Whether a ray may bend once, at an edge of an obstacle.
        single: Whether gains in single precision will do; lengths and phases are worked out in double.
    """

    scenes: Scenes
    carrier_hz: float
    max_order: int
    penetration: bool
    diffraction: bool = False
    single: bool = False

    def check(self) -> None:
        """Refuse an order or a frequency that is none."""
        require(self.max_order in {0, 1, 2}, "max_order", "0, 1 or 2", self.max_order)
        lowest_hz, highest_hz = CARRIER_LIMITS_HZ
        within = bool(lowest_hz <= self.carrier_hz <= highest_hz)
        require(within, "carrier_hz", f"in {lowest_hz:g}..{highest_hz:g}", self.carrier_hz)


def gained(rays: Rays, ends: Ends, medium: Medium) -> tuple[Rays, Complex[np.ndarray, " _"]]:
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
    gain = spreading(rays.length_m * (medium.carrier_hz / SPEED_OF_LIGHT_M_S), single=single)
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


def spreading(wavelengths: Float[np.ndarray, " rays"], *, single: bool) -> Complex[np.ndarray, " rays"]:
    """Free-space amplitude and phase over a distance in wavelengths."""
    phasor = unit_phasors(-wavelengths, single=single)
    amplitude = (0.25 / np.pi / wavelengths).astype(phasor.real.dtype, copy=False)
    return phasor * amplitude
