"""A second path tracer, slow and scalar: one link, one sequence of faces, one leg at a time.

Written from the formulas alone, with points as complex numbers and nothing taken from the
package, so that an error would have to be made twice.
"""

import cmath
import itertools
import math
from dataclasses import dataclass

C_M_S = 299_792_458.0


@dataclass(frozen=True)
class Face:
    """A face seen from its front with its start on the right; ``blocks`` if rays have to cross it."""

    start: complex
    end: complex
    permittivity: complex
    thickness_m: float
    blocks: bool


@dataclass(frozen=True)
class Path:
    """One path as the corners that it turns at."""

    nodes: tuple[complex, ...]
    gain: complex

    @property
    def order(self) -> int:
        """Number of reflections."""
        return len(self.nodes) - 2

    @property
    def length_m(self) -> float:
        """Length of all legs."""
        return sum(abs(b - a) for a, b in itertools.pairwise(self.nodes))

    @property
    def azimuth_tx_rad(self) -> float:
        """Direction in which it leaves the transmitter."""
        return cmath.phase(self.nodes[1] - self.nodes[0])

    @property
    def azimuth_rx_rad(self) -> float:
        """Direction from the receiver towards where it arrives from."""
        return cmath.phase(self.nodes[-2] - self.nodes[-1])


def all_paths(
    tx: complex, rx: complex, faces: list[Face], *, carrier_hz: float, max_order: int, penetration: bool
) -> list[Path]:
    """Every path of a link, by order and delay; those that nothing is left of are left out."""
    found = []
    for order in range(max_order + 1):
        for sequence in itertools.product(faces, repeat=order):
            nodes = reflected(tx, rx, sequence)
            if nodes is not None:
                gain = gain_along(nodes, sequence, faces, carrier_hz, penetration)
                found += [Path(nodes, gain)] if gain != 0.0 else []
    return sorted(found, key=lambda path: (path.order, path.length_m))


def reflected(tx: complex, rx: complex, sequence: tuple[Face, ...]) -> tuple[complex, ...] | None:
    """Transmitter, hits and receiver of a path that bounces off these faces in turn, if there is one."""
    images = [tx]
    for face in sequence:
        images.append(mirrored(images[-1], face))
    nodes = [rx]
    for face, image in zip(reversed(sequence), reversed(images), strict=False):
        met = crossing(image, nodes[0], face)
        if met is None:
            return None
        nodes.insert(0, image + met * (nodes[0] - image))
    nodes.insert(0, tx)
    for k, face in enumerate(sequence):
        if not (in_front(nodes[k], face) and in_front(nodes[k + 2], face)):
            return None
    return tuple(nodes)


def mirrored(point: complex, face: Face) -> complex:
    along = face.end - face.start
    return face.start + ((point - face.start) / along).conjugate() * along


def in_front(point: complex, face: Face) -> bool:
    return ((point - face.start) / (face.end - face.start)).imag < 0.0


def crossing(start: complex, end: complex, face: Face) -> float | None:
    """Share of the way from start to end at which it crosses the face, if it does."""
    a, b = ((point - face.start) / (face.end - face.start) for point in (start, end))
    if (a.imag < 0.0) == (b.imag < 0.0):
        return None
    share = a.imag / (a.imag - b.imag)
    return share if 0.0 <= (a + share * (b - a)).real < 1.0 else None


def gain_along(
    nodes: tuple[complex, ...],
    sequence: tuple[Face, ...],
    faces: list[Face],
    carrier_hz: float,
    penetration: bool,
) -> complex:
    """Free-space spreading, a reflection at each hit and a transmission at each face crossed."""
    length_m = sum(abs(b - a) for a, b in itertools.pairwise(nodes))
    wavelengths = length_m * carrier_hz / C_M_S
    gain = cmath.exp(-2j * math.pi * wavelengths) / (4.0 * math.pi * wavelengths)
    for leg, (a, b) in enumerate(itertools.pairwise(nodes)):
        if leg < len(sequence):
            gain *= slab(sequence[leg], b - a, carrier_hz)[0]
        for face in faces:
            ends_here = face in sequence[max(leg - 1, 0) : leg + 1]
            if face.blocks and not ends_here and crossing(a, b, face) is not None:
                gain *= slab(face, b - a, carrier_hz)[1] if penetration else 0.0
    return gain


def slab(face: Face, ray: complex, carrier_hz: float) -> tuple[complex, complex]:
    """Reflection and transmission coefficient by the angle between the ray and the face."""
    angle_to_face = cmath.phase(ray / (face.end - face.start))
    incidence = math.asin(abs(math.cos(angle_to_face)))
    root = cmath.sqrt(face.permittivity - math.sin(incidence) ** 2)
    r = (math.cos(incidence) - root) / (math.cos(incidence) + root)
    phase = cmath.exp(-2j * math.pi * carrier_hz / C_M_S * face.thickness_m * root)
    below = 1.0 - r**2 * phase**2
    return r * (1.0 - phase**2) / below, (1.0 - r**2) * phase / below
