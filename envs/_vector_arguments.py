"""What users give an environment of many worlds: how many, actions, seeds, which of them begin anew."""

import os
from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Bool, Int, Shaped

from envs._actions import ActionForm
from wifipgo.errors import BadInputError, require
from wifipgo.scenarios import Scenario

# Bytes, measured on batches late in an episode: of a robot and iteration, of a pair, of a link's CSI entry.
_PER_POSE, _PER_PAIR, _PER_ENTRY, _PER_ROBOT = 1500, 150, 30, 20_000


def bytes_of(n_worlds: int, scenario: Scenario) -> float:
    """About how much memory a batch takes at most."""
    n, turn = scenario.n_robots, scenario.turn
    robot = _PER_ROBOT + _PER_POSE * scenario.n_steps + _PER_PAIR * n
    robot += scenario.n_slots * (_PER_ENTRY * turn.n_positions * 30 + 16 * turn.n_azimuths)
    return float(n_worlds) * n * robot


def checked_n_worlds(n_worlds: Any, scenario: Scenario) -> int:
    """A number of worlds that fits in this machine's memory.

    Raises:
        ValueError: Less than 1, or too many; says how much memory they would take.
    """
    whole = isinstance(n_worlds, int | np.integer) and not isinstance(n_worlds, bool)
    require(whole and n_worlds >= 1, "n_worlds", "an integer >= 1", n_worlds)
    there, wanted = _memory_bytes(), bytes_of(int(n_worlds), scenario)
    if wanted > there:
        rule = f"such that all worlds fit in {there / 1e9:.3g} GB of memory"
        raise BadInputError(
            f"n_worlds must be {rule}, got {n_worlds}: about {wanted / 1e9:.3g} GB for {scenario.name!r}"
        )
    return int(n_worlds)


def _memory_bytes() -> float:
    """Memory of the machine; without bound where it does not say."""
    try:
        return float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    except (AttributeError, OSError, ValueError):
        return float("inf")


def checked_mask(mask: Any, n_worlds: int) -> Int[np.ndarray, " some"]:
    """Worlds that begin anew."""
    if mask is None:
        return np.arange(n_worlds)
    given = np.asarray(mask)
    right = given.shape == (n_worlds,) and given.dtype == np.bool_
    require(right, "options['reset_mask']", f"{n_worlds} bools, one a world", mask)
    require(bool(given.any()), "options['reset_mask']", "True for some world", mask)
    return np.flatnonzero(given)


def checked_seeds(
    seed: int | np.integer[Any] | Sequence[int | None] | None, n_worlds: int
) -> list[int | np.integer[Any] | None]:
    """A seed for each world, or none: of world 0 and those that follow it, or one given for each."""
    if seed is None:
        return [None] * n_worlds
    if isinstance(seed, int | np.integer) and not isinstance(seed, bool):
        require(seed >= 0, "seed", "None, an integer >= 0 or one for each world", seed)
        return [int(seed) + k for k in range(n_worlds)]
    require(
        not isinstance(seed, str | bool) and hasattr(seed, "__len__"),
        "seed",
        "None, an integer >= 0 or one for each world",
        seed,
    )
    require(len(seed) == n_worlds, "seed", f"{n_worlds} long, one a world", len(seed))  # type: ignore[arg-type]
    return list(seed)  # type: ignore[arg-type]


def checked_actions(
    form: ActionForm, actions: Any, over: Bool[np.ndarray, " worlds"], n_robots: int
) -> Shaped[np.ndarray, "robots ..."]:
    """Actions of all worlds, one row a robot; those of worlds that are over are not looked at.

    Raises:
        ValueError: Another shape, or something that is no action; names world and robot.
    """
    shape = (len(over), n_robots, *form.shape)
    try:
        given = np.asarray(actions)
    except ValueError:
        given = np.zeros(0)
    require(given.shape == shape, "actions", f"of shape {shape}", given.shape)
    rows = given.reshape(-1, *form.shape)
    good = form.good(rows) | over.repeat(n_robots)
    if not good.all():
        world, robot = divmod(int(good.argmin()), n_robots)
        require(
            False,
            f"actions[{world}, {robot}] of world {world}, robot_{robot}",
            form.rule,
            given[world, robot],
        )
    if over.any():
        rows = np.where(over.repeat(n_robots).reshape(-1, *(1,) * len(form.shape)), form.idle, rows)
    return form.clipped(rows)
