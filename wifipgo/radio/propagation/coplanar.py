"""Faces that touch in one plane, as those of obstacles that touch each other or a wall.

A ray that bounces off one of them meets the others at a height of 0, of which rounding would
decide the sign. The rule: it stays on its own side of all of them, so that there is one
reflection, by the face that looks its way, and nothing in that plane is crossed on top.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.spatial import KDTree

from wifipgo.errors import BadInputError

_SAME_M = 1e-9  # rounding in the heights of a room
_NEAR = 1e-6  # of normals and distances from the origin, before heights are looked at


class Coplanar(NamedTuple):
    """Pairs of a line of `Surfaces` and an obstacle face that touches it in its plane, by line.

    Attributes:
        begin: First pair of each line, and the number of pairs; of each line and world, if there are several.
        other: Obstacle face of each pair.
        alike: Whether both look the same way.
    """

    begin: Int[np.ndarray, " lines+1"]
    other: Int[np.ndarray, " pairs"]
    alike: Bool[np.ndarray, " pairs"]

    def beside(
        self, bounced: Int[np.ndarray, " rays"]
    ) -> tuple[Int[np.ndarray, " found"], Int[np.ndarray, " found"], Bool[np.ndarray, " found"]]:
        """For rays that bounce off these lines: ray, obstacle face and `alike` of every pair."""
        first = self.begin[bounced]
        count = self.begin[bounced + 1] - first
        ray = np.repeat(np.arange(len(bounced)), count)
        pair = np.arange(len(ray)) + np.repeat(first - (count.cumsum() - count), count)
        return ray, self.other[pair], self.alike[pair]

    @classmethod
    def stacked(
        cls, each: Sequence["Coplanar | None"], lines: Sequence[Int[np.ndarray, " _"]], n_lines: int
    ) -> "Coplanar | None":
        """Pairs of several worlds, whose lines are those of a common table; None without any."""
        at, found = [], []
        for world, (coplanar, line) in enumerate(zip(each, lines, strict=True)):
            if coplanar is not None:
                at.append(np.repeat(line, np.diff(coplanar.begin)) * len(each) + world)
                found.append(coplanar)
        if not found:
            return None
        place = np.concatenate(at)
        order = np.argsort(place, kind="stable")
        begin = np.searchsorted(place[order], np.arange(n_lines * len(each) + 1))
        other = np.concatenate([coplanar.other for coplanar in found])
        return cls(begin, other[order], np.concatenate([coplanar.alike for coplanar in found])[order])


def coplanar_faces(
    ends_m: Float[np.ndarray, "faces 2 2"], normal: Float[np.ndarray, "faces 2"], n_walls: int
) -> Coplanar | None:
    """Find the pairs; None without any.

    Raises:
        ValueError: If two faces look the same way at one place: a ray would be reflected twice there.
    """
    pairs, alike = _in_one_plane(ends_m, normal)
    first, second = pairs.T
    direction = np.stack([-normal[first, 1], normal[first, 0]], axis=-1)[:, None]
    along_m = ((ends_m[second] - ends_m[first, :1]) * direction).sum(axis=-1)
    own_m = ((ends_m[first] - ends_m[first, :1]) * direction).sum(axis=-1)
    overlap_m = np.minimum(along_m.max(axis=1, initial=-np.inf), own_m.max(axis=1, initial=-np.inf))
    overlap_m -= np.maximum(along_m.min(axis=1, initial=np.inf), own_m.min(axis=1, initial=np.inf))
    double = np.flatnonzero(alike & (overlap_m > _SAME_M))
    if len(double):
        one, other = ends_m[pairs[double[0]]].tolist()
        raise BadInputError(f"faces must not look the same way at one place, got {one} and {other}")
    kept = np.flatnonzero((overlap_m >= -_SAME_M) & (second >= n_walls))
    if not len(kept):
        return None
    kept = kept[np.argsort(first[kept], kind="stable")]
    begin = np.searchsorted(first[kept] + 1, np.arange(len(ends_m) + 2))
    return Coplanar(begin, second[kept] - n_walls, alike[kept])


def _in_one_plane(
    ends_m: Float[np.ndarray, "faces 2 2"], normal: Float[np.ndarray, "faces 2"]
) -> tuple[Int[np.ndarray, "pairs 2"], Bool[np.ndarray, " pairs"]]:
    """Ordered pairs of faces whose ends have no height over each other, and whether they look alike."""
    plane = np.concatenate([normal, (ends_m[:, 0] * normal).sum(axis=1, keepdims=True)], axis=1)
    tree = KDTree(plane)
    near = tree.query_pairs(_NEAR, output_type="ndarray")
    facing = tree.sparse_distance_matrix(KDTree(-plane), _NEAR, output_type="ndarray")
    opposite = np.stack([facing["i"], facing["j"]], axis=1)
    pairs = np.concatenate([near, near[:, ::-1], opposite]).astype(np.int64)
    alike = np.arange(len(pairs)) < 2 * len(near)
    gap_m = ends_m[pairs[:, 1]] - ends_m[pairs[:, 0], :1]
    height_m = np.abs((gap_m * normal[pairs[:, 0], None]).sum(axis=-1)).max(axis=1, initial=0.0)
    flat = height_m <= _SAME_M
    return pairs[flat], alike[flat]
