"""How robots move while they call nobody and nobody calls them; one motion may hand over to another."""

from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float

from baselines.policies.exploration import Driver
from baselines.policies.observation_view import View
from baselines.policies.signal_following import Approach
from baselines.policies.steering import open_rays, random_step, ray_angles, step_towards
from baselines.policies.triggers import Trigger
from wifipgo.rows import Chance
from wifipgo.scenarios import Scenario
from wifipgo.se2 import wrap_angle

_CLOSE_STEPS = 0.4  # nearer than this to a point counts as there


@runtime_checkable
class Motion(Protocol):
    """Gives every robot a waypoint in the body frame, in steps.

    What it remembers is one value a row, and `View.kept` says which rows begin anew.
    """

    def step(
        self, view: View, free_steps: Float[np.ndarray, "robots rays"], *, rng: Chance
    ) -> Float[np.ndarray, "robots 2"]:
        """One waypoint for each robot."""


class Uniform:
    """RandomWalk of paper Sec. 5: each step in any open direction."""

    def step(
        self, view: View, free_steps: Float[np.ndarray, "robots rays"], *, rng: Chance
    ) -> Float[np.ndarray, "robots 2"]:
        """A random waypoint."""
        return random_step(free_steps, rng=rng)


class Persistent:
    """A random walk that keeps its heading but for a little noise, and turns away at obstacles.

    A robot ends an iteration turned by the radio's quarter turn, which it takes back.
    """

    def __init__(self, scenario: Scenario, *, wobble_rad: float) -> None:
        """Set the standard deviation of a turn."""
        self._wobble_rad, self._turn_rad = wobble_rad, scenario.turn.turn_rad

    def step(
        self, view: View, free_steps: Float[np.ndarray, "robots rays"], *, rng: Chance
    ) -> Float[np.ndarray, "robots 2"]:
        """A whole step ahead, or a random one where that way is not open."""
        n, n_rays = free_steps.shape
        ahead = -self._turn_rad + self._wobble_rad * rng.standard_normal((n,))
        anywhere = random_step(free_steps, rng=rng)
        ray = np.abs(wrap_angle(ray_angles(n_rays)[None] - ahead[:, None])).argmin(axis=1)
        clear = open_rays(free_steps)[np.arange(n), ray]
        straight = np.stack([np.cos(ahead), np.sin(ahead)], axis=1)
        return np.where(clear[:, None], straight, anywhere)


class ToPoint:
    """Goes to a point and stays: the middle of the room, or each robot's own start."""

    def __init__(self, scenario: Scenario, *, own_start: bool) -> None:
        """Choose the point."""
        self.driver, self._own_start = Driver(scenario), own_start

    def step(
        self, view: View, free_steps: Float[np.ndarray, "robots rays"], *, rng: Chance
    ) -> Float[np.ndarray, "robots 2"]:
        """Towards the point; at it, no step."""
        goal = view.own("start") if self._own_start else np.full((len(view.rows), 2), 0.5)
        away = self.driver.distance_steps(view, goal)
        return np.where((away > _CLOSE_STEPS)[:, None], self.driver.towards(view, goal, free_steps), 0.0)


class HomeWhenLost:
    """Explores, but returns to its own start when its position grows uncertain, until that is known again.

    What counts is ``recorded_spread``: under ``at_rendezvous`` a place seen again helps as soon as it is
    recorded, although the estimate moves at the next rendezvous only. At the start, robots look around.
    """

    def __init__(self, scenario: Scenario, explore: Motion, *, spread_m: float, release: float) -> None:
        """Compose."""
        self._explore, self._home = explore, ToPoint(scenario, own_start=True)
        self._spread_m, self._release = spread_m, release
        self._homing: np.ndarray | None = None

    def step(
        self, view: View, free_steps: Float[np.ndarray, "robots rays"], *, rng: Chance
    ) -> Float[np.ndarray, "robots 2"]:
        """Home, or on."""
        spread_m = view.own("recorded_spread")[:, 0]
        homing = view.kept(self._homing, False)
        homing = self._homing = spread_m > np.where(homing, self._release, 1.0) * self._spread_m
        explore = self._explore.step(view, free_steps, rng=rng)
        home = self._home.step(view, free_steps, rng=rng)
        looking = random_step(free_steps, rng=rng)
        home = np.where(home.any(axis=1, keepdims=True), home, looking)
        return np.where(homing[:, None], home, explore)


class ToSighted:
    """Explores, but when triggered goes to the nearest robot that the camera sees, and stays beside it."""

    def __init__(self, scenario: Scenario, explore: Motion, trigger: Trigger) -> None:
        """Compose."""
        self._explore, self._trigger = explore, trigger
        self._steps_per_range = scenario.visual_range_m / scenario.arena.step_m
        self._side: np.ndarray | None = None

    def step(
        self, view: View, free_steps: Float[np.ndarray, "robots rays"], *, rng: Chance
    ) -> Float[np.ndarray, "robots 2"]:
        """Towards who is seen, or on."""
        away = self._steps_per_range * view.own("sighted")[:, 0].astype(np.float64)
        towards = view.own("sighted_bearing").astype(np.float64)
        side = view.kept(self._side, 0.0)
        length = np.clip(away - _CLOSE_STEPS, 0.0, 1.0)
        goes = self._trigger(view) & (away > 0.0)
        waypoint, taken = step_towards(np.arctan2(towards[:, 1], towards[:, 0]), length, free_steps, side)
        self._side = np.where(goes, taken, 0.0)
        return np.where(goes[:, None], waypoint, self._explore.step(view, free_steps, rng=rng))


class Convoy:
    """Some robots lead and the others follow the strongest signal, roles given by place in the team.

    Args:
        explore: Motion of those who lead.
        period: Iterations after which leaders and followers change roles; 0: never. Followers stand
            while they see their leader, so with a period robots leap-frog: one moves, one is a landmark.
    """

    def __init__(self, explore: Motion, *, period: int) -> None:
        """Compose."""
        self._explore, self._period, self._follow = explore, period, Approach()
        self._clock: np.ndarray | None = None

    def _leads(self, view: View) -> Bool[np.ndarray, " robots"]:
        """Who leads now; at the start of an episode those of even number."""
        clock = view.kept(self._clock, 0)
        self._clock = clock + 1
        return (view.peers + (clock // self._period if self._period else 0)) % 2 == 0

    def step(
        self, view: View, free_steps: Float[np.ndarray, "robots rays"], *, rng: Chance
    ) -> Float[np.ndarray, "robots 2"]:
        """Lead, follow, or wait where one is seen."""
        present = view.slot("present")[..., 0] > 0.0
        slot = np.where(present, view.slot("esnr")[..., 0], -np.inf).argmax(axis=1)
        follows = ~self._leads(view) & present.any(axis=1)
        follow = self._follow.step(view, slot, follows, free_steps)
        return np.where(follows[:, None], follow, self._explore.step(view, free_steps, rng=rng))
