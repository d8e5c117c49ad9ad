"""Policies of the user's own: what they answer is checked, and one that knows a single team drives many."""

import inspect
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float

from baselines.policies.own_errors import told
from baselines.policies.policy import (
    Actions,
    EachAlone,
    Observations,
    TeamActions,
    Teams,
    TeamsPolicy,
    drives_teams,
)
from wifipgo.errors import BadInputError, require

_NUMBERS = "biuf"  # kinds of numpy's dtypes that are real numbers
_SIZE = 3
_PLACES = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)


@runtime_checkable
class Acts(Protocol):
    """The least that a policy has."""

    def act(self, observations: Observations) -> Any:
        """One action for each observation, both by agent."""


class Checked:
    """A policy of one team whose answers are checked; `reset` is optional, and takes what it names.

    Args:
        policy: Has at least `act`.
        label: Its name in messages.
    """

    def __init__(self, policy: Any, label: str) -> None:
        """See that there is something to call."""
        acts = callable(getattr(policy, "act", None)) and not isinstance(policy, type)
        rule = "something with act(observations), which gives one action for each agent"
        require(acts, f"policy {label!r}", rule, type(policy).__name__)
        self._policy, self._label = policy, label

    def __repr__(self) -> str:
        """Whose it is."""
        return f"<policy {self._label!r}: {self._policy!r}>"

    def reset(self, seed: int, episode: int = 0) -> None:
        """Tell the policy that an episode begins, if it wants to know."""
        reset = getattr(self._policy, "reset", None)
        if reset is not None:
            with told(f"reset of policy {self._label!r}"):
                _call_with(reset, seed, episode)

    def act(self, observations: Observations) -> Actions:
        """One action for each observation.

        Raises:
            BadInputError: An agent without an action or that is not there, or an action that is no three
                finite numbers: names the agent, what was expected and what was got.
            OwnPolicyError: The policy raised.
        """
        with told(f"act of policy {self._label!r}"):
            answer = self._policy.act(observations)
        return _checked(answer, list(observations), self._label)

    def see_truth(self, poses: Float[np.ndarray, "robots 3"]) -> None:
        """Show the truth to a policy that asks for it."""
        _show(self._policy, poses)


class OwnTeams(EachAlone):
    """A policy that knows one team, made anew for each world and episode, so that nothing is carried over.

    Args:
        make: Makes one.
    """

    def __init__(self, make: Callable[[], Checked]) -> None:
        """Make one, to see that it can be made."""
        super().__init__([make()])
        self._make, self._is_new = make, True

    def __repr__(self) -> str:
        """Whose they are."""
        return repr(self._policies[0])

    def reset_rows(
        self,
        seeds: Sequence[int],
        episodes: Sequence[int] | None = None,
        *,
        mask: Bool[np.ndarray, " worlds"] | None = None,
    ) -> None:
        """As `TeamsPolicy.reset_rows`."""
        begins = np.ones(len(seeds), dtype=bool) if mask is None else np.asarray(mask)
        old = self._policies if len(self._policies) == len(seeds) else ()
        require(len(old) > 0 or bool(begins.all()), "seeds", "of the worlds that go on", len(seeds))
        new = list(self._policies) if self._is_new else []  # the first that was made is not wasted
        self._policies = tuple(
            ((new.pop() if new else self._make()) if begin else old[k]) for k, begin in enumerate(begins)
        )
        self._is_new = False
        super().reset_rows(seeds, episodes, mask=mask)

    def reset(self, seed: int, episode: int = 0) -> None:
        """Begin an episode of one team."""
        self.reset_rows([seed], [episode])

    def act(self, observations: Observations) -> Actions:
        """One action for each observation of one team."""
        actions: Actions = self._policies[0].act(observations)
        return actions


