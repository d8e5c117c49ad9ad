"""What a policy is: it drives one team by dicts, or the teams of many worlds by arrays."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, Protocol, TypeGuard, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float

from baselines.policies.observation_view import Columns, View, flat_rows
from wifipgo.arithmetic import plain_arithmetic
from wifipgo.errors import require
from wifipgo.rows import Generators
from wifipgo.scenarios import Scenario

Observations = Mapping[str, Float[np.ndarray, " numbers"]]
Actions = dict[str, Float[np.ndarray, "3"]]
Teams = Float[np.ndarray, "worlds robots numbers"]
TeamActions = Float[np.ndarray, "worlds robots 3"]


@runtime_checkable
class Policy(Protocol):
    """Drives a whole team."""

    def reset(self, seed: int, episode: int = 0) -> None:
        """Forget the last episode and key the policy's own chance."""

    def act(self, observations: Observations) -> Actions:
        """One action for each observation, both by agent."""


@runtime_checkable
class TeamsPolicy(Protocol):
    """Drives the teams of many worlds, each as it would drive that team alone."""

    def reset_rows(
        self,
        seeds: Sequence[int],
        episodes: Sequence[int] | None = None,
        *,
        mask: Bool[np.ndarray, " worlds"] | None = None,
    ) -> None:
        """Forget the last episode of some worlds and key their chance.

        Args:
            seeds: One for each world, which also says how many there are.
            episodes: Number of each world's episode under its seed; without them 0.
            mask: Worlds that begin anew; without it all.
        """

    def act_rows(self, rows: Teams) -> TeamActions:
        """One action for each robot of each world."""


@runtime_checkable
class Driver(Policy, TeamsPolicy, Protocol):
    """Drives one team or many: what `baselines.policies.make_policy` makes."""


class DrivesTeams(ABC):
    """A policy whose state and chance are rows: one team is a batch of one.

    Args:
        scenario: Gives the layout of the observations.
        key: Keeps the chance of one kind of policy apart from that of others.

    Attributes:
        spec: How a command line names it; empty where it was not made by name.
    """

    spec = ""

    def __init__(self, scenario: Scenario, *, key: int) -> None:
        """Prepare for one team."""
        self._columns, self._key, self._played = Columns.of(scenario), key, scenario.name
        self._each: list[np.random.Generator] = []
        self._begins = np.zeros(0, dtype=bool)
        self.reset(0)

    def __repr__(self) -> str:
        """What it is, as a command line names it if it was made by name, and what it was made for."""
        name = f" {self.spec!r}" if self.spec else ""
        return f"<{type(self).__name__}{name} for {self._played!r}>"

    def reset(self, seed: int, episode: int = 0) -> None:
        """Forget the last episode and key the policy's own chance, for one team."""
        self.reset_rows([seed], [episode])

    def reset_rows(
        self,
        seeds: Sequence[int],
        episodes: Sequence[int] | None = None,
        *,
        mask: Bool[np.ndarray, " worlds"] | None = None,
    ) -> None:
        """As `TeamsPolicy.reset_rows`."""
        n = len(seeds)
        begins = np.ones(n, dtype=bool) if mask is None else np.array(mask, dtype=bool)
        same = len(self._each) == n
        require(begins.shape == (n,), "mask", f"a bool for each of {n} seeds", begins.shape)
        require(same or begins.all(), "seeds", f"of the {len(self._each)} worlds that go on", n)
        self._begins = self._begins | begins if same else begins
        each = self._each if same else [np.random.default_rng(0)] * n
        numbers = [0] * n if episodes is None else episodes
        for k in np.flatnonzero(begins).tolist():
            each[k] = np.random.default_rng(
                np.random.SeedSequence(seeds[k], spawn_key=(numbers[k], self._key))
            )
        self._each, self._rng = each, Generators(each)

    def act(self, observations: Observations) -> Actions:
        """One action for each observation.

        Raises:
            ValueError: Observations of another scenario, or as dicts.
        """
        rows = flat_rows(observations)
        return dict(zip(observations, self.act_rows(rows[None])[0], strict=True))

    @plain_arithmetic
    def act_rows(self, rows: Teams) -> TeamActions:
        """One action for each robot of each world, float32.

        Raises:
            ValueError: Observations of another scenario, or of another number of worlds.
        """
        n_worlds, n_robots, n = rows.shape
        here, there = len(self._each), self._columns.n_numbers
        require(n_worlds == here, "worlds of the observations", f"{here}, as reset_rows was told", n_worlds)
        require(
            n == there, "observations", f"{there} numbers of the scenario that the policy was made for", n
        )
        begins = np.repeat(self._begins, n_robots) if self._begins.any() else None
        view = View(rows.reshape(-1, n), self._columns, n_robots, begins)
        actions = self._actions(view).astype(np.float32, copy=False)
        self._begins = np.zeros(n_worlds, dtype=bool)
        return actions.reshape(n_worlds, n_robots, 3)

    @abstractmethod
    def _actions(self, view: View) -> Float[np.ndarray, "rows 3"]:
        """One action for each row."""


class EachAlone:
    """Policies that know one team only, one for each world: what `TeamsPolicy` does, in a loop."""

    def __init__(self, policies: Sequence[Policy]) -> None:
        """Take one policy for each world."""
        self._policies = tuple(policies)

    def reset_rows(
        self,
        seeds: Sequence[int],
        episodes: Sequence[int] | None = None,
        *,
        mask: Bool[np.ndarray, " worlds"] | None = None,
    ) -> None:
        """As `TeamsPolicy.reset_rows`."""
        begins = np.ones(len(seeds), dtype=bool) if mask is None else mask
        for k in np.flatnonzero(begins).tolist():
            self._policies[k].reset(seeds[k], 0 if episodes is None else episodes[k])

    def act_rows(self, rows: Teams) -> TeamActions:
        """What each policy answers to the observations of its world."""
        names = [f"robot_{i}" for i in range(rows.shape[1])]
        answers = [
            policy.act(dict(zip(names, team, strict=True)))
            for policy, team in zip(self._policies, rows, strict=True)
        ]
        return np.array([[actions[name] for name in names] for actions in answers], dtype=np.float32)

    def see_truth(self, poses: Float[np.ndarray, "worlds robots 3"]) -> None:
        """Show each that asks for it the truth of its world."""
        for policy, team in zip(self._policies, poses, strict=True):
            show: Any = getattr(policy, "see_truth", None)
            if show is not None:
                show(team)


def drives_teams(policy: object) -> TypeGuard[TeamsPolicy]:
    """Whether a policy drives many teams: not one that changes what `DrivesTeams` does for a single team."""
    kind = type(policy)
    changed = issubclass(kind, DrivesTeams) and (
        kind.act is not DrivesTeams.act or kind.reset is not DrivesTeams.reset
    )
    return isinstance(policy, TeamsPolicy) and not changed


def for_teams(policy: Any) -> TeamsPolicy:
    """A policy of one team as one for a batch of one; one that drives many teams is what it is."""
    return policy if drives_teams(policy) else EachAlone([policy])
