"""Rooms: outer walls, obstacles by hand or at random, starts by hand or at random."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from wifipgo import segments
from wifipgo.errors import BadInputError, require, require_within
from wifipgo.settings import fitted
from wifipgo.world import maps
from wifipgo.world.maps import Corners, gap_to_obstacles
from wifipgo.world.polygons import area_m2

# So many boxes or starts in a row that do not fit, and the room is taken to be full.
_TRIES = 2_000
# What memory and time allow: a map of the room has a cell for each square metre.
_MOST_M, _MOST_SUBSTEPS = 2_000.0, 10_000
_THICKNESS_LIMITS_M = (1e-6, 10.0)  # of the slabs that the radio takes them for
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
            of corners (x, y) in order; they may touch but not overlap.
        starts: Pose (x, y, yaw in rad) at which each robot starts; empty for random ones.
        robot_radius_m: Radius of a robot's body, a disc.
        step_m: How far a robot drives in an iteration at most.
        step_scale: One factor per robot on the step, or empty for all 1.
        n_substeps: Substeps of the physics in an iteration.
        lidar_range_m: How far the lidar sees.
        wall_material: Material of the walls, a name in `wifipgo.radio.materials.MATERIALS`.
        wall_thickness_m: Thickness of the walls, for the radio.
        obstacle_material: Material of the obstacles.
        obstacle_thickness_m: Thickness of an obstacle's sides, for the radio.
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
    wall_material: str = "concrete"
    wall_thickness_m: float = 0.2
    obstacle_material: str = "wood"
    obstacle_thickness_m: float = 0.03

    def __post_init__(self) -> None:
        """Reject values that cannot mean anything."""
        positive = ("size_m", "obstacle_min_m", "robot_radius_m", "step_m", "lidar_range_m")
        require_within(self, dict.fromkeys(("wall_thickness_m", "obstacle_thickness_m"), _THICKNESS_LIMITS_M))
        for name in positive:
            value = getattr(self, name)
            require(value > 0.0, f"ArenaConfig.{name}", "> 0", value)
            require(value < np.inf, f"ArenaConfig.{name}", "finite", value)
        require(self.size_m <= _MOST_M, "ArenaConfig.size_m", f"at most {_MOST_M:g}", self.size_m)
        require(self.clearance_m >= 0.0, "ArenaConfig.clearance_m", ">= 0", self.clearance_m)
        self._check_steps()
        self._check_random_boxes()
        self._check_map()

    def _check_steps(self) -> None:
        for scale in self.step_scale:
            require(0.0 <= scale < np.inf, "ArenaConfig.step_scale", "all >= 0 and finite", self.step_scale)
        longest_m = self.step_m * max(self.step_scale, default=1.0)
        fastest = longest_m / self.n_substeps if self.n_substeps > 0 else np.inf
        rule = "enough that a substep moves less than a robot's radius"
        require(fastest < self.robot_radius_m, "ArenaConfig.n_substeps", rule, self.n_substeps)
        rule = f"at most {_MOST_SUBSTEPS}"
        require(self.n_substeps <= _MOST_SUBSTEPS, "ArenaConfig.n_substeps", rule, self.n_substeps)

    def _check_random_boxes(self) -> None:
        density = self.obstacle_density
        require(self.n_obstacles >= 0, "ArenaConfig.n_obstacles", ">= 0", self.n_obstacles)
        require(0.0 <= density < 1.0, "ArenaConfig.obstacle_density", "in [0, 1)", density)
        rule = f"0 or at least {_LEAST_DENSITY:g}"
        require(density == 0.0 or density >= _LEAST_DENSITY, "ArenaConfig.obstacle_density", rule, density)
        rule = "0 beside an obstacle_density > 0: one of the two says how many"
        require(self.n_obstacles == 0 or density == 0.0, "ArenaConfig.n_obstacles", rule, self.n_obstacles)
        largest_m = self.obstacle_max_m
        require(
            largest_m >= self.obstacle_min_m, "ArenaConfig.obstacle_max_m", ">= obstacle_min_m", largest_m
        )

    def _check_map(self) -> None:
        """Check what was placed by hand; obstacles are kept counter-clockwise."""
        given = fitted(self.obstacles_m, tuple[Corners, ...], maps.OBSTACLES)
        obstacles_m = maps.counter_clockwise(given, size_m=self.size_m)
        starts = fitted(self.starts, tuple[tuple[float, float, float], ...], maps.STARTS)
        object.__setattr__(self, "obstacles_m", obstacles_m)
        object.__setattr__(self, "starts", starts)
        maps.check_apart(obstacles_m)
        body = {"size_m": self.size_m, "radius_m": self.robot_radius_m}
        maps.check_starts(starts, obstacles_m, **body)
        if obstacles_m:
            maps.check_room_left(obstacles_m, starts, **body)

    def steps_m(self, n_robots: int) -> Float[np.ndarray, " robots"]:
        """Longest drive of each robot in an iteration."""
        scale = np.array(self.step_scale) if self.step_scale else np.ones(n_robots)
        rule = f"empty or {n_robots} long"
        require(len(scale) == n_robots, "ArenaConfig.step_scale", rule, self.step_scale)
        return self.step_m * scale


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


def room_walls(size_m: float) -> Float[np.ndarray, "4 2 2"]:
    """Edges of a square room with a corner at the origin."""
    return segments.polygon_edges(np.array([[0.0, 0.0], [size_m, 0.0], [size_m, size_m], [0.0, size_m]]))


def _random_box(cfg: ArenaConfig, rng: np.random.Generator) -> np.ndarray:
    """Corners of one box with random sides, place and direction."""
    half = 0.5 * rng.uniform(cfg.obstacle_min_m, cfg.obstacle_max_m, 2)
    yaw = rng.uniform(0.0, 0.5 * np.pi)
    turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
    corners = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]) * half
    return rng.uniform(0.0, cfg.size_m, 2) + corners @ turn.T


def _fits(box: np.ndarray, placed: Sequence[np.ndarray], cfg: ArenaConfig) -> bool:
    """Whether a box leaves a passage to the walls and to what is placed, and room around given starts."""
    if box.min() < cfg.clearance_m or box.max() > cfg.size_m - cfg.clearance_m:
        return False
    starts_m = np.array(cfg.starts).reshape(-1, 3)[:, :2]
    if gap_to_obstacles(starts_m, [box]).min(initial=np.inf) <= 2.0 * cfg.robot_radius_m:
        return False
    near = (other for other in placed if _may_be_nearer(box, other, cfg.clearance_m))
    return all(_box_gap(box, other) >= cfg.clearance_m for other in near)


def _may_be_nearer(a: np.ndarray, b: np.ndarray, gap_m: float) -> bool:
    """Whether the rectangles around two polygons, along the axes, come nearer than a gap."""
    return bool(np.all((a.min(axis=0) - b.max(axis=0) < gap_m) & (b.min(axis=0) - a.max(axis=0) < gap_m)))


def _box_gap(a: np.ndarray, b: np.ndarray) -> float:
    """Distance between two polygons, 0 if they overlap."""
    if segments.crossings(a, np.roll(a, -1, axis=0), segments.polygon_edges(b)).any():
        return 0.0
    return float(min(gap_to_obstacles(a, [b]).min(), gap_to_obstacles(b, [a]).min()))


def random_obstacles(cfg: ArenaConfig, *, rng: np.random.Generator) -> list[Float[np.ndarray, "4 2"]]:
    """Boxes at random, each with a passage around it: so many, or so much of the floor.

    By share, boxes are placed until they cover enough, then all shrunk by one factor so that
    they cover no more; passages only grow by that.

    Raises:
        ValueError: If the room does not hold them beside the obstacles placed by hand.
    """
    by_hand = [np.array(corners) for corners in cfg.obstacles_m]
    goal_m2, covered_m2, misses = cfg.obstacle_density * cfg.size_m**2, 0.0, 0
    boxes: list[np.ndarray] = []
    while len(boxes) < cfg.n_obstacles or covered_m2 < goal_m2:
        box = _random_box(cfg, rng)
        if _fits(box, [*by_hand, *boxes], cfg):
            boxes.append(box)
            covered_m2, misses = covered_m2 + area_m2(box), 0
        elif (misses := misses + 1) == _TRIES:
            _refuse_boxes(cfg, len(boxes), covered_m2)
    return [_shrunk(box, np.sqrt(goal_m2 / covered_m2)) for box in boxes] if goal_m2 else boxes


def _shrunk(box: np.ndarray, factor: float) -> np.ndarray:
    """Box about its middle."""
    middle = box.mean(axis=0)
    return middle + factor * (box - middle)


def _refuse_boxes(cfg: ArenaConfig, n_placed: int, covered_m2: float) -> None:
    """Say that the room is full, and how much of what was asked for it holds."""
    room = f"a {cfg.size_m} m room with {cfg.clearance_m} m of clearance"
    if cfg.n_obstacles:
        rule = f"at most what fits {room} (placed {n_placed})"
        raise BadInputError(f"ArenaConfig.n_obstacles must be {rule}, got {cfg.n_obstacles}")
    rule = f"at most what fits {room} (covered {covered_m2 / cfg.size_m**2:.3f})"
    raise BadInputError(f"ArenaConfig.obstacle_density must be {rule}, got {cfg.obstacle_density}")


def random_starts(
    n_robots: int, obstacles_m: Sequence[np.ndarray], cfg: ArenaConfig, *, rng: np.random.Generator
) -> Float[np.ndarray, "robots 3"]:
    """Robots' start poses: uniform over the free room, clear of obstacles and of each other.

    Where obstacles placed by hand cut the floor into parts, all starts lie in the largest.

    Raises:
        ValueError: If the room does not hold ``n_robots``.
    """
    margin, starts, misses = 2.0 * cfg.robot_radius_m, np.zeros((0, 3)), 0
    rule = f"more than four times robot_radius_m ({cfg.robot_radius_m:g}) for random starts"
    require(cfg.size_m > 2.0 * margin, "ArenaConfig.size_m", rule, cfg.size_m)
    while len(starts) < n_robots:
        p_m = rng.uniform(margin, cfg.size_m - margin, (1, 2))
        apart = np.linalg.norm(starts[:, :2] - p_m, axis=1).min(initial=np.inf)
        yaw = rng.uniform(-np.pi, np.pi, (1, 1))
        free = gap_to_obstacles(p_m, obstacles_m)[0] > margin and _in_largest_part(p_m, cfg)
        if apart > 2.0 * margin and free:
            starts, misses = np.concatenate([starts, np.concatenate([p_m, yaw], axis=1)]), 0
        elif (misses := misses + 1) == _TRIES:
            rule = f"at most what fits the room (placed {len(starts)})"
            raise BadInputError(f"n_robots must be {rule}, got {n_robots}")
    return starts


def _in_largest_part(p_m: np.ndarray, cfg: ArenaConfig) -> bool:
    if not cfg.obstacles_m:
        return True
    floor = maps.floor_of(cfg.obstacles_m, cfg.size_m, cfg.robot_radius_m)
    return bool(floor.part_of(p_m)[0] == floor.largest)


def random_layout(n_robots: int, cfg: ArenaConfig, *, rng: np.random.Generator) -> Layout:
    """A square room with what was placed by hand, and random boxes and starts where nothing was.

    Raises:
        ValueError: If the room does not hold it, or there are starts for another number of robots.
    """
    by_hand = [np.array(corners) for corners in cfg.obstacles_m]
    obstacles_m = [*by_hand, *random_obstacles(cfg, rng=rng)]
    if cfg.starts:
        require(len(cfg.starts) == n_robots, "ArenaConfig.starts", f"empty or {n_robots} long", cfg.starts)
        starts = np.array(cfg.starts)
    else:
        starts = random_starts(n_robots, obstacles_m, cfg, rng=rng)
    return Layout(walls_m=room_walls(cfg.size_m), obstacles_m=obstacles_m, starts=starts)