class OwnRows:
    """A policy of the user's own that drives many teams itself; what it answers is checked.

    Args:
        policy: Has at least `reset_rows` and `act_rows`.
        label: Its name in messages.
    """

    def __init__(self, policy: TeamsPolicy, label: str) -> None:
        """Prepare."""
        self._policy, self._label = policy, label

    def __repr__(self) -> str:
        """Whose it is."""
        return f"<policy {self._label!r}: {self._policy!r}>"

    def reset_rows(
        self,
        seeds: Sequence[int],
        episodes: Sequence[int] | None = None,
        *,
        mask: Bool[np.ndarray, " worlds"] | None = None,
    ) -> None:
        """As `TeamsPolicy.reset_rows`."""
        with told(f"reset_rows of policy {self._label!r}"):
            self._policy.reset_rows(seeds, episodes, mask=mask)

    def act_rows(self, rows: Teams) -> TeamActions:
        """One action for each robot of each world, checked as those of `Checked.act`."""
        with told(f"act_rows of policy {self._label!r}"):
            answer = self._policy.act_rows(rows)
        found, shape = _array(answer), (*rows.shape[:2], _SIZE)
        require(found.dtype.kind in _NUMBERS, f"actions of policy {self._label!r}", "numbers", found.dtype)
        require(found.shape == shape, f"actions of policy {self._label!r}", f"of shape {shape}", found.shape)
        for world, robot in np.argwhere(~np.isfinite(found).all(axis=2))[:1].tolist():
            where = f"action of policy {self._label!r} for robot_{robot} of world {world}"
            require(False, where, "finite", found[world, robot].tolist())
        return _clipped(found)

    def reset(self, seed: int, episode: int = 0) -> None:
        """Begin an episode of one team."""
        self.reset_rows([seed], [episode])

    def act(self, observations: Observations) -> Actions:
        """One action for each observation of one team."""
        rows = np.stack(list(observations.values()))[None]
        return dict(zip(observations, self.act_rows(rows)[0], strict=True))

    def see_truth(self, poses: Float[np.ndarray, "*worlds robots 3"]) -> None:
        """Show the truth to a policy that asks for it."""
        _show(self._policy, poses)


def own_policy(make: Callable[[], Any], label: str) -> OwnTeams | OwnRows:
    """A policy of the user's own as one that drives one team or many.

    Args:
        make: Makes it: a class or a function without arguments.
        label: Its name in messages.

    Raises:
        BadInputError: It cannot be made, or cannot act.
    """

    def made() -> Any:
        with told(f"making policy {label!r}"):
            return make()

    first = [made()]
    if drives_teams(first[0]):
        return OwnRows(first[0], label)
    return OwnTeams(lambda: Checked(first.pop() if first else made(), label))


def _checked(answer: Any, agents: Sequence[str], label: str) -> Actions:
    """Actions that can be carried out, float32."""
    rule = "a dict with one action for each agent"
    require(isinstance(answer, Mapping), f"answer of policy {label!r}", rule, answer)
    for name in answer:
        if name not in agents:
            rule = f"for one of {', '.join(agents)}"
            raise BadInputError(f"each action of policy {label!r} must be {rule}, got one for {name!r}")
    for name in agents:
        if name not in answer:
            given = ", ".join(map(str, answer)) or "nobody"
            raise BadInputError(f"policy {label!r} must give {name} an action, got actions for {given}")
    return {name: _action(answer[name], f"action of policy {label!r} for {name}") for name in agents}


def _action(value: Any, where: str) -> Float[np.ndarray, "3"]:
    """One action, or what is wrong with it."""
    found = _array(value)
    require(found.dtype.kind in _NUMBERS, where, f"{_SIZE} numbers", f"dtype {found.dtype}: {value!r}")
    require(
        found.shape == (_SIZE,),
        where,
        f"of shape ({_SIZE},), a waypoint and a call: actions are continuous",
        found.shape,
    )
    require(bool(np.isfinite(found).all()), where, "finite", found.tolist())
    return _clipped(found)


def _clipped(actions: np.ndarray) -> np.ndarray:
    """Numbers of actions, within their space, as the environment has them."""
    return np.clip(actions.astype(np.float64), -1.0, 1.0).astype(np.float32)


def _array(value: Any) -> np.ndarray:
    """A value as an array, of dtype object where it is none."""
    try:
        return np.asarray(value)
    except (TypeError, ValueError, RuntimeError):  # ragged, or a tensor that is being differentiated
        return np.array(None)


def _call_with(reset: Callable[..., object], seed: int, episode: int) -> None:
    """Call a reset with as much as it takes: seed and episode by name, else what it cannot do without."""
    given, found = {"seed": seed, "episode": episode}, inspect.signature(reset).parameters
    needed = [p for p in found.values() if p.kind in _PLACES and p.default is inspect.Parameter.empty]
    if found.keys() & given:
        reset(**{name: value for name, value in given.items() if name in found})
    else:
        reset(*list(given.values())[: len(needed)])


def _show(policy: Any, poses: np.ndarray) -> None:
    show = getattr(policy, "see_truth", None)
    if show is not None:
        show(poses)
