"""Exploration of a team that shares a room, and of robots that stay in reach of their own past."""

import numpy as np
from jaxtyping import Bool, Float

from baselines.policies.exploration import BestView, candidates, squares_away2
from baselines.policies.motions import Motion
from baselines.policies.observation_view import View
from wifipgo.rows import Chance
from wifipgo.scenarios import Scenario

_REACH = 0.9  # of the sensor's range: an old place that the estimate puts there is in range most times


class SharedRoom(BestView):
    """The best view, where squares nearer to another robot's start are worth less.

    These shares are the Voronoi cells of the starts, which all know (after Cortes et al. 2004, but
    with cells that stay: no robot knows where another is now). Who is done with its share helps.

    Args:
        scenario: Gives the sizes of room, step and sight, and the number of robots.
        others_worth: Worth of a square in another's share, of one in the own.
        rest_worth: Worth of each step that the nearest square left is away, in squares.
    """

    def __init__(self, scenario: Scenario, *, others_worth: float, rest_worth: float) -> None:
        """Set the weights."""
        super().__init__(scenario)
        self._others_worth, self._rest_worth = others_worth, rest_worth

    def _worth(
        self, view: View, there: Float[np.ndarray, "robots rays 2"]
    ) -> Float[np.ndarray, "robots rays"]:
        """Squares that come in range, the own ones first, less the way to what is left."""
        wanted, own = candidates(view.survey), self._share(view)
        mine, rest = self._after(there, wanted & own)
        others, rest_of_others = self._after(there, wanted & ~own)
        busy = (wanted & own).any(axis=1)[:, None]
        rest = np.where(busy, rest, rest_of_others)
        return mine + self._others_worth * others - self._rest_worth * rest

    def _share(self, view: View) -> Bool[np.ndarray, "robots squares"]:
        """Squares that a robot takes for its own."""
        return own_share(view)


class Mesh(SharedRoom):
    """The same, and a step that ends in reach of a place passed before is worth more: each is a loop closure.

    Trajectories grow as a mesh around where robots began, and what a robot does not know of its own motion
    it measures again from its own past.

    Args:
        scenario: As for `SharedRoom`.
        loop_worth: Worth of a loop closure, in squares.
        others_worth: As for `SharedRoom`.
        rest_worth: As for `SharedRoom`.
    """

    def __init__(
        self, scenario: Scenario, *, loop_worth: float, others_worth: float, rest_worth: float
    ) -> None:
        """Set the weights."""
        super().__init__(scenario, others_worth=others_worth, rest_worth=rest_worth)
        self._loop_worth, self._gap = loop_worth, scenario.sensing.revisit_gap
        self._n_times = scenario.n_steps + 1
        self._passed: np.ndarray | None = None
        self._clock: np.ndarray | None = None

    def _worth(
        self, view: View, there: Float[np.ndarray, "robots rays 2"]
    ) -> Float[np.ndarray, "robots rays"]:
        """What comes in range, and a loop closure if there is one."""
        passed = view.kept(self._passed, np.inf, (self._n_times, 2))
        clock = view.kept(self._clock, 0)
        passed[np.arange(len(passed)), np.minimum(clock, self._n_times - 1)] = view.own("position")
        self._passed, self._clock = passed, clock + 1
        old = np.arange(self._n_times) <= clock[:, None] + 1 - self._gap
        away2 = np.square(there[:, :, None] - np.where(old[..., None], passed, np.inf)[:, None]).sum(axis=-1)
        closes = (away2 <= (_REACH * self._sight) ** 2).any(axis=2)
        return super()._worth(view, there) + self._loop_worth * closes


def own_share(view: View) -> Bool[np.ndarray, "robots squares"]:
    """Squares of the room whose nearest start is the robot's own."""
    return shares(view.own("start").reshape(-1, view.n_robots, 2)).reshape(len(view.rows), -1)


def shares(
    start: Float[np.ndarray, "teams robots 2"],
) -> Bool[np.ndarray, "teams robots squares"]:
    """Squares whose nearest start is that of a robot, for teams that start there, in room sizes."""
    away2 = squares_away2(start)
    return np.asarray(away2 <= away2.min(axis=1, keepdims=True))


class TakeTurns:
    """Some robots move while the others stand as landmarks, in turns by place in the team.

    Args:
        motion: Of those whose turn it is.
        period: Iterations of a turn.
        n_groups: Groups among which turns go round.
    """

    def __init__(self, motion: Motion, *, period: int, n_groups: int = 2) -> None:
        """Compose."""
        self._motion, self._period, self._n_groups = motion, period, n_groups
        self._clock: np.ndarray | None = None

    def step(
        self, view: View, free_steps: Float[np.ndarray, "robots rays"], *, rng: Chance
    ) -> Float[np.ndarray, "robots 2"]:
        """A waypoint for those whose turn it is, none for the others."""
        clock = view.kept(self._clock, 0)
        self._clock = clock + 1
        moves = (view.peers + clock // self._period) % self._n_groups == 0
        return np.where(moves[:, None], self._motion.step(view, free_steps, rng=rng), 0.0)
