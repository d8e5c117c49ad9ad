"""The static scene as the radio sees it: flat faces with a front side, and what they are made of."""

import functools
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Complex, Float

from wifipgo.errors import require
from wifipgo.radio.propagation.coplanar import Coplanar, coplanar_faces
from wifipgo.radio.propagation.face_pairs import FacePairs, face_pairs
from wifipgo.radio.propagation.materials import THICKNESS_LIMITS_M, Slab, is_permittivity
from wifipgo.radio.propagation.outline import Outline, facing_inwards, is_convex, outline_of
from wifipgo.segments import cross, polygon_edges

# Beyond these, heights and positions along faces lose their digits.
FARTHEST_M, _SHORTEST_M = 1e7, 1e-9
# Double reflections are tried pair by pair; so many faces have a million pairs.
_MOST_FACES_TWICE = 2_000


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Surfaces:
    """Faces of a room and its obstacles, with what every call needs worked out once.

    For each face, a point has a position along it and a height over its front side. Both are
    affine, so one matrix product gives them for all faces and points. The derived arrays
    are about ``lines``: first the line of sight, as a face without end and without normal 1 m
    below every point, then the faces.

    Attributes:
        ends_m: Both ends of every face, m.
        permittivity: Complex relative permittivity of every face at the carrier.
        thickness_m: Thickness of the slab behind every face, m.
        n_walls: The first ``n_walls`` faces are the outer walls of a convex room: their inner
            side reflects and, with every robot inside, they never stand in the way. The other
            faces belong to obstacles, counter-clockwise, so their front is on the right, or
            are the walls of a room that is not convex, clockwise.
        normal: Unit vector out of the front of each face (derived).
        to_along: Rows that take ``(x, y, 1)`` to the position along each face, m (derived).
        to_height: Rows that take ``(x, y, 1)`` to the height over each face, m (derived).
        length_m: Length of each face, m (derived).
        outline: Corners and winding of the faces that are not outer walls (derived).
        coplanar: Faces that touch in one plane, as those of obstacles that touch; None without (derived).
    """

    ends_m: Float[np.ndarray, "faces 2 2"]
    permittivity: Complex[np.ndarray, " faces"]
    thickness_m: Float[np.ndarray, " faces"]
    n_walls: int
    normal: Float[np.ndarray, "2 lines"] = field(init=False, repr=False)
    to_along: Float[np.ndarray, "lines 3"] = field(init=False, repr=False)
    to_height: Float[np.ndarray, "lines 3"] = field(init=False, repr=False)
    length_m: Float[np.ndarray, " lines"] = field(init=False, repr=False)
    outline: Outline = field(init=False, repr=False)
    coplanar: Coplanar | None = field(init=False, repr=False)

    def __post_init__(self) -> None:
        """Refuse faces without length and rooms that are not convex; work out the derived arrays."""
        require(0 <= self.n_walls <= len(self.ends_m), "Surfaces.n_walls", "in 0..faces", self.n_walls)
        rule = f"finite and at most {FARTHEST_M:g}"
        require(bool((np.abs(self.ends_m) <= FARTHEST_M).all()), "Surfaces.ends_m", rule, self.ends_m)
        self._check_slabs()
        base_m, edge_m = self.ends_m[:, 0], self.ends_m[:, 1] - self.ends_m[:, 0]
        length_m = np.hypot(edge_m[:, 0], edge_m[:, 1])
        rule = f"faces of at least {_SHORTEST_M:g} m"
        require(bool(np.all(length_m >= _SHORTEST_M)), "Surfaces.ends_m", rule, length_m)
        direction = edge_m / length_m[:, None]
        normal = np.stack([direction[:, 1], -direction[:, 0]], axis=-1)
        walls_m = self.ends_m[: self.n_walls]
        require(
            is_convex(walls_m),
            "Surfaces.ends_m",
            "a convex room in its first n_walls faces",
            walls_m.tolist(),
        )
        _turn_inwards(normal[: self.n_walls], walls_m)
        put = object.__setattr__  # the way to derive fields of a frozen dataclass
        put(self, "normal", np.concatenate([np.zeros((2, 1)), normal.T], axis=1))
        put(self, "to_along", _affine(direction, base_m, at_sight=0.0))
        put(self, "to_height", _affine(normal, base_m, at_sight=1.0))
        put(self, "length_m", np.concatenate([[np.inf], length_m]))
        put(self, "outline", outline_of(self.ends_m[self.n_walls :]))
        put(self, "coplanar", coplanar_faces(self.ends_m, self.normal.T[1:], self.n_walls))

    @property
    def pairs(self) -> FacePairs:
        """Faces that can reflect into each other, worked out when first asked for: only order 2 needs them.

        Raises:
            ValueError: There are too many faces: their pairs would fill the memory.
        """
        rule = f"at most 1 in a scene of more than {_MOST_FACES_TWICE} faces"
        require(len(self.ends_m) <= _MOST_FACES_TWICE, "max_order", rule, f"2 with {len(self.ends_m)}")
        return _pairs_of(self)

    def _check_slabs(self) -> None:
        """Refuse slabs that are none."""
        low, high = THICKNESS_LIMITS_M
        real = bool(((self.thickness_m >= low) & (self.thickness_m <= high)).all())
        require(real, "Surfaces.thickness_m", f"all in {low:g}..{high:g}", self.thickness_m)
        rule = "real part >= 1, imaginary part <= 0, finite"
        require(is_permittivity(self.permittivity), "Surfaces.permittivity", rule, self.permittivity)


