"""Teams: a motion for everybody, and on top of it the calls of Algorithm 2 and the answers of Algorithm 1."""

import numpy as np
from jaxtyping import Bool, Int

from baselines.policies.motions import Motion, Uniform
from baselines.policies.observation_view import View
from baselines.policies.policy import DrivesTeams
from baselines.policies.signal_following import Approach
from baselines.policies.triggers import Trigger, err_above
from wifipgo.scenarios import Scenario

_EPISODE_KEY = 0xAC7


class Walkers(DrivesTeams):
    """A team in which everybody follows one motion; nobody calls or answers."""

    def __init__(self, scenario: Scenario, motion: Motion) -> None:
        """Learn the layout of the observations from the scenario."""
        super().__init__(scenario, key=_EPISODE_KEY)
        self._steps_per_range = scenario.arena.lidar_range_m / scenario.arena.step_m
        self._motion = motion

    def _actions(self, view: View) -> np.ndarray:
        return self._act(view, self._steps_per_range * view.lidar)

    def _act(self, view: View, free_steps: np.ndarray) -> np.ndarray:
        walk = self._motion.step(view, free_steps, rng=self._rng)
        return np.concatenate([walk, np.full((len(walk), 1), -1.0)], axis=1)


class Callers(Walkers):
    """A team whose robots call when they are triggered, and come when they are called.

    A robot that is called comes, along the strongest path of the caller's signal. A robot that is
    triggered calls and waits, or moves on while nobody hears it. A caller that is itself called comes
    too, unless caller and callee call each other: then the one with the lower error comes and the
    other waits.

    Args:
        scenario: Gives the layout of the observations.
        motion: What all others do.
        trigger: When to call.
        refuge: Where callers and called go instead of waiting and coming, if anywhere.
        caller_drives: Whether a caller drives towards whom it calls instead of waiting.
    """

    def __init__(
        self,
        scenario: Scenario,
        motion: Motion,
        trigger: Trigger,
        *,
        refuge: Motion | None = None,
        caller_drives: bool = False,
    ) -> None:
        """Compose."""
        self._trigger, self._refuge, self._approach = trigger, refuge, Approach.of(scenario)
        self._caller_drives = caller_drives
        super().__init__(scenario, motion)

    def _act(self, view: View, free_steps: np.ndarray) -> np.ndarray:
        lost = self._trigger(view)
        comes, slot = whom_to_serve(view, lost)
        waits = lost & (view.slot("present")[..., 0] > 0.0).any(axis=1)
        waypoint = self._motion.step(view, free_steps, rng=self._rng)
        if self._refuge:
            refuge = self._refuge.step(view, free_steps, rng=self._rng)
            waypoint = np.where((lost | comes)[:, None], refuge, waypoint)
        else:
            if self._caller_drives:
                calls = view.slot("i_call")[..., 0] > 0.0
                slot = np.where(comes, slot, calls.argmax(axis=1))
                comes = comes | (lost & calls.any(axis=1))
            coming = self._come(view, slot, comes, free_steps)
            waypoint = np.where(comes[:, None], coming, np.where(waits[:, None], 0.0, waypoint))
        return np.concatenate([waypoint, np.where(lost, 1.0, -1.0)[:, None]], axis=1)

    def _come(
        self,
        view: View,
        slot: Int[np.ndarray, " robots"],
        comes: Bool[np.ndarray, " robots"],
        free_steps: np.ndarray,
    ) -> np.ndarray:
        return self._approach.step(view, slot, comes, free_steps)


def whom_to_serve(
    view: View, lost: Bool[np.ndarray, " robots"]
) -> tuple[Bool[np.ndarray, " robots"], Int[np.ndarray, " robots"]]:
    """Who comes to a caller, and in which slot that caller is."""
    calls_me, i_call, err = (view.slot(name)[..., 0] for name in ("calls_me", "i_call", "err"))
    own = view.own("err")
    yields = (i_call > 0.0) & (own > err) & lost[:, None]  # mutual call: the more lost one waits
    serve = (calls_me > 0.0) & ~yields
    slot = np.where(serve, err, -1.0).argmax(axis=1)
    return serve.any(axis=1), slot


class RandomRendezvous(Walkers):
    """The paper's baseline: walk at random and meet by chance; never calls, never answers."""

    def __init__(self, scenario: Scenario) -> None:
        """Compose."""
        super().__init__(scenario, Uniform())


class ActiveRendezvous(Callers):
    """The paper's policy: Algorithm 2 watches the error and calls, Algorithm 1 answers calls.

    Args:
        scenario: Gives the layout of the observations.
        err_threshold: Threshold of Algorithm 2 in units of the scenario's.
        caller_drives: Whether a caller drives towards whom it calls instead of waiting.
    """

    def __init__(
        self, scenario: Scenario, *, err_threshold: float = 1.0, caller_drives: bool = False
    ) -> None:
        """Compose."""
        super().__init__(scenario, Uniform(), err_above(err_threshold), caller_drives=caller_drives)
