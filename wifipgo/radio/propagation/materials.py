"""Walls as dielectric slabs: ITU-R P.2040 materials, and what a slab reflects and lets through.

The field is vertical, so it is perpendicular to the plane of incidence on every wall
(TE). Time factor ``exp(+j 2 pi f t)``: a lossy permittivity has a negative imaginary part.
"""

import functools
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from jaxtyping import Complex, Float

from wifipgo.arithmetic import harmless_underflow
from wifipgo.errors import pick, require, require_within

SPEED_OF_LIGHT_M_S = 299_792_458.0
VACUUM_PERMITTIVITY_F_M = 8.8541878128e-12
# What a scene's frequencies, slabs and permittivities may be; beyond, there are no walls and no digits.
CARRIER_LIMITS_HZ = (1e3, 1e15)
THICKNESS_LIMITS_M = (1e-6, 10.0)
MOST_PERMITTIVITY, MOST_LOSS = 1e6, 1e12
# Factors of complex products below have names: numpy works in place of large ones that have none, and may
# round otherwise in place, but a ray is to have the same bits in any company.

# Smallest cosine of incidence: without it a lossless slab would divide nothing by nothing.
_GRAZING = 1e-9


@dataclass(frozen=True, slots=True)
class Material:
    """Constants of a building material: permittivity ``a g^b`` and conductivity ``c g^d`` S/m, g in GHz.

    Attributes:
        a: Relative permittivity at 1 GHz.
        b: Its exponent.
        c: Conductivity at 1 GHz, S/m.
        d: Its exponent.
        lowest_hz: Lowest frequency at which the constants hold.
        highest_hz: Highest frequency at which they hold.
    """

    a: float
    b: float
    c: float
    d: float
    lowest_hz: float = 1e9
    highest_hz: float = 100e9

    def __post_init__(self) -> None:
        """Reject values that cannot mean anything, among them what would amplify."""
        require_within(self, {"a": (1.0, 1e6), "b": (-10.0, 10.0), "c": (0.0, 1e9), "d": (-10.0, 10.0)})
        require_within(self, dict.fromkeys(("lowest_hz", "highest_hz"), CARRIER_LIMITS_HZ))
        holds = self.lowest_hz <= self.highest_hz
        require(holds, "Material.lowest_hz", "<= highest_hz", (self.lowest_hz, self.highest_hz))


# ITU-R P.2040-3 (08/2023), Table 3, with the frequencies for which it gives them.
MATERIALS: Mapping[str, Material] = MappingProxyType(
    {
        "concrete": Material(5.24, 0.0, 0.0462, 0.7822),
        "brick": Material(3.91, 0.0, 0.0238, 0.16, highest_hz=40e9),
        "plasterboard": Material(2.73, 0.0, 0.0085, 0.9395),
        "wood": Material(1.99, 0.0, 0.0047, 1.0718, lowest_hz=1e6),
        "glass": Material(6.31, 0.0, 0.0036, 1.3394, lowest_hz=100e6),
        "chipboard": Material(2.58, 0.0, 0.0217, 0.7800),
        "metal": Material(1.0, 0.0, 1e7, 0.0),
    }
)


@dataclass(frozen=True, slots=True)
class Slab:
    """What a wall is made of: a name in `MATERIALS`, or constants of one's own."""

    material: str | Material = "concrete"
    thickness_m: float = 0.2

    def __post_init__(self) -> None:
        """Reject values that cannot mean anything."""
        if isinstance(self.material, str):
            pick(MATERIALS, self.material, "material")
        require_within(self, {"thickness_m": THICKNESS_LIMITS_M})

    def permittivity(self, carrier_hz: float) -> complex:
        """Complex relative permittivity at a frequency; see `relative_permittivity`."""
        material = MATERIALS[self.material] if isinstance(self.material, str) else self.material
        return relative_permittivity(material, carrier_hz)


@functools.lru_cache(maxsize=256)
def relative_permittivity(material: Material, carrier_hz: float) -> complex:
    """Complex relative permittivity ``a g^b - j sigma / (2 pi f eps0)`` (ITU-R P.2040-3).

    Raises:
        ValueError: If the frequency is outside the range in which the material's constants hold, or they
            give a permittivity there that no building material has.
    """
    holds = bool(material.lowest_hz <= carrier_hz <= material.highest_hz)
    rule = f"in {material.lowest_hz:g}..{material.highest_hz:g} for {material}"
    require(holds, "carrier_hz", rule, carrier_hz)
    g = carrier_hz / 1e9
    conductivity_s_m = material.c * g**material.d
    real = material.a * g**material.b
    loss = conductivity_s_m / (2.0 * np.pi * carrier_hz * VACUUM_PERMITTIVITY_F_M)
    found = complex(real, -loss)
    rule = f"1..{MOST_PERMITTIVITY:g} - j 0..{MOST_LOSS:g} at {carrier_hz:g} Hz"
    require(is_permittivity(found), f"permittivity of {material}", rule, found)
    return found


