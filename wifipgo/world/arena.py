"""The only place that knows pymunk: robots of several worlds that drive and bump.

The engine is a cache, never the owner of what it moves: every drive starts from the poses that it is
given, with bodies that touch nothing yet, so a drive depends on its arguments alone. Robots that can
touch nothing on their way need no engine and move in one array operation for all worlds; of the worlds with
others each gets a space of its own, so that it ends as it would alone. Bodies never leave this module;
positions come and go as arrays.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
import pymunk
from jaxtyping import Bool, Float, Int

from wifipgo import se2
from wifipgo.world.contacts import Contacts
from wifipgo.world.layout import ArenaConfig, Layout
from wifipgo.world.polygons import convex_parts

_COMMANDS_PER_DRIVE = 4
_SETTLE_SUBSTEPS = 3
# An arrival that misses its waypoint by more than this was a bump.
_MISS_M = 0.02
_GRIP = 0.4
# What stands further than this from all that a robot can reach stays out of its space.
_CLEAR_M = 0.01


class Drive(NamedTuple):
    """Where a drive ended, and for whom it ended early."""

    poses: Float[np.ndarray, "rows 3"]
    bumped: Bool[np.ndarray, " rows"]


class Arena:
    """Rooms of several worlds; each drive takes those that may touch something through the engine."""

    def __init__(self, layouts: Sequence[Layout], cfg: ArenaConfig, *, turn_rad: float) -> None:
        """Take the rooms as they are laid out; each drive ends in a turn by ``turn_rad``."""
        self._given = (layouts, cfg, turn_rad)
        self._turn_rad, self._n = turn_rad, len(layouts[0].starts)
        step_m = cfg.steps_m(self._n)
        self._step_m = np.tile(step_m, len(layouts))[:, None]
        self._contacts = Contacts(layouts, radius_m=cfg.robot_radius_m, longest_m=float(step_m.max()))
        self._rooms: list[_Room | None] = [None] * len(layouts)

    def __reduce__(self) -> tuple[Callable[..., "Arena"], tuple[object, ...]]:
        """Travel between processes as what it was built from: it holds nothing else that counts."""
        return _rebuilt, self._given

    def drive(self, poses: Float[np.ndarray, "rows 3"], waypoints: Float[np.ndarray, "rows 2"]) -> Drive:
        """Drive every robot towards its waypoint for one iteration, then turn in place.

        Velocities are set again a few times on the way, so a robot that was pushed or that
        slid along a wall heads for its waypoint again; nothing moves faster than one step
        length an iteration. An iteration lasts one unit of time.

        Args:
            poses: True poses before, ``T_world_robot``, world after world.
            waypoints: In the body frame, in step lengths; longer than 1 is cut to 1.

        Returns:
            True poses after drive and turn, and who missed its waypoint.
        """
        length = se2.length(waypoints)[:, None]
        goal_m = self._step_m * waypoints / np.maximum(length, 1.0)
        start_m, target_m = poses[:, :2], se2.apply(poses, goal_m)
        p_m = start_m + (target_m - start_m)
        rows = self._contacts.may_touch(start_m, target_m).nonzero()[0]
        for world in np.unique(rows // self._n).tolist() if len(rows) else ():
            own = rows[rows // self._n == world]
            p_m[own] = self._room(world).drive(own % self._n, start_m[own], target_m[own])
        moved = length[:, 0] > 1e-6
        yaw_rad = poses[:, 2] + np.where(moved, np.arctan2(waypoints[:, 1], waypoints[:, 0]), 0.0)
        yaw_rad = se2.wrap_angle(yaw_rad + self._turn_rad)
        bumped = se2.length(p_m - target_m) > _MISS_M
        return Drive(np.concatenate([p_m, yaw_rad[:, None]], axis=1), bumped)

    def _room(self, world: int) -> "_Room":
        """The engine's objects of a world, made when they are first needed."""
        room = self._rooms[world]
        if room is None:
            layouts, cfg, _ = self._given
            room = self._rooms[world] = _Room(layouts[world], cfg)
        return room


