"""Where robots that do not walk at random go: a point, the nearest square not yet seen, a sighted robot."""

import numpy as np
from jaxtyping import Bool, Float

from baselines.policies.observation_view import View
from baselines.policies.steering import ray_angles, step_towards
from envs.directions import safe_lengths
from wifipgo.rows import Chance
from wifipgo.scenarios import Scenario
from wifipgo.se2 import wrap_angle
from wifipgo.world.coverage_belief import N_BINS

# A goal of the last iteration is kept unless another is nearer by this many steps: no dithering.
_LOYALTY_STEPS = 1.0
# Each iteration spent on a goal makes it look this much farther: what cannot be reached is given up.
_PATIENCE_STEPS = 0.25
# Shorter steps than this gain nothing and cost an iteration.
_LEAST_STEP = 0.3
# Middles of the squares of the survey, in room sizes, along an axis and in the plane.
BINS = (np.arange(N_BINS) + 0.5) / N_BINS
MIDDLES = np.stack(np.meshgrid(BINS, BINS, indexing="ij"), -1).reshape(-1, 2)


class Driver:
    """Drives robots to points of their own estimate of the world, around what the lidar sees."""

    def __init__(self, scenario: Scenario) -> None:
        """Learn the size of room and step."""
        self._steps_per_room = scenario.arena.size_m / scenario.arena.step_m
        self._side: np.ndarray | None = None  # on which obstacles were passed

    def distance_steps(self, view: View, goal: Float[np.ndarray, "robots 2"]) -> Float[np.ndarray, " robots"]:
        """How far goals are, in steps."""
        return self._steps_per_room * np.hypot(*(goal - view.own("position")).T)

    def towards(
        self, view: View, goal: Float[np.ndarray, "robots 2"], free_steps: Float[np.ndarray, "robots rays"]
    ) -> Float[np.ndarray, "robots 2"]:
        """Waypoints towards goals given in room sizes."""
        gap, heading = goal - view.own("position"), view.own("heading")
        bearing = wrap_angle(
            np.arctan2(gap[:, 1], gap[:, 0]) - np.arctan2(heading[:, 1], heading[:, 0])
        ).astype(np.float64)
        length = np.minimum(self.distance_steps(view, goal), 1.0).astype(np.float64)
        waypoint, self._side = step_towards(bearing, length, free_steps, view.kept(self._side, 0.0))
        return waypoint


class BestView:
    """Takes the whole step after which most of what the robot has not seen is in range.

    Where no step shows anything new it nears the nearest square that is left: a greedy next best view
    (after Gonzalez-Banos and Latombe 2002) with what is left as its way out of dead ends.
    """

    def __init__(self, scenario: Scenario) -> None:
        """Learn the sizes of room, step and sight."""
        self._step = scenario.arena.step_m / scenario.arena.size_m
        self._sight = scenario.sensing.sensor_range_m / scenario.arena.size_m

    def step(
        self, view: View, free_steps: Float[np.ndarray, "robots rays"], *, rng: Chance
    ) -> Float[np.ndarray, "robots 2"]:
        """Waypoints along the rays that are worth most, as far as these are open."""
        angle_rad, length = ray_angles(free_steps.shape[1]), safe_lengths(free_steps)
        worth = self._worth(view, self._landings(view, angle_rad, length))
        ray = np.where(length >= _LEAST_STEP, worth, -np.inf).argmax(axis=1)
        rows = np.arange(len(ray))
        body = np.stack([np.cos(angle_rad), np.sin(angle_rad)], axis=-1)[ray]
        return length[rows, ray][:, None] * body

    def _worth(
        self, view: View, there: Float[np.ndarray, "robots rays 2"]
    ) -> Float[np.ndarray, "robots rays"]:
        """Squares that come in range at each place, less the steps from there to the nearest other."""
        shown, rest = self._after(there, candidates(view.survey))
        return shown - rest

    def _landings(
        self, view: View, angle_rad: Float[np.ndarray, " rays"], length: Float[np.ndarray, "robots rays"]
    ) -> Float[np.ndarray, "robots rays 2"]:
        """Where a step along each ray ends, in room sizes."""
        heading = view.own("heading")
        world_rad = angle_rad[None] + np.arctan2(heading[:, 1], heading[:, 0])[:, None]
        ahead = self._step * length[..., None] * np.stack([np.cos(world_rad), np.sin(world_rad)], axis=-1)
        return view.own("position")[:, None] + ahead

    def _after(
        self, there: Float[np.ndarray, "robots rays 2"], wanted: Bool[np.ndarray, "robots squares"]
    ) -> tuple[Float[np.ndarray, "robots rays"], Float[np.ndarray, "robots rays"]]:
        """Wanted squares in range of each place, and steps to the nearest other; 0 if there is none."""
        away2 = squares_away2(there) + np.where(wanted, 0.0, np.inf)[:, None]
        near = away2 <= self._sight**2
        np.copyto(away2, np.inf, where=near)
        rest = np.sqrt(away2.min(axis=2)) / self._step
        return np.count_nonzero(near, axis=2).astype(np.float64), np.where(np.isfinite(rest), rest, 0.0)


def squares_away2(there: Float[np.ndarray, "*places 2"]) -> Float[np.ndarray, "*places squares"]:
    """Squared distances from places to the middles of all squares, in room sizes."""
    x2, y2 = (np.square(there[..., k, None] - BINS) for k in (0, 1))
    return (x2[..., :, None] + y2[..., None, :]).reshape(*there.shape[:-1], -1)


class Frontier:
    """Goes to the nearest square of the room that the robot has not seen and was not told of."""

    def __init__(self, scenario: Scenario) -> None:
        """Learn the size of room and step."""
        self._driver = Driver(scenario)
        self._steps_per_room = scenario.arena.size_m / scenario.arena.step_m
        self._tries: np.ndarray | None = None
        self._goal: np.ndarray | None = None

    def step(
        self, view: View, free_steps: Float[np.ndarray, "robots rays"], *, rng: Chance
    ) -> Float[np.ndarray, "robots 2"]:
        """Waypoints towards the goals; a robot that has seen all goes to what it knows least."""
        survey, rows = view.survey, np.arange(len(view.rows))
        tries, before = view.kept(self._tries, 0.0, survey.shape[1:]), view.kept(self._goal, -1)
        gap = MIDDLES[None] - view.own("position")[:, None]
        cost = self._steps_per_room * np.hypot(gap[..., 0], gap[..., 1]) + _PATIENCE_STEPS * tries
        cost[rows[before >= 0], before[before >= 0]] -= _LOYALTY_STEPS
        goal = np.where(candidates(survey), cost, np.inf).argmin(axis=1)
        tries[rows, goal] += 1.0
        self._tries, self._goal = tries, goal
        return self._driver.towards(view, MIDDLES[goal], free_steps)


def candidates(survey: Float[np.ndarray, "robots squares"]) -> Bool[np.ndarray, "robots squares"]:
    """Squares worth a visit: those not seen, or those known least where all were."""
    unseen = survey <= 0.0
    least = survey <= survey.min(axis=1, keepdims=True)
    return np.where(unseen.any(axis=1, keepdims=True), unseen, least)
