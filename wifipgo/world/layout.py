"""Rooms: outer walls, random boxes, random starts."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from wifipgo import segments
from wifipgo.errors import require

_TRIES = 2_000


@dataclass(frozen=True, slots=True, kw_only=True)
class ArenaConfig:
    """Room, obstacles and robots' bodies. The step of 2 is the paper's (Sec. 7.1.2); the rest is ours."""

    size_m: float = 20.0
    n_obstacles: int = 0
    obstacle_min_m: float = 1.0
    obstacle_max_m: float = 3.0
    clearance_m: float = 1.0
    robot_radius_m: float = 0.15
    step_m: float = 2.0
    n_substeps: int = 20
    lidar_range_m: float = 4.0
    wall_material: str = "concrete"
    wall_thickness_m: float = 0.2
    obstacle_material: str = "wood"
    obstacle_thickness_m: float = 0.03

    def __post_init__(self) -> None:
        """Reject values that cannot mean anything."""
        positive = ("size_m", "obstacle_min_m", "robot_radius_m", "step_m", "lidar_range_m")
        for name in (*positive, "wall_thickness_m", "obstacle_thickness_m"):
            require(getattr(self, name) > 0.0, f"ArenaConfig.{name}", "> 0", getattr(self, name))
        require(self.n_obstacles >= 0, "ArenaConfig.n_obstacles", ">= 0", self.n_obstacles)
        require(
            self.obstacle_max_m >= self.obstacle_min_m,
            "ArenaConfig.obstacle_max_m",
            ">= obstacle_min_m",
            self.obstacle_max_m,
        )
        require(self.clearance_m >= 0.0, "ArenaConfig.clearance_m", ">= 0", self.clearance_m)
        fastest = self.step_m / self.n_substeps if self.n_substeps > 0 else np.inf
        rule = "enough that a substep moves less than a robot's radius"
        require(fastest < self.robot_radius_m, "ArenaConfig.n_substeps", rule, self.n_substeps)


@dataclass(frozen=True, slots=True, kw_only=True)
class Layout:
    """What stands still in an episode, and where the robots start.

    Attributes:
        walls_m: Edges of the room, counter-clockwise.
        obstacles_m: Corners of each convex obstacle, counter-clockwise.
        starts: Poses of the robots, ``T_world_robot``.
    """

    walls_m: Float[np.ndarray, "walls 2 2"]
    obstacles_m: Sequence[Float[np.ndarray, "corners 2"]]
    starts: Float[np.ndarray, "robots 3"]

    @property
    def faces_m(self) -> Float[np.ndarray, "faces 2 2"]:
        """Edges of all obstacles."""
        edges = [segments.polygon_edges(corners) for corners in self.obstacles_m]
        return np.concatenate(edges) if edges else np.zeros((0, 2, 2))


def room_walls(size_m: float) -> Float[np.ndarray, "4 2 2"]:
    """Edges of a square room with a corner at the origin."""
    return segments.polygon_edges(np.array([[0.0, 0.0], [size_m, 0.0], [size_m, size_m], [0.0, size_m]]))


def inside_polygon(
    p_m: Float[np.ndarray, "points 2"], corners_m: Float[np.ndarray, "corners 2"]
) -> Bool[np.ndarray, " points"]:
    """Which points lie inside a convex counter-clockwise polygon."""
    edges = segments.polygon_edges(corners_m)
    side = segments.cross((edges[:, 1] - edges[:, 0])[None], p_m[:, None] - edges[None, :, 0])
    return np.all(side > 0.0, axis=1)


def _gap_to_obstacles(p_m: np.ndarray, obstacles_m: Sequence[np.ndarray]) -> np.ndarray:
    """Distance of points from the nearest obstacle, 0 inside one."""
    gap = np.full(len(p_m), np.inf)
    for corners in obstacles_m:
        away = segments.distance_to_segments(p_m, segments.polygon_edges(corners)).min(axis=1)
        gap = np.minimum(gap, np.where(inside_polygon(p_m, corners), 0.0, away))
    return gap


def _random_box(cfg: ArenaConfig, rng: np.random.Generator) -> np.ndarray:
    """Corners of one box with random sides, place and direction."""
    half = 0.5 * rng.uniform(cfg.obstacle_min_m, cfg.obstacle_max_m, 2)
    yaw = rng.uniform(0.0, 0.5 * np.pi)
    turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
    corners = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]) * half
    return rng.uniform(0.0, cfg.size_m, 2) + corners @ turn.T


def _fits(box: np.ndarray, placed: Sequence[np.ndarray], cfg: ArenaConfig) -> bool:
    """Whether a box leaves a passage to the walls and to the boxes already placed."""
    if box.min() < cfg.clearance_m or box.max() > cfg.size_m - cfg.clearance_m:
        return False
    return not placed or min(_box_gap(box, other) for other in placed) >= cfg.clearance_m


def _box_gap(a: np.ndarray, b: np.ndarray) -> float:
    """Distance between two convex polygons, 0 if they overlap."""
    if segments.crossings(a, np.roll(a, -1, axis=0), segments.polygon_edges(b)).any():
        return 0.0
    return float(min(_gap_to_obstacles(a, [b]).min(), _gap_to_obstacles(b, [a]).min()))


def random_obstacles(cfg: ArenaConfig, *, rng: np.random.Generator) -> list[Float[np.ndarray, "4 2"]]:
    """Boxes at random, each with a passage around it.

    Raises:
        ValueError: If the room does not hold ``n_obstacles`` of them.
    """
    placed: list[np.ndarray] = []
    for _ in range(_TRIES):
        if len(placed) == cfg.n_obstacles:
            return placed
        box = _random_box(cfg, rng)
        if _fits(box, placed, cfg):
            placed.append(box)
    room = f"a {cfg.size_m} m room with {cfg.clearance_m} m of clearance"
    rule = f"at most what fits {room} (placed {len(placed)})"
    raise ValueError(f"ArenaConfig.n_obstacles must be {rule}, got {cfg.n_obstacles}")


def random_starts(
    n_robots: int, obstacles_m: Sequence[np.ndarray], cfg: ArenaConfig, *, rng: np.random.Generator
) -> Float[np.ndarray, "robots 3"]:
    """Robots' start poses: uniform over the free room, clear of obstacles and of each other.

    Raises:
        ValueError: If the room does not hold ``n_robots``.
    """
    margin, starts = 2.0 * cfg.robot_radius_m, np.zeros((0, 3))
    for _ in range(_TRIES):
        if len(starts) == n_robots:
            return starts
        p_m = rng.uniform(margin, cfg.size_m - margin, (1, 2))
        apart = np.linalg.norm(starts[:, :2] - p_m, axis=1).min(initial=np.inf)
        yaw = rng.uniform(-np.pi, np.pi, (1, 1))
        if apart > 2.0 * margin and _gap_to_obstacles(p_m, obstacles_m)[0] > margin:
            starts = np.concatenate([starts, np.concatenate([p_m, yaw], axis=1)])
    raise ValueError(f"n_robots must be at most what fits the room (placed {len(starts)}), got {n_robots}")


def random_layout(n_robots: int, cfg: ArenaConfig, *, rng: np.random.Generator) -> Layout:
    """A square room with random boxes and starts."""
    obstacles_m = random_obstacles(cfg, rng=rng)
    starts = random_starts(n_robots, obstacles_m, cfg, rng=rng)
    return Layout(walls_m=room_walls(cfg.size_m), obstacles_m=obstacles_m, starts=starts)