def is_permittivity(permittivity: Complex[np.ndarray, "*n"] | complex) -> bool:
    """Whether these are relative permittivities of building materials, lossy or not."""
    real, loss = np.real(permittivity), -np.imag(permittivity)
    return bool(np.all((real >= 1.0) & (real <= MOST_PERMITTIVITY) & (loss >= 0.0) & (loss <= MOST_LOSS)))


@harmless_underflow
def slab_reflection(
    permittivity: Complex[np.ndarray, "*n"],
    thickness_m: Float[np.ndarray, "*n"],
    cos_incidence: Float[np.ndarray, "*n"],
    carrier_hz: float,
    *,
    single: bool = False,
) -> Complex[np.ndarray, "*n"]:
    """Reflection coefficient of a slab in air, TE polarisation (single-layer slab of ITU-R P.2040-3).

    ``r (1 - exp(-2jq)) / (1 - r^2 exp(-2jq))``: the sum of all bounces inside the slab.

    Args:
        permittivity: Relative permittivity of each slab.
        thickness_m: Thickness of each slab.
        cos_incidence: Cosine of the angle between ray and normal, in (0, 1]; rounding above 1 or
            down to 0 is borne.
        carrier_hz: Frequency.
        single: Whether single precision will do: phases are still worked out in double.

    Returns:
        Amplitude ratio, complex, at most 1 in modulus.
    """
    r, one_way = _interface(permittivity, thickness_m, cos_incidence, carrier_hz, single=single)
    there_and_back, r2 = one_way * one_way, r * r
    inside, lost = r2 * there_and_back, 1.0 - there_and_back
    reflected = r * lost
    return reflected / (1.0 - inside)


@harmless_underflow
def slab_transmission(
    permittivity: Complex[np.ndarray, "*n"],
    thickness_m: Float[np.ndarray, "*n"],
    cos_incidence: Float[np.ndarray, "*n"],
    carrier_hz: float,
    *,
    single: bool = False,
) -> Complex[np.ndarray, "*n"]:
    """Transmission coefficient of a slab in air, TE polarisation (single-layer slab of ITU-R P.2040-3).

    ``(1 - r^2) exp(-jq) / (1 - r^2 exp(-2jq))``; arguments as in `slab_reflection`. The
    phase ``q`` over the thickness comes on top of that of the straight ray.
    """
    r, one_way = _interface(permittivity, thickness_m, cos_incidence, carrier_hz, single=single)
    r2, there_and_back = r * r, one_way * one_way
    inside, entering = r2 * there_and_back, 1.0 - r2
    through = entering * one_way
    return through / (1.0 - inside)


def _interface(
    permittivity: Complex[np.ndarray, "*n"],
    thickness_m: Float[np.ndarray, "*n"],
    cos_incidence: Float[np.ndarray, "*n"],
    carrier_hz: float,
    *,
    single: bool,
) -> tuple[Complex[np.ndarray, "*n"], Complex[np.ndarray, "*n"]]:
    """Fresnel coefficient of the front side, and the propagation factor ``exp(-jq)`` across the slab."""
    cos_incidence = np.maximum(cos_incidence, _GRAZING)
    s = _root(permittivity.real - 1.0 + cos_incidence * cos_incidence, permittivity.imag)
    depth = (-carrier_hz / SPEED_OF_LIGHT_M_S) * thickness_m  # in wavelengths of the air
    turns, gain = depth * s.real, (-2.0 * np.pi) * (depth * s.imag)
    if single:
        s, cos_incidence, gain = (
            s.astype(np.complex64),
            cos_incidence.astype(np.float32),
            gain.astype(np.float32),
        )
    phasor, loss = unit_phasors(turns, single=single), np.exp(gain)
    return (cos_incidence - s) / (cos_incidence + s), phasor * loss


def unit_phasors(turns: Float[np.ndarray, "*n"], *, single: bool = False) -> Complex[np.ndarray, "*n"]:
    """``exp(2 pi j turns)``: in double by the tangent of half the angle, faster than sine and cosine.

    In single precision whole turns are taken off before, in double.
    """
    rest = turns - np.rint(turns)
    if single:
        rest_rad = np.multiply(rest, 2.0 * np.pi, dtype=np.float32, casting="same_kind")
        narrow = np.empty(rest.shape, dtype=np.complex64)
        np.cos(rest_rad, out=narrow.real)
        np.sin(rest_rad, out=narrow.imag)
        return narrow
    half = np.tan(np.pi * rest)
    square = half * half
    scale = 1.0 / (1.0 + square)
    out = np.empty(rest.shape, dtype=complex)
    np.multiply(1.0 - square, scale, out=out.real)
    np.multiply(2.0 * half, scale, out=out.imag)
    return out


def _root(real: Float[np.ndarray, "*n"], imag: Float[np.ndarray, "*n"]) -> Complex[np.ndarray, "*n"]:
    """Square root of complex numbers whose real part is >= 0, faster than numpy's for all numbers."""
    out = np.empty(real.shape, dtype=complex)
    out.real = np.sqrt(0.5 * (np.sqrt(real * real + imag * imag) + real))
    out.imag = 0.5 * imag / out.real
    return out
