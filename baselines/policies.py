"""Scripted policies and their registry. Each sees exactly what a learner sees."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from baselines._adaptive import step_length, strongest_bearing
from baselines._specs import fitting, parameters_of, split_spec
from baselines._view import View
from baselines._walks import random_step, step_towards
from envs.rendezvous_v0 import layout
from wifipgo.errors import pick
from wifipgo.scenarios import Scenario

Observations = Mapping[str, Float[np.ndarray, " numbers"]]
Actions = dict[str, Float[np.ndarray, "3"]]


@runtime_checkable
class Policy(Protocol):
    """Drives a whole team."""

    def reset(self, seed: int, episode: int = 0) -> None:
        """Forget the last episode and key the policy's own chance."""

    def act(self, observations: Observations) -> Actions:
        """One action for each observation, both by agent."""


class RandomRendezvous:
    """The paper's baseline: walk at random and meet by chance; never calls, never answers."""

    def __init__(self, scenario: Scenario) -> None:
        """Learn the layout of the observations from the scenario."""
        self._fields = {field.name: field for field in layout(scenario)}
        self._steps_per_range = _steps_per_range(scenario)
        self.reset(0)

    def reset(self, seed: int, episode: int = 0) -> None:
        """Forget the last episode and key the walk's chance."""
        self._rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(episode, 0xAC7)))

    def act(self, observations: Observations) -> Actions:
        """One action for each observation."""
        view = View.of(observations, self._fields)
        actions = self._act(view, self._steps_per_range * view.lidar)
        return dict(zip(observations, actions.astype(np.float32), strict=True))

    def _act(self, view: View, free_steps: np.ndarray) -> np.ndarray:
        walk = random_step(free_steps, rng=self._rng)
        return np.concatenate([walk, np.full((len(walk), 1), -1.0)], axis=1)


class ActiveRendezvous(RandomRendezvous):
    """The paper's policy: Algorithm 2 watches the error and calls, Algorithm 1 answers calls.

    A robot that is called comes, along the strongest path of the caller's signal. A robot whose
    Err passed the threshold calls and waits, or walks on while nobody hears it. All others walk
    at random. A caller that is itself called comes too, unless caller and callee call each
    other: then the one with the lower error comes and the other waits.

    Args:
        scenario: Gives the layout of the observations.
        err_threshold: Threshold of Algorithm 2 in units of the scenario's.
    """

    def __init__(self, scenario: Scenario, *, err_threshold: float = 1.0) -> None:
        """Learn the layout of the observations from the scenario."""
        super().__init__(scenario)
        self._threshold = err_threshold

    def reset(self, seed: int, episode: int = 0) -> None:
        """Forget the last episode and key the walk's chance."""
        super().reset(seed, episode)
        self._side, self._observed = np.zeros(0), np.zeros(0)

    def _act(self, view: View, free_steps: np.ndarray) -> np.ndarray:
        lost = view.own("err")[:, 0] > self._threshold
        comes, slot = _whom_to_serve(view, lost)
        waits = lost & (view.slot("present")[..., 0] > 0.0).any(axis=1)
        walk = np.where(waits[:, None], 0.0, random_step(free_steps, rng=self._rng))
        waypoint = np.where(comes[:, None], self._approach(view, slot, comes, free_steps), walk)
        return np.concatenate([waypoint, np.where(lost, 1.0, -1.0)[:, None]], axis=1)

    def _approach(
        self, view: View, slot: np.ndarray, comes: np.ndarray, free_steps: np.ndarray
    ) -> np.ndarray:
        """Algorithm 1's step, or none while each step already brings a new observation of the caller."""
        rows = np.arange(len(slot))
        before = self._observed if len(self._observed) else np.full(len(slot), np.inf)
        side = self._side if len(self._side) else np.zeros(len(slot))
        observed = view.slot("observed")[rows, slot, 0]
        bearing = strongest_bearing(view.slot("profile")[rows, slot])
        length = step_length(view.slot("discrepancy")[rows, slot, 0])
        approach, taken = step_towards(bearing, length, free_steps, side)
        self._side = np.where(comes, taken, 0.0)
        self._observed = np.where(comes, observed, np.inf)
        return np.where((observed > before)[:, None], 0.0, approach)


def _steps_per_range(scenario: Scenario) -> np.ndarray:
    """How many of its steps a robot's lidar sees ahead; one that cannot drive sees very many."""
    step_m = np.maximum(scenario.arena.steps_m(scenario.n_robots), 1e-6)
    return scenario.arena.lidar_range_m / step_m[:, None]


def _whom_to_serve(view: View, lost: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Who comes to a caller, and in which slot that caller is."""
    calls_me, i_call, err = (view.slot(name)[..., 0] for name in ("calls_me", "i_call", "err"))
    own = view.own("err")
    yields = (i_call > 0.0) & (own > err) & lost[:, None]  # mutual call: the more lost one waits
    serve = (calls_me > 0.0) & ~yields
    slot = np.where(serve, err, -1.0).argmax(axis=1)
    return serve.any(axis=1), slot


POLICIES: Mapping[str, Callable[..., Policy]] = MappingProxyType(
    {"active": ActiveRendezvous, "random": RandomRendezvous}
)


def make_policy(spec: str, scenario: Scenario, **parameters: Any) -> Policy:
    """Build a policy from its name, with parameters if any: ``active:err_threshold=0.5``.

    Args:
        spec: ``name`` or ``name:key=value:key=value``.
        scenario: Gives the layout of the observations.
        parameters: More parameters of the policy; they win over those in ``spec``.

    Raises:
        ValueError: Unknown policy or parameter; the message lists what exists.
    """
    name, own = split_spec(spec)
    policy = pick(POLICIES, name, "policy")
    return policy(scenario, **fitting(name, own | parameters, parameters_of(policy)))
