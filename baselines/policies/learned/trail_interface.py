"""The interface ``trail``: the directions of ``rays``, and what a robot remembers of its own way.

Robots measure places that they passed before, and that is what keeps them localised between rendezvous
(`docs/baselines.md`, the ladder). An observation does not say where those places are, so the robot
remembers: where it stood at each iteration, by its own estimate, and how sure of it it was. Each direction
is then also asked whether a step that way ends in reach of an old place, and how much surer the robot would
be there; how much of what is new there lies in the robot's own share of the room; and whether it leads to
the nearest square that nobody has seen, to what is left of the share, or to where another robot started.

Of its team a robot knows what all are told before they begin: starts, noise of the sensors, and how many
they are.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from baselines.policies.exploration import MIDDLES, squares_away2
from baselines.policies.learned.ray_interface import (
    N_DIRECTION as N_DIRECTION_OF_RAYS,
)
from baselines.policies.learned.ray_interface import (
    N_WHOLE as N_WHOLE_OF_RAYS,
)
from baselines.policies.learned.ray_interface import (
    Begins,
    Rays,
    Rows,
    Shown,
    around,
    sampled,
)
from baselines.policies.team_exploration import shares
from envs.directions import ray_azimuths, safe_lengths
from wifipgo.errors import require
from wifipgo.scenarios import Scenario
from wifipgo.world.coverage_belief import N_BINS
from wifipgo.world.lidar import N_LIDAR_RAYS

# Steps ahead at which a direction is asked for old places, and for what is new in the own share.
_AHEAD_STEPS = (1.0, 2.0, 3.0)
_SHARE_STEPS = (1.0, 3.0, 6.0)
# An old place that the estimate puts at this share of the sensor's range is in range most times.
_REACH = 0.9
N_DIRECTION = N_DIRECTION_OF_RAYS + 2 * len(_AHEAD_STEPS) + len(_SHARE_STEPS) + 3
N_WHOLE = N_WHOLE_OF_RAYS + 15
# Sigmas of the paper's simulations, against which others are shown.
_SIGMA_T_M, _SIGMA_R_RAD = 0.1, float(np.deg2rad(3.0))


class Trail(NamedTuple):
    """What each robot remembers of its episode.

    Attributes:
        place: Where it believed to stand at each iteration, in room sizes; inf where it has not been yet.
        spread_m: Deviation of that place once what is recorded is optimised.
        clock: Iterations done.
        alone: Iterations since it was last in reach of an old place.
        share: Squares of the room that are nearer to its start than to any other's.
        mate: Where the robot started that did so nearest; its own start where it is alone.
    """

    place: Float[np.ndarray, "rows times 2"]
    spread_m: Float[np.ndarray, "rows times"]
    clock: Int[np.ndarray, " rows"]
    alone: Int[np.ndarray, " rows"]
    share: Bool[np.ndarray, "rows squares"]
    mate: Float[np.ndarray, "rows 2"]


class Trails(Rays):
    """As `Rays`, with more numbers of the robot and of each direction, from the trail and the team.

    Rows are whole teams, one after the other.
    """

    n_whole, n_direction = N_WHOLE, N_DIRECTION
    n_shown = N_WHOLE + N_DIRECTION * N_LIDAR_RAYS

    def __init__(self, scenario: Scenario) -> None:
        """Learn what `Rays` learns, the team, and the noise of its sensors."""
        super().__init__(scenario)
        self._n_robots, self._n_times = scenario.n_robots, scenario.n_steps + 1
        self._gap = scenario.sensing.revisit_gap
        sigma = scenario.sensing.stated_sigmas(scenario.n_robots) / (_SIGMA_T_M, _SIGMA_R_RAD)
        self._noise = np.log(np.maximum(sigma, 1e-3))
        self.scale = (*self.scale, float(self._gap))

    def remembered(self, rows: Rows, memory: Trail | None, begins: Begins = None) -> Trail:
        """The trail with where the robot is now; it begins anew where an episode does.

        Raises:
            ValueError: Rows are not those of whole teams.
        """
        rule = f"of whole teams of {self._n_robots} robots, whose starts all of them know"
        require(len(rows) % self._n_robots == 0, "observations", rule, f"{len(rows)} rows")
        elapsed = self._block(rows, "own/elapsed")[:, 0].astype(np.float64)
        clock = np.minimum(np.rint(elapsed * self._n_steps).astype(np.int64), self._n_times - 1)
        if memory is None or len(memory.clock) != len(rows):
            place = np.full((len(rows), self._n_times, 2), np.inf, dtype=np.float32)
            never = np.full(place.shape[:2], np.inf, dtype=np.float32)
            memory = Trail(place, never, clock, np.zeros(len(rows), dtype=np.int64), *self._plan(rows))
        begins = (clock == 0) | (False if begins is None else begins)
        each = np.arange(len(rows))
        place = np.where(begins[:, None, None], np.float32(np.inf), memory.place)
        spread_m = np.where(begins[:, None], np.float32(np.inf), memory.spread_m)
        place[each, clock] = self._block(rows, "own/position")
        spread_m[each, clock] = self._block(rows, "own/recorded_spread")[:, 0]
        share, mate = memory.share, memory.mate
        if begins.any():
            plan = zip(self._plan(rows), (share, mate), strict=True)
            share, mate = (np.where(begins[:, None], new, old) for new, old in plan)
        trail = Trail(place, spread_m, clock, memory.alone, share, mate)
        near, _ = self._old_places(trail, place[each, clock][:, None, None], np.zeros(1))
        return trail._replace(alone=np.where(begins | near[:, 0, 0], 0, memory.alone + 1))

    def shown(self, rows: Rows, memory: Trail | None = None) -> Shown:
        """Numbers of the robot, then those of each direction; float32."""
        trail = self.remembered(rows, None) if memory is None else memory
        rows = rows.astype(np.float64)
        whole, blocks = self._parts(rows)
        heading = self._block(rows, "own/heading")
        rays = _units(np.arctan2(heading[:, 1], heading[:, 0])[:, None] + ray_azimuths())
        position = self._block(rows, "own/position")
        unseen = self._block(rows, "survey") <= 0.0
        own, away2 = trail.share, squares_away2(position)
        goals = [_nearest(position, away2, wanted) for wanted in (unseen & own, unseen)] + [trail.mate]
        to_goals = [self._steps_per_room * (goal - position) for goal in goals]
        whole += [self._team_and_time(rows, trail, unseen, own), *(_length(gap) for gap in to_goals)]
        blocks += self._closures(rows, trail, rays, position)
        blocks += self._own_new(unseen & own, rays, position)
        blocks += [_towards(gap, rays) for gap in to_goals]
        return np.concatenate([*whole, *blocks], axis=1, dtype=np.float32, casting="same_kind")

    def _plan(self, rows: Rows) -> tuple[Bool[np.ndarray, "rows squares"], Float[np.ndarray, "rows 2"]]:
        """Each robot's share of the room, and the start nearest to its own."""
        start = self._block(rows, "own/start").reshape(-1, self._n_robots, 2).astype(np.float64)
        share = shares(start)
        apart2 = np.square(start[:, :, None] - start[:, None]).sum(axis=-1)
        n = np.arange(self._n_robots)
        apart2[:, n, n] = np.inf if self._n_robots > 1 else 0.0
        mate = np.take_along_axis(start, apart2.argmin(axis=2)[..., None], axis=1)
        return share.reshape(len(rows), -1), mate.reshape(len(rows), 2)

    def _team_and_time(
        self,
        rows: Rows,
        trail: Trail,
        unseen: Bool[np.ndarray, "rows squares"],
        own: Bool[np.ndarray, "rows squares"],
    ) -> Float[np.ndarray, "rows 12"]:
        """Noise of the robot and of the others, sizes, what is left of time and room."""
        n, n_worlds = self._n_robots, len(rows) // self._n_robots
        others = (self._noise.sum(axis=0) - self._noise) / max(n - 1, 1)
        noise = np.tile(np.concatenate([self._noise, others], axis=1), (n_worlds, 1))
        left = self._n_steps * (1.0 - self._block(rows, "own/elapsed")[:, 0])
        sizes = np.array([np.log2(n), self._steps_per_room / 10.0, self._seen_steps])
        mine = np.count_nonzero(unseen & own, axis=1) / np.maximum(np.count_nonzero(own, axis=1), 1)
        present = self._slots(rows, "present")[..., 0].sum(axis=1) / max(n - 1, 1)
        numbers = [left / 20.0, unseen.mean(axis=1), mine, trail.alone / 10.0]
        return np.column_stack([noise, np.tile(sizes, (len(rows), 1)), *numbers, present])

    def _old_places(
        self,
        trail: Trail,
        there: Float[np.ndarray, "rows reaches rays 2"],
        steps: Float[np.ndarray, " reaches"],
    ) -> tuple[Bool[np.ndarray, "rows reaches rays"], Float[np.ndarray, "rows reaches rays"]]:
        """Whether an old place is in reach of points, and how well the nearest to each is known."""
        now = int(trail.clock.max(initial=0)) + 1
        latest = trail.clock[:, None] + np.rint(steps).astype(np.int64) - self._gap
        x, y = there[..., None, 0].astype(np.float32), there[..., None, 1].astype(np.float32)
        away2 = x - trail.place[:, None, None, :now, 0]
        away2 *= away2
        y = y - trail.place[:, None, None, :now, 1]
        y *= y
        away2 += y
        np.copyto(away2, np.inf, where=(np.arange(now) > latest[..., None])[:, :, None])
        nearest = away2.argmin(axis=-1)
        apart2 = np.take_along_axis(away2, nearest[..., None], axis=-1)[..., 0]
        known_m = trail.spread_m[np.arange(len(there))[:, None, None], nearest]
        return apart2 <= (_REACH * self._seen_steps / self._steps_per_room) ** 2, known_m.astype(np.float64)

    def _closures(self, rows: Rows, trail: Trail, rays: np.ndarray, position: np.ndarray) -> list[np.ndarray]:
        """Whether steps along each direction end in reach of an old place, and what that would bring."""
        steps = np.array(_AHEAD_STEPS)
        lengths = np.tile(steps[None, :, None], (len(rows), 1, N_LIDAR_RAYS))
        lengths[:, 0] = safe_lengths(self._free_steps(rows))
        ahead = lengths[..., None] * rays[:, None] / self._steps_per_room
        closes, known_m = self._old_places(trail, position[:, None, None] + ahead, steps)
        now = np.log1p(4.0 * self._block(rows, "own/recorded_spread"))[:, None]
        gain = np.where(closes, np.maximum(now - np.log1p(4.0 * np.where(closes, known_m, 0.0)), 0.0), 0.0)
        return [*closes.astype(np.float64).transpose(1, 0, 2), *gain.transpose(1, 0, 2)]

    def _own_new(
        self, new: Bool[np.ndarray, "rows squares"], rays: np.ndarray, position: np.ndarray
    ) -> list[np.ndarray]:
        """How much that nobody has seen of the own share is around points along each direction."""
        gain = around(
            new.reshape(-1, N_BINS, N_BINS).astype(np.float64),
            self._seen_steps / self._steps_per_room * N_BINS,
        )
        ahead = np.array(_SHARE_STEPS)[:, None, None] / self._steps_per_room * rays[:, None]
        points = N_BINS * (position[:, None, None] + ahead)
        return list(sampled(gain, points[..., 0], points[..., 1], N_BINS).transpose(1, 0, 2))


