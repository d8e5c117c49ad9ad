"""Random rooms with obstacles, and links in them, for tracers to be held against each other."""

from dataclasses import dataclass

import numpy as np

from support.image_method import Face
from support.polyominoes import grown, outline
from wifipgo.radio.propagation.materials import MATERIALS, Material, Slab
from wifipgo.radio.propagation.surfaces import Surfaces, surfaces_of
from wifipgo.segments import crossings, distance_to_segments, polygon_edges

OWN = Material(3.3, 0.02, 0.011, 1.2)  # of no table
SLABS: list[str | Material] = [*MATERIALS, OWN]


@dataclass(frozen=True)
class Scene:
    """A room, obstacles that may touch it and each other, and links between points in the open."""

    room_m: np.ndarray
    obstacles_m: list[np.ndarray]
    slabs: list[Slab]
    carrier_hz: float
    tx_m: np.ndarray
    rx_m: np.ndarray

    @property
    def edges_m(self) -> list[np.ndarray]:
        """Edges of the room, clockwise, and of the obstacles, counter-clockwise."""
        return [polygon_edges(corners_m) for corners_m in (self.room_m[::-1], *self.obstacles_m)]

    def surfaces(self) -> Surfaces:
        """For our tracer."""
        n_walls = len(self.room_m)
        return surfaces_of(
            self.edges_m[0],
            self.obstacles_m,
            carrier_hz=self.carrier_hz,
            wall=self.slabs[:n_walls],
            obstacle=self.slabs[n_walls:],
        )

    def faces(self, *, walls_block: bool) -> list[Face]:
        """For the second tracer."""
        n_walls, out = len(self.room_m), []
        for k, edges_m in enumerate(self.edges_m):
            for edge, (start, end) in enumerate(edges_m @ (1.0, 1.0j)):
                slab = self.slabs[edge] if k == 0 else self.slabs[n_walls + k - 1]
                eps, blocks = slab.permittivity(self.carrier_hz), k > 0 or walls_block
                out.append(Face(start, end, eps, slab.thickness_m, blocks))
        return out


def star(
    rng: np.random.Generator, n: int, middle_m: np.ndarray, radius_m: float, *, dent: float
) -> np.ndarray:
    """Polygon around a point, counter-clockwise, its corners on a circle but for some that are dented."""
    at_rad = (
        np.arange(n) * 2.0 * np.pi / n + rng.uniform(0.0, 0.8 * 2.0 * np.pi / n, n) + rng.uniform(0.0, 6.0)
    )
    away_m = radius_m * rng.choice([dent, 1.0], n)
    return middle_m + away_m[:, None] * np.stack([np.cos(at_rad), np.sin(at_rad)], axis=-1)


def in_the_open(points_m: np.ndarray, edges_m: np.ndarray) -> np.ndarray:
    """Whether an even-odd count puts a point in the room and in no obstacle, a centimetre from any face."""
    far_m = points_m + np.array([97.0, 41.0])
    odd = np.count_nonzero(crossings(points_m, far_m, edges_m), axis=1) % 2 == 1
    return odd & (distance_to_segments(points_m, edges_m).min(axis=1) > 0.01)


def scene(seed: int, *, convex: bool, n_links: int = 4) -> Scene:
    """Three obstacles of three to five corners, convex or not, in a room of four to six corners."""
    rng = np.random.default_rng(seed)
    room_m = star(rng, int(rng.integers(4, 7)), rng.uniform(-9.0, 9.0, 2), 8.0, dent=1.0 if convex else 0.45)
    middle_m = room_m.mean(axis=0)
    centres_m = middle_m + rng.uniform(1.6, 2.2) * np.array([[1.0, 0.0], [-0.5, 0.8], [-0.4, -0.9]])
    obstacles_m = [
        star(rng, int(rng.integers(3, 6)), at, 0.8, dent=rng.choice([0.2, 1.0])) for at in centres_m
    ]
    slabs = [
        Slab(SLABS[rng.integers(len(SLABS))], float(rng.uniform(0.005, 0.25)))
        for _ in range(len(room_m) + len(obstacles_m))
    ]
    points_m = rng.uniform(room_m.min(axis=0), room_m.max(axis=0), (400, 2))
    edges_m = np.concatenate([polygon_edges(room_m), *map(polygon_edges, obstacles_m)])
    points_m = points_m[in_the_open(points_m, edges_m)][: 2 * n_links]
    carrier_hz = float(rng.uniform(2e9, 8e9))
    return Scene(room_m, obstacles_m, slabs, carrier_hz, points_m[:n_links], points_m[n_links:])


def notched(seed: int, n_links: int = 6) -> Scene:
    """Two shapes of squares of 0.7 m, turned by any angle, with links in and about the notches of one."""
    rng = np.random.default_rng(seed)
    room_m = np.array([[-8.0, -5.0], [6.0, -5.0], [6.0, 5.0], [-8.0, 5.0]])
    obstacles_m = []
    for middle_m in ([-2.8, 0.0], [2.8, 0.0]):
        turn = np.exp(1j * rng.uniform(0.0, 6.0))
        corners_m = 0.7 * (np.array(outline(grown(rng, 9, 4))) - 2.0) @ (1.0, 1.0j) * turn
        obstacles_m.append(middle_m + np.stack([corners_m.real, corners_m.imag], axis=-1))
    slabs = [Slab(SLABS[rng.integers(len(SLABS))], float(rng.uniform(0.005, 0.25))) for _ in range(6)]
    points_m = np.array([-2.8, 0.0]) + rng.uniform(-1.6, 1.6, (400, 2))
    edges_m = np.concatenate([polygon_edges(room_m), *map(polygon_edges, obstacles_m)])
    points_m = points_m[in_the_open(points_m, edges_m)]
    return Scene(room_m, obstacles_m, slabs, 5e9, points_m[:n_links], points_m[n_links : 2 * n_links])
