"""Rooms: their rules, outer walls, obstacles and starts. `wifipgo.world.placing` fills them at random."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from wifipgo import segments
from wifipgo.coerce import fitted
from wifipgo.errors import require, require_within
from wifipgo.world import map_checks
from wifipgo.world.map_checks import Corners

# What memory and time allow: a map of the room has a cell for each square metre.
_MOST_M, _MOST_SUBSTEPS, _MOST_ITEMS = 2_000.0, 10_000, 5_000
_THICKNESS_LIMITS_M = (1e-6, 10.0)  # of the slabs that the radio takes them for
_LIMITS = {
    "size_m": (0.1, _MOST_M),
    "n_obstacles": (0, _MOST_ITEMS),
    "obstacle_min_m": (1e-3, _MOST_M),
    "obstacle_max_m": (1e-3, _MOST_M),
    "clearance_m": (0.0, _MOST_M),
    "robot_radius_m": (1e-3, 100.0),
    "step_m": (1e-6, 1_000.0),
    "n_substeps": (1, _MOST_SUBSTEPS),
    "lidar_range_m": (1e-3, 1e6),
    "lidar_sigma_m": (0.0, 1e3),
    "wall_thickness_m": _THICKNESS_LIMITS_M,
    "obstacle_thickness_m": _THICKNESS_LIMITS_M,
}
# Boxes that cover less are shrunk to nothing.
_LEAST_DENSITY = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class ArenaConfig:
    """Room, obstacles and robots' bodies. The step of 2 is the paper's (Sec. 7.1.2); the rest is ours.

    Attributes:
        size_m: Side of the square room; a corner is the origin.
        n_obstacles: Boxes at random places, new ones in every episode.
        obstacle_density: Share of the floor that random boxes cover, in place of their number.
        obstacle_min_m, obstacle_max_m: Sides of a random box. Boxes by density are shrunk together until
            their share is exact.
        clearance_m: Passage that a random box leaves to walls and to other obstacles.
        obstacles_m: Obstacles that stand there in every episode, each a polygon of any shape as a tuple
            of at most 1 000 corners (x, y) in order, either way round; they may touch but not overlap.
        starts: Pose (x, y, yaw in rad) at which each robot starts; empty for random ones.
        robot_radius_m: Radius of a robot's body, a disc.
        step_m: How far a robot drives in an iteration at most.
        step_scale: One factor per robot on the step, or empty for all 1.
        n_substeps: Substeps of the physics in an iteration.
        lidar_range_m: How far the lidar sees.
        lidar_sigma_m: Standard deviation of each distance that the lidar measures.
        wall_material: Material of the walls, a name in `wifipgo.radio.propagation.materials.MATERIALS`.
        wall_thickness_m: Thickness of the walls, for the radio.
        obstacle_material: Material of the obstacles.
        obstacle_thickness_m: Thickness of an obstacle's sides, for the radio.
        obstacle_materials: Material of each obstacle, those by hand first, and from the first again after the
            last; empty for one of all.
        obstacle_thicknesses_m: Thickness of each of ``obstacle_materials``; empty for one of all.
    """

    size_m: float = 20.0
    n_obstacles: int = 0
    obstacle_density: float = 0.0
    obstacle_min_m: float = 1.0
    obstacle_max_m: float = 3.0
    clearance_m: float = 1.0
    obstacles_m: tuple[Corners, ...] = ()
    starts: tuple[tuple[float, float, float], ...] = ()
    robot_radius_m: float = 0.15
    step_m: float = 2.0
    step_scale: tuple[float, ...] = ()
    n_substeps: int = 20
    lidar_range_m: float = 4.0
    lidar_sigma_m: float = 0.0
    wall_material: str = "concrete"
    wall_thickness_m: float = 0.2
    obstacle_material: str = "wood"
    obstacle_thickness_m: float = 0.03
    obstacle_materials: tuple[str, ...] = ()
    obstacle_thicknesses_m: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        """Reject values that cannot mean anything."""
        require_within(self, _LIMITS)
        for name in ("obstacles_m", "starts", "step_scale", "obstacle_materials", "obstacle_thicknesses_m"):
            given = getattr(self, name)
            rule = f"at most {_MOST_ITEMS} long"
            require(len(given) <= _MOST_ITEMS, f"ArenaConfig.{name}", rule, len(given))
        self._check_steps()
        self._check_thicknesses()
        self._check_random_boxes()
        self._check_map()

    def _check_thicknesses(self) -> None:
        given, materials = self.obstacle_thicknesses_m, self.obstacle_materials
        rule = f"empty or as long as obstacle_materials, {len(materials)}"
        require(len(given) in {0, len(materials)}, "ArenaConfig.obstacle_thicknesses_m", rule, given)
        low, high = _THICKNESS_LIMITS_M
        rule = f"all in {low:g}..{high:g}"
        within = all(low <= one <= high for one in given)
        require(within, "ArenaConfig.obstacle_thicknesses_m", rule, given)

    def _check_steps(self) -> None:
        for scale in self.step_scale:
            require(0.0 <= scale <= 1e6, "ArenaConfig.step_scale", "all in 0..1e+06", self.step_scale)
        longest_m = self.step_m * max(self.step_scale, default=1.0)
        fastest = longest_m / self.n_substeps if self.n_substeps > 0 else np.inf
        rule = "enough that a substep moves less than a robot's radius"
        require(fastest < self.robot_radius_m, "ArenaConfig.n_substeps", rule, self.n_substeps)

    def _check_random_boxes(self) -> None:
        density = self.obstacle_density
        require(0.0 <= density < 1.0, "ArenaConfig.obstacle_density", "in [0, 1)", density)
        rule = f"0 or at least {_LEAST_DENSITY:g}"
        require(density == 0.0 or density >= _LEAST_DENSITY, "ArenaConfig.obstacle_density", rule, density)
        rule = "0 beside an obstacle_density > 0: one of the two says how many"
        require(self.n_obstacles == 0 or density == 0.0, "ArenaConfig.n_obstacles", rule, self.n_obstacles)
        mean_m2 = (0.5 * (self.obstacle_min_m + self.obstacle_max_m)) ** 2
        rule = f"such that boxes of these sides are at most about {_MOST_ITEMS}"
        require(
            density * self.size_m**2 <= _MOST_ITEMS * mean_m2, "ArenaConfig.obstacle_density", rule, density
        )
        largest_m = self.obstacle_max_m
        require(
            largest_m >= self.obstacle_min_m, "ArenaConfig.obstacle_max_m", ">= obstacle_min_m", largest_m
        )

    def _check_map(self) -> None:
        """Check what was placed by hand; obstacles are kept counter-clockwise."""
        given = fitted(self.obstacles_m, tuple[Corners, ...], map_checks.OBSTACLES)
        obstacles_m = map_checks.counter_clockwise(given, size_m=self.size_m)
        starts = fitted(self.starts, tuple[tuple[float, float, float], ...], map_checks.STARTS)
        object.__setattr__(self, "obstacles_m", obstacles_m)
        object.__setattr__(self, "starts", starts)
        map_checks.check_apart(obstacles_m)
        body = {"size_m": self.size_m, "radius_m": self.robot_radius_m}
        map_checks.check_starts(starts, obstacles_m, **body)
        if obstacles_m:
            map_checks.check_room_left(obstacles_m, starts, **body)

    def steps_m(self, n_robots: int, n_worlds: int = 1) -> Float[np.ndarray, " rows"]:
        """Longest drive of each robot in an iteration, robot by robot of each world."""
        scale = np.array(self.step_scale) if self.step_scale else np.ones(n_robots)
        rule = f"empty or {n_robots} long"
        require(len(scale) == n_robots, "ArenaConfig.step_scale", rule, self.step_scale)
        return np.tile(self.step_m * scale, n_worlds)


@dataclass(frozen=True, slots=True, kw_only=True)
class Layout:
    """What stands still in an episode, and where the robots start.

    Attributes:
        walls_m: Edges of the room, counter-clockwise.
        obstacles_m: Corners of each obstacle, counter-clockwise.
        starts: Poses of the robots, ``T_world_robot``.
    """

    walls_m: Float[np.ndarray, "walls 2 2"]
    obstacles_m: Sequence[Float[np.ndarray, "_ 2"]]
    starts: Float[np.ndarray, "robots 3"]

    @property
    def faces_m(self) -> Float[np.ndarray, "faces 2 2"]:
        """Edges of all obstacles."""
        edges = [segments.polygon_edges(corners) for corners in self.obstacles_m]
        return np.concatenate(edges) if edges else np.zeros((0, 2, 2))


# Fills up worlds with fewer faces: crossed by nothing, and every robot is behind it.
FAR_FACE_M = np.array([[-4e6, -4e6], [-4e6 + 1.0, -4e6]])
FAR_FACE_M.setflags(write=False)


def padded(each_m: Sequence[Float[np.ndarray, "_ 2 2"]]) -> Float[np.ndarray, "worlds segments 2 2"]:
    """Segments of several worlds as one array, filled up with `FAR_FACE_M`."""
    out = np.empty((len(each_m), max(map(len, each_m), default=0), 2, 2))
    out[...] = FAR_FACE_M
    for own_m, segments_m in zip(out, each_m, strict=True):
        own_m[: len(segments_m)] = segments_m
    return out


def room_walls(size_m: float) -> Float[np.ndarray, "4 2 2"]:
    """Edges of a square room with a corner at the origin."""
    return segments.polygon_edges(np.array([[0.0, 0.0], [size_m, 0.0], [size_m, size_m], [0.0, size_m]]))
