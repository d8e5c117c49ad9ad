"""Scenes of several worlds side by side: what the tracer looks up by line and world.

Worlds differ in how many faces they have, so the tables are padded with lines that are nothing: every point
is a metre in front of them, they have no length to reflect on and nothing crosses them. One scene is a batch
of one.
"""

import functools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float, Int, Shaped

from wifipgo.errors import require
from wifipgo.radio.propagation.coplanar import Coplanar
from wifipgo.radio.propagation.face_pairs import FacePairs
from wifipgo.radio.propagation.outline import Outline
from wifipgo.radio.propagation.surfaces import FARTHEST_M, Surfaces


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Scenes:
    """Tables of all worlds, a line first and a world last. Lines: the line of sight, walls, other faces.

    Attributes:
        each: The scene of every world.
        n_walls: Lines after the line of sight that are walls of convex rooms, or padding between.
        normal: Unit vector out of the front of each line.
        affine: Coefficients of ``(x, y, 1)`` in the position along each line, m, and in the height over it.
        length_m: Length of each line.
        permittivity: Complex relative permittivity behind each line.
        thickness_m: Thickness of the slab behind each line, m.
        outline: Corners and winding of the faces after the walls.
        coplanar: Faces that touch in one plane, by line and world; None without.
    """

    each: tuple[Surfaces, ...]
    n_walls: int
    normal: Float[np.ndarray, "2 lines worlds"]
    affine: Float[np.ndarray, "3 2 lines worlds"]
    length_m: Float[np.ndarray, "lines worlds"]
    permittivity: Complex[np.ndarray, "lines worlds"]
    thickness_m: Float[np.ndarray, "lines worlds"]
    outline: Outline
    coplanar: Coplanar | None

    @classmethod
    def of(cls, each: Sequence[Surfaces]) -> "Scenes":
        """Lay scenes side by side."""
        n_walls = max(surfaces.n_walls for surfaces in each)
        n_lines = 1 + n_walls + max(len(surfaces.ends_m) - surfaces.n_walls for surfaces in each)
        lines = [_lines_of(surfaces, n_walls) for surfaces in each]

        def table(name: str, padding: float, dtype: type = float) -> np.ndarray:
            arrays = [getattr(surfaces, name) for surfaces in each]
            out = np.full((*arrays[0].shape[:-1], n_lines, len(each)), padding, dtype=dtype)
            for world, (array, line) in enumerate(zip(arrays, lines, strict=True)):
                out[..., line[-array.shape[-1] :], world] = array
            return out

        return cls(
            each=tuple(each),
            n_walls=n_walls,
            normal=table("normal", 0.0),
            affine=np.stack(
                [
                    _affine_table([surfaces.to_along for surfaces in each], lines, n_lines),
                    _affine_table([surfaces.to_height for surfaces in each], lines, n_lines),
                ],
                axis=1,
            ),
            length_m=table("length_m", 0.0),
            permittivity=table("permittivity", 1.0, complex),
            thickness_m=table("thickness_m", 1.0),
            outline=Outline.stacked([surfaces.outline for surfaces in each]),
            coplanar=Coplanar.stacked([surfaces.coplanar for surfaces in each], lines, n_lines),
        )

    @property
    def n_worlds(self) -> int:
        """Worlds, one if it is the scene of all."""
        return len(self.each)

    @property
    def n_lines(self) -> int:
        """The line of sight and the faces of the world with most of them."""
        return len(self.length_m)

    @property
    def to_height(self) -> Float[np.ndarray, "3 lines worlds"]:
        """Coefficients of ``(x, y, 1)`` in the height over each line, m."""
        return self.affine[:, 1]

    def by_world(
        self, table: Shaped[np.ndarray, "*lines worlds"], world: Int[np.ndarray, " n"]
    ) -> Shaped[np.ndarray, "*lines _"]:
        """A table for a list of things in these worlds; one column for all if there is one scene."""
        return table if self.n_worlds == 1 else table.take(world, axis=-1)

    def of_some(self, world: Int[np.ndarray, " links"], link: Int[np.ndarray, " n"]) -> Int[np.ndarray, " n"]:
        """Worlds of some links; not looked up if there is one scene, where nobody asks."""
        return link if self.n_worlds == 1 else world.take(link)

    def at(self, line: Int[np.ndarray, "*n"], world: Int[np.ndarray, " n"]) -> Int[np.ndarray, "*n"]:
        """Places in the flat tables."""
        return line if self.n_worlds == 1 else line * self.n_worlds + world

    def normal_at(self, at: Int[np.ndarray, "*n"]) -> Float[np.ndarray, "2 *n"]:
        """Unit vectors out of the front of some lines."""
        return self.normal.reshape(2, -1).take(at, axis=1)

    def faces_of(self, world: Int[np.ndarray, " n"]) -> Float[np.ndarray, "n faces 2 2"]:
        """Ends of all faces of these worlds, m, in the order of lines; padding is far away."""
        return _padded_ends(self)[world if self.n_worlds > 1 else np.zeros_like(world)]

    def pairs_of(self, world: Int[np.ndarray, " n"]) -> FacePairs:
        """Faces that can reflect into each other in these worlds, padded with pairs that never do."""
        pairs = _pairs(self)
        return FacePairs(*(self.by_world(column, world) for column in pairs))