@functools.lru_cache(maxsize=4)
def _pairs_of(surfaces: Surfaces) -> FacePairs:
    return face_pairs(surfaces.ends_m, surfaces.to_along, surfaces.to_height)


def surfaces_of(
    walls_m: Float[np.ndarray, "walls 2 2"],
    obstacles_m: Sequence[Float[np.ndarray, "_ 2"]] = (),
    *,
    carrier_hz: float,
    wall: Slab | Sequence[Slab],
    obstacle: Slab | Sequence[Slab] = (),
) -> Surfaces:
    """Faces of a room and the obstacles in it.

    Args:
        walls_m: Outer walls, m, in any order and direction; closed if the room is not convex.
        obstacles_m: Corners of each obstacle, m, counter-clockwise.
        carrier_hz: Frequency at which the materials are taken.
        wall: What the walls are made of; one for all, or one each.
        obstacle: What the faces of the obstacles are made of; one for all, or one per obstacle.

    Returns:
        The scene for `wifipgo.radio.propagation.paths.trace_paths`.

    Raises:
        ValueError: If an obstacle is clockwise, a room neither convex nor closed, a face without
            length, the number of slabs does not fit, or the frequency is none of a material's.
    """
    for index, corners_m in enumerate(obstacles_m):
        turn = float(cross(corners_m, np.roll(corners_m, -1, axis=0)).sum())
        require(turn >= 0.0, f"obstacles_m[{index}]", "counter-clockwise", corners_m.tolist())
    slabs = _one_each(wall, len(walls_m), "wall")
    per_obstacle = _one_each(obstacle, len(obstacles_m), "obstacle")
    slabs += [slab for slab, corners_m in zip(per_obstacle, obstacles_m, strict=True) for _ in corners_m]
    n_walls = len(walls_m)
    if np.isfinite(walls_m).all() and not is_convex(walls_m):
        walls_m, n_walls = facing_inwards(walls_m), 0
    return Surfaces(
        ends_m=np.concatenate([walls_m, *map(polygon_edges, obstacles_m)]),
        permittivity=np.array([slab.permittivity(carrier_hz) for slab in slabs], dtype=complex),
        thickness_m=np.array([slab.thickness_m for slab in slabs], dtype=float),
        n_walls=n_walls,
    )


def _one_each(slabs: Slab | Sequence[Slab], count: int, name: str) -> list[Slab]:
    """One slab per place, from one for all or a list of the right length."""
    if isinstance(slabs, Slab):
        return [slabs] * count
    require(len(slabs) == count, f"number of {name} slabs", str(count), len(slabs))
    return list(slabs)


def _turn_inwards(normal: Float[np.ndarray, "walls 2"], walls_m: Float[np.ndarray, "walls 2 2"]) -> None:
    """Flip, in place, the normals of walls of a convex room that point out of it."""
    if len(walls_m):
        middle_m = walls_m.reshape(-1, 2).mean(axis=0)
        normal[((middle_m - walls_m[:, 0]) * normal).sum(axis=-1) < 0.0] *= -1.0


def _affine(
    axis: Float[np.ndarray, "faces 2"], base_m: Float[np.ndarray, "faces 2"], *, at_sight: float
) -> Float[np.ndarray, "faces+1 3"]:
    """Rows that take ``(x, y, 1)`` to ``axis . (p - base)``, after one that is ``at_sight`` everywhere."""
    rows = np.concatenate([axis, -(axis * base_m).sum(-1, keepdims=True)], axis=1)
    return np.concatenate([[[0.0, 0.0, at_sight]], rows])