def _units(angle_rad: Float[np.ndarray, "rows rays"]) -> Float[np.ndarray, "rows rays 2"]:
    """Vectors of length 1."""
    return np.stack([np.cos(angle_rad), np.sin(angle_rad)], axis=-1)


def _nearest(
    position: Float[np.ndarray, "rows 2"],
    away2: Float[np.ndarray, "rows squares"],
    wanted: Bool[np.ndarray, "rows squares"],
) -> Float[np.ndarray, "rows 2"]:
    """Middle of the nearest square that is wanted; the own place where none is."""
    nearest = np.where(wanted, away2, np.inf).argmin(axis=1)
    found: np.ndarray = np.any(wanted, axis=1, keepdims=True)
    return np.where(found, MIDDLES[nearest], position)


def _length(gap_steps: Float[np.ndarray, "rows 2"]) -> Float[np.ndarray, "rows 1"]:
    """How far, on the scale of a few steps."""
    return np.hypot(gap_steps[:, :1], gap_steps[:, 1:]) / 5.0


def _towards(gap_steps: Float[np.ndarray, "rows 2"], rays: np.ndarray) -> np.ndarray:
    """Cosine of each direction with that of a goal; less for one that is nearer than a step."""
    away = np.maximum(np.hypot(*gap_steps.T), 1.0)[:, None]
    return (gap_steps[:, :1] * rays[..., 0] + gap_steps[:, 1:] * rays[..., 1]) / away