class _Room:
    """Walls, obstacles and robots of a world as pymunk has them."""

    def __init__(self, layout: Layout, cfg: ArenaConfig) -> None:
        """Make bodies and shapes."""
        self._cfg, self._step_m = cfg, cfg.steps_m(len(layout.starts))[:, None]
        self._ground = pymunk.Body(body_type=pymunk.Body.STATIC)
        self._static = [*self._walls(layout), *self._obstacles(layout)]
        bounds = [shape.cache_bb() for shape in self._static]
        self._static_m = np.array([((b.left, b.bottom), (b.right, b.top)) for b in bounds])
        self._discs = [self._disc() for _ in layout.starts]

    def _walls(self, layout: Layout) -> Iterator[pymunk.Shape]:
        """Walls grow outwards and are thick, so that nothing tunnels through them."""
        thick_m = 1.0
        for start, end in layout.walls_m:
            along = (end - start) / np.linalg.norm(end - start)
            out = thick_m * np.array([along[1], -along[0]])
            a, b = start + out - thick_m * along, end + out + thick_m * along
            yield _rough(pymunk.Segment(self._ground, tuple(a), tuple(b), thick_m))

    def _obstacles(self, layout: Layout) -> Iterator[pymunk.Shape]:
        """Convex parts of the obstacles: pymunk takes the hull of any other."""
        for corners in layout.obstacles_m:
            for part in convex_parts(corners):
                yield _rough(pymunk.Poly(self._ground, part.tolist()))

    def _disc(self) -> tuple[pymunk.Body, pymunk.Shape]:
        """A robot that does not spin: headings are kinematic, positions are physics."""
        body = pymunk.Body(mass=1.0, moment=float("inf"))
        return body, _rough(pymunk.Circle(body, self._cfg.robot_radius_m))

    def drive(
        self,
        robots: Int[np.ndarray, " robots"],
        start_m: Float[np.ndarray, "robots 2"],
        target_m: Float[np.ndarray, "robots 2"],
    ) -> Float[np.ndarray, "robots 2"]:
        """Where robots get that may touch something, in a space that knows nothing of earlier drives.

        The order in which pymunk resolves contacts follows from the order in which shapes joined a space,
        ever: a space that served before would give other digits.
        """
        step_m = self._step_m[robots]
        far_m = step_m + self._cfg.robot_radius_m + _CLEAR_M
        near = _meet(start_m - far_m, start_m + far_m, self._static_m[:, 0], self._static_m[:, 1]).any(axis=0)
        bodies = [self._discs[robot][0] for robot in robots.tolist()]
        for body, p_m in zip(bodies, start_m.tolist(), strict=True):
            body.position, body.velocity = tuple(p_m), (0.0, 0.0)
            pymunk.Body.update_position(body, 0.0)  # forgets by how much it was last pushed apart
        static = [self._static[k] for k in np.flatnonzero(near).tolist()]
        members = [self._ground, *static, *(part for robot in robots.tolist() for part in self._discs[robot])]
        space = _space()
        space.add(*members)
        try:
            self._drive_in_substeps(space, bodies, target_m.tolist(), step_m[:, 0].tolist())
            return np.array([body.position for body in bodies])
        finally:
            space.remove(*members)

    def _drive_in_substeps(
        self,
        space: pymunk.Space,
        bodies: Sequence[pymunk.Body],
        targets_m: Sequence[Sequence[float]],
        steps_m: Sequence[float],
    ) -> None:
        """Head for the targets, again and again, through whatever is in the way; then let overlaps settle.

        Most spaces hold one robot or two, for which numbers take a quarter of the time of arrays.
        """
        rounds = _COMMANDS_PER_DRIVE
        n_each = -(-self._cfg.n_substeps // rounds)  # as many in each, at least what is asked for
        for left in range(rounds, 0, -1):
            for body, (x_m, y_m), step_m in zip(bodies, targets_m, steps_m, strict=True):
                p_m = body.position
                gap_x_m, gap_y_m = x_m - p_m.x, y_m - p_m.y
                away_m = math.sqrt(gap_x_m * gap_x_m + gap_y_m * gap_y_m)
                share = min(rounds / left, step_m / max(away_m, 1e-12))
                body.velocity = gap_x_m * share, gap_y_m * share
            for _ in range(n_each):
                space.step(1.0 / (rounds * n_each))
        for body in bodies:
            body.velocity = 0.0, 0.0
        for _ in range(_SETTLE_SUBSTEPS):
            space.step(1.0 / self._cfg.n_substeps)


def _space() -> pymunk.Space:
    space = pymunk.Space()
    space.collision_slop = 1e-3
    # Share of an overlap left after one unit of time; the default leaves robots stuck in walls.
    space.collision_bias = 1e-9
    return space


def _rough(shape: pymunk.Shape) -> pymunk.Shape:
    shape.friction, shape.elasticity = _GRIP, 0.0
    return shape


def _meet(
    low_m: Float[np.ndarray, "boxes 2"],
    high_m: Float[np.ndarray, "boxes 2"],
    other_low_m: Float[np.ndarray, "others 2"],
    other_high_m: Float[np.ndarray, "others 2"],
) -> Bool[np.ndarray, "boxes others"]:
    """Which boxes overlap or touch."""
    meet = (low_m[:, None] <= other_high_m) & (high_m[:, None] >= other_low_m)
    return meet[..., 0] & meet[..., 1]


def _rebuilt(layouts: Sequence[Layout], cfg: ArenaConfig, turn_rad: float) -> Arena:
    return Arena(layouts, cfg, turn_rad=turn_rad)