def scenes_of(surfaces: Surfaces | Scenes) -> Scenes:
    """One scene for all links, or several as they are."""
    return surfaces if isinstance(surfaces, Scenes) else _alone(surfaces)


@functools.lru_cache(maxsize=256)
def _alone(surfaces: Surfaces) -> Scenes:
    return Scenes.of([surfaces])


def _lines_of(surfaces: Surfaces, n_walls: int) -> Int[np.ndarray, " lines"]:
    """Where the lines of one scene go in the tables: its faces after the walls come after all walls."""
    line = np.arange(1 + len(surfaces.ends_m))
    line[1 + surfaces.n_walls :] += n_walls - surfaces.n_walls
    return line


def _affine_table(
    arrays: Sequence[Float[np.ndarray, "_ 3"]], lines: Sequence[Int[np.ndarray, " _"]], n_lines: int
) -> Float[np.ndarray, "3 lines worlds"]:
    """Coefficients by line and world; padding is at 0 along it, and 1 m over it, as for the line of sight."""
    out = np.empty((3, n_lines, len(arrays)))
    for world, (array, line) in enumerate(zip(arrays, lines, strict=True)):
        out[..., world] = array[:1].T
        out[:, line, world] = array.T
    return out


@functools.lru_cache(maxsize=8)
def _padded_ends(scenes: Scenes) -> Float[np.ndarray, "worlds faces 2 2"]:
    ends_m = np.full((scenes.n_worlds, scenes.n_lines - 1, 2, 2), FARTHEST_M)
    ends_m[:, :, 1] *= 2.0
    for world, surfaces in enumerate(scenes.each):
        ends_m[world, _lines_of(surfaces, scenes.n_walls)[1:] - 1] = surfaces.ends_m
    return ends_m


@functools.lru_cache(maxsize=8)
def _pairs(scenes: Scenes) -> FacePairs:
    """Pairs of all worlds, as ``(pairs, worlds)``; the line of sight with itself is the padding."""
    each = [surfaces.pairs for surfaces in scenes.each]
    shape = (max(len(pairs.first) for pairs in each), scenes.n_worlds)
    out = FacePairs(*(np.zeros(shape, dtype=column.dtype) for column in each[0]))
    for world, (surfaces, pairs) in enumerate(zip(scenes.each, each, strict=True)):
        line = _lines_of(surfaces, scenes.n_walls)
        for name, table, column in zip(FacePairs._fields, out, pairs, strict=True):
            flat = column.reshape(-1)
            table[: len(flat), world] = line[flat] if name in {"first", "second"} else flat
    return out


def check_worlds(scenes: Scenes, world: Int[np.ndarray, " n"] | None, n: int) -> Int[np.ndarray, " n"]:
    """World of each of ``n`` links; 0 for all if they share one scene.

    Raises:
        ValueError: If several scenes do not come with a world for every link, or with one that is none.
    """
    if world is None:
        require(scenes.n_worlds == 1, "world", f"given where there are {scenes.n_worlds} scenes", world)
        return np.zeros(n, dtype=np.int64)
    require(len(world) == n, "world", f"one for each of {n} links", world)
    within = scenes.n_worlds == 1 or bool(((world >= 0) & (world < scenes.n_worlds)).all())
    require(within, "world", f"in 0..{scenes.n_worlds - 1}", world)
    return world
