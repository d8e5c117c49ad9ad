"""The only place that knows pymunk: robots that drive and bump.

Bodies never leave this module; positions come and go as arrays through
``pymunk.batch``, whose rows are in the space's own order and end with the static body.
"""

from typing import NamedTuple

import numpy as np
import pymunk
import pymunk.batch
from jaxtyping import Bool, Float

from wifipgo import se2
from wifipgo.world.layout import ArenaConfig, Layout
from wifipgo.world.polygons import convex_parts

_COMMANDS_PER_DRIVE = 4
_SETTLE_SUBSTEPS = 3
# An arrival that misses its waypoint by more than this was a bump.
_MISS_M = 0.02
_GRIP = 0.4
_AT_REST = np.zeros(2)
# Robots further than this from anything that they could touch on their way drive it in one substep.
_CLEAR_M = 0.01
# Among more robots than this, one is nearly always near another: looking costs more than it saves.
_FEW = 12


class Drive(NamedTuple):
    """Where a drive ended, and for whom it ended early."""

    poses: Float[np.ndarray, "robots 3"]
    bumped: Bool[np.ndarray, " robots"]


class Arena:
    """A pymunk space with walls, obstacles and one disc for each robot."""

    def __init__(self, layout: Layout, cfg: ArenaConfig, *, turn_rad: float) -> None:
        """Build the space with the robots at their starts; each drive ends in a turn by ``turn_rad``."""
        self._cfg, self._turn_rad = cfg, turn_rad
        self._step_m = cfg.steps_m(len(layout.starts))[:, None]
        self._space = pymunk.Space()
        self._space.collision_slop = 1e-3
        # Share of an overlap left after one unit of time; the default leaves robots stuck in walls.
        self._space.collision_bias = 1e-9
        self._add_static(layout)
        outline_m = np.array([(c.min(axis=0), c.max(axis=0)) for c in layout.obstacles_m]).reshape(-1, 2, 2)
        self._box_low_m, self._box_high_m = outline_m[:, 0], outline_m[:, 1]
        self._room_m = layout.walls_m.min(axis=(0, 1)), layout.walls_m.max(axis=(0, 1))
        bodies = [self._add_robot(start) for start in layout.starts]
        self._buffer = pymunk.batch.Buffer()
        self._rows = self._batch_rows(bodies)
        self._velocity = np.zeros((len(bodies) + 1, 2))
        self._out = pymunk.batch.Buffer()  # a view of the velocities, not a copy
        self._out.set_float_buf(self._velocity)

    def _add_static(self, layout: Layout) -> None:
        """Walls grow outwards and are thick, so that nothing tunnels through them."""
        thick_m = 1.0
        ground = self._space.static_body
        for start, end in layout.walls_m:
            along = (end - start) / np.linalg.norm(end - start)
            out = thick_m * np.array([along[1], -along[0]])
            a, b = start + out - thick_m * along, end + out + thick_m * along
            self._space.add(self._static(pymunk.Segment(ground, tuple(a), tuple(b), thick_m)))
        for corners in layout.obstacles_m:
            for part in convex_parts(corners):  # pymunk takes the hull of any other
                self._space.add(self._static(pymunk.Poly(ground, part.tolist())))

    @staticmethod
    def _static(shape: pymunk.Shape) -> pymunk.Shape:
        shape.friction, shape.elasticity = _GRIP, 0.0
        return shape

    def _add_robot(self, start: np.ndarray) -> pymunk.Body:
        """A disc that does not spin: headings are kinematic, positions are physics."""
        body = pymunk.Body(mass=1.0, moment=float("inf"))
        body.position = (float(start[0]), float(start[1]))
        shape = pymunk.Circle(body, self._cfg.robot_radius_m)
        shape.friction, shape.elasticity = _GRIP, 0.0
        self._space.add(body, shape)
        return body

    def _batch_rows(self, bodies: list[pymunk.Body]) -> np.ndarray:
        """Row of each robot in a batch call, found by body id: the order is the space's own."""
        self._buffer.clear()
        pymunk.batch.get_space_bodies(self._space, pymunk.batch.BodyFields.BODY_ID, self._buffer)
        ids = np.frombuffer(self._buffer.int_buf(), dtype=np.uintp).tolist()
        return np.array([ids.index(body.id) for body in bodies])

    def positions(self) -> Float[np.ndarray, "robots 2"]:
        """True positions of the robots, m."""
        self._buffer.clear()
        pymunk.batch.get_space_bodies(self._space, pymunk.batch.BodyFields.POSITION, self._buffer)
        return np.frombuffer(self._buffer.float_buf(), dtype=np.float64).reshape(-1, 2)[self._rows]

    def _command(self, velocity_m_s: np.ndarray) -> None:
        """Write velocities; the static body's row stays zero, or walls would drag robots."""
        self._velocity[self._rows] = velocity_m_s
        pymunk.batch.set_space_bodies(self._space, pymunk.batch.BodyFields.VELOCITY, self._out)

    def _settle(self) -> None:
        """Stop, and let the last substep's overlaps be pushed apart."""
        self._command(_AT_REST)
        for _ in range(_SETTLE_SUBSTEPS):
            self._space.step(1.0 / self._cfg.n_substeps)

    def _is_clear(
        self, start_m: Float[np.ndarray, "robots 2"], target_m: Float[np.ndarray, "robots 2"]
    ) -> bool:
        """Whether nobody can touch anything on the straight way: the boxes about the ways are apart."""
        n, reach_m = len(start_m), self._cfg.robot_radius_m + _CLEAR_M
        if n > _FEW:
            return False
        low_m, high_m = np.minimum(start_m, target_m) - reach_m, np.maximum(start_m, target_m) + reach_m
        if (low_m < self._room_m[0]).any() or (high_m > self._room_m[1]).any():
            return False
        others_low_m = np.concatenate([low_m, self._box_low_m])
        others_high_m = np.concatenate([high_m, self._box_high_m])
        meet = (low_m[:, None] <= others_high_m) & (high_m[:, None] >= others_low_m)
        return int((meet[..., 0] & meet[..., 1]).sum()) == n  # each meets itself

    def _drive_in_substeps(self, target_m: Float[np.ndarray, "robots 2"]) -> None:
        """Head for the targets, again and again, through whatever is in the way."""
        rounds = _COMMANDS_PER_DRIVE
        n_each = -(-self._cfg.n_substeps // rounds)  # as many in each, at least what is asked for
        for left in range(rounds, 0, -1):
            gap_m = target_m - self.positions()
            away_m = se2.length(gap_m)[:, None]
            self._command(gap_m * np.minimum(rounds / left, self._step_m / np.maximum(away_m, 1e-12)))
            for _ in range(n_each):
                self._space.step(1.0 / (rounds * n_each))
        self._settle()

    def drive(self, poses: Float[np.ndarray, "robots 3"], waypoints: Float[np.ndarray, "robots 2"]) -> Drive:
        """Drive every robot towards its waypoint for one iteration, then turn in place.

        Velocities are set again a few times on the way, so a robot that was pushed or that
        slid along a wall heads for its waypoint again; nothing moves faster than one step
        length an iteration. An iteration lasts one unit of time. Where nobody can touch anything,
        one substep is as good as many.

        Args:
            poses: True poses before, ``T_world_robot``.
            waypoints: In the body frame, in step lengths; longer than 1 is cut to 1.

        Returns:
            True poses after drive and turn, and who missed its waypoint.
        """
        length = se2.length(waypoints)[:, None]
        goal_m = self._step_m * waypoints / np.maximum(length, 1.0)
        target_m, p_m = se2.apply(poses, goal_m), self.positions()
        if self._is_clear(p_m, target_m):
            self._command(target_m - p_m)
            self._space.step(1.0)
            self._command(_AT_REST)
        else:
            self._drive_in_substeps(target_m)
        p_m = self.positions()
        moved = length[:, 0] > 1e-6
        yaw_rad = poses[:, 2] + np.where(moved, np.arctan2(waypoints[:, 1], waypoints[:, 0]), 0.0)
        yaw_rad = se2.wrap_angle(yaw_rad + self._turn_rad)
        bumped = se2.length(p_m - target_m) > _MISS_M
        return Drive(np.concatenate([p_m, yaw_rad[:, None]], axis=1), bumped)
