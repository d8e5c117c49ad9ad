"""How actions are written: three numbers, or one of 34 choices. Checked here, by agent, and made commands."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
from gymnasium import spaces
from jaxtyping import Bool, Float, Int8, Real

from envs.directions import N_CHOICES, N_MOTIONS, STAY, choice_mask, waypoints_of
from wifipgo.errors import BadInputError, quoted, require
from wifipgo.scenarios import Scenario
from wifipgo.state import Belief, Commands

# Kinds of numpy's dtypes that are real numbers: no text, no dates, no complex numbers.
_REAL, _WHOLE = "biuf", "iu"

Rows = Real[np.ndarray, "robots ..."]


@dataclass(frozen=True, slots=True, kw_only=True)
class ActionForm:
    """One way to write an action.

    Attributes:
        space: Makes the space of one robot.
        shape: Of one robot's action.
        rule: What an action has to be, in words.
        good: Which rows of an array are actions.
        clipped: Rows within the space, in the dtype that commands are made of.
        idle: The action that does nothing.
        rows: Stacks actions, one row an agent, or says what is wrong with the first that is refused.
        commands: What such rows mean to robots that believe something.
        masks: Choices that have an effect of their own, one row a robot; None where nothing is chosen.
    """

    space: Callable[[], spaces.Space[Any]]
    shape: tuple[int, ...]
    rule: str
    good: Callable[[Rows], Bool[np.ndarray, " robots"]]
    clipped: Callable[[Rows], Rows]
    idle: Any
    rows: Callable[[Mapping[str, Any], list[str]], Rows]
    commands: Callable[[Rows, Belief, Scenario], Commands]
    masks: Callable[[Belief, Scenario], Int8[np.ndarray, "robots choices"]] | None = None


def checked_rows(form: ActionForm, actions: Mapping[str, Any], agents: list[str]) -> Rows:
    """One row for each of these agents, and no action for others.

    Raises:
        ValueError: Names the agent, the rule and the action got.
    """
    require(
        isinstance(actions, Mapping), "actions", "a mapping from agents to actions", type(actions).__name__
    )
    for name in actions.keys() - set(agents):
        require(False, f"actions[{name!r}]", f"for one of {agents}", name)
    for agent in agents:
        if agent not in actions:
            raise BadInputError(f"actions[{agent!r}] must be given: one action for each live agent")
    return form.rows(actions, agents)


def _waypoint_rows(actions: Mapping[str, Any], agents: list[str]) -> Rows:
    """Waypoints and requests, what is outside [-1, 1] clipped."""
    rows = _stacked(actions, agents)
    if rows.shape != (len(agents), 3) or rows.dtype.kind not in _REAL:
        for agent in agents:
            _check_waypoint(agent, actions[agent])
        raise BadInputError(f"actions must be three numbers each, got {dict(actions)}")
    if not np.isfinite(rows).all():
        first = int(np.isfinite(rows).all(axis=1).argmin())
        raise BadInputError(f"actions[{agents[first]!r}] must be finite, got {rows[first].tolist()}")
    return _clipped(rows)


def _clipped(rows: Rows) -> Rows:
    return np.minimum(np.maximum(rows.astype(np.float64), -1.0), 1.0)


def _are_waypoints(rows: Rows) -> Bool[np.ndarray, " robots"]:
    good: np.ndarray = np.isfinite(rows).all(axis=1) & (rows.dtype.kind in _REAL)
    return good


def _are_choices(rows: Rows) -> Bool[np.ndarray, " robots"]:
    good: np.ndarray = (rows >= 0) & (rows < N_CHOICES) & (rows.dtype.kind in _WHOLE)
    return good


def _choice_rows(actions: Mapping[str, Any], agents: list[str]) -> Rows:
    """Choices; an array of one number counts as that number."""
    return np.array([_choice(agent, actions[agent]) for agent in agents], dtype=np.int64)


def _stacked(actions: Mapping[str, Any], agents: list[str]) -> np.ndarray:
    try:
        return np.array([actions[agent] for agent in agents])
    except (TypeError, ValueError):
        return np.zeros(0)


def _check_waypoint(agent: str, action: Any) -> None:
    shape = _shape(action)
    rule = "of shape (3,)"
    if shape in {(), (1,)} and np.array(action).dtype.kind in _WHOLE:
        rule += " with actions='continuous' (a choice is for actions='discrete')"
    require(shape == (3,), f"actions[{agent!r}]", rule, shape)
    real = np.array(action).dtype.kind in _REAL
    require(real, f"actions[{agent!r}]", "three numbers", action)


def _choice(agent: str, action: Any) -> int:
    shape = _shape(action)
    if shape in {(), (1,)} and np.asarray(action).dtype.kind in _WHOLE:
        choice = int(np.asarray(action).item())
        if 0 <= choice < N_CHOICES:
            return choice
    rule = f"one choice in 0..{N_CHOICES - 1} with actions='discrete'"
    if shape == (3,):
        rule += " (three numbers are for actions='continuous')"
    raise BadInputError(f"actions[{agent!r}] must be {rule}, got {quoted(action)}")


def _shape(action: Any) -> Any:
    try:
        return np.shape(action)
    except ValueError:
        return "parts of different lengths"


def _driven(rows: Rows, belief: Belief, scenario: Scenario) -> Commands:
    return Commands(rows[:, :2], rows[:, 2] > 0.0)


def _chosen(rows: Rows, belief: Belief, scenario: Scenario) -> Commands:
    """Rounded as an action of three numbers would be, so both forms drive the same way to the bit."""
    waypoints = waypoints_of(rows % N_MOTIONS, _free_steps(belief, scenario)).astype(np.float32)
    return Commands(waypoints.astype(np.float64), rows >= N_MOTIONS)


def _masks(belief: Belief, scenario: Scenario) -> Int8[np.ndarray, "robots choices"]:
    """A call goes to whose last ping passed, as Algorithm 2 will look at it when the choice is played."""
    reaches = (belief.radio.rate_mbit_s > 0.0).any(axis=1)
    return choice_mask(_free_steps(belief, scenario), np.asarray(reaches))


def _free_steps(belief: Belief, scenario: Scenario) -> Float[np.ndarray, "robots rays"]:
    """Lidar in each robot's own step lengths, by the numbers that the observation shows."""
    arena = scenario.arena
    shown = (belief.sensed.lidar_m / arena.lidar_range_m).astype(np.float32).astype(np.float64)
    steps_m = arena.steps_m(scenario.n_robots, len(shown) // scenario.n_robots)
    return arena.lidar_range_m / np.maximum(steps_m, 1e-6)[:, None] * shown


ACTION_FORMS: Mapping[str, ActionForm] = MappingProxyType(
    {
        "continuous": ActionForm(
            space=lambda: spaces.Box(-1.0, 1.0, (3,), np.float32),
            shape=(3,),
            rule="three finite numbers",
            good=_are_waypoints,
            clipped=_clipped,
            idle=np.array([0.0, 0.0, -1.0]),
            rows=_waypoint_rows,
            commands=_driven,
        ),
        "discrete": ActionForm(
            space=lambda: spaces.Discrete(N_CHOICES),
            shape=(),
            rule=f"one choice in 0..{N_CHOICES - 1}",
            good=_are_choices,
            clipped=lambda rows: rows.astype(np.int64),
            idle=STAY,
            rows=_choice_rows,
            commands=_chosen,
            masks=_masks,
        ),
    }
)
