"""What users give an environment: names of overrides, options of a reset, seeds."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from wifipgo.errors import require
from wifipgo.scenarios import field_owners
from wifipgo.scenarios.letters import check_field

# Fields that decide the spaces or the length of an episode: fixed when an environment is made.
_FIXED = ("n_robots", "n_slots", "n_steps", "n_azimuths", "max_measurements")
# PettingZoo's own conformance test resets with ``options={"options": 1}``.
_IGNORED_OPTIONS = ("options",)


class NotResetError(AttributeError, RuntimeError):
    """Something of an episode was asked for before there is one; so ``hasattr`` says no."""


def scenario_fields(
    overrides: Mapping[str, Any], max_cycles: int | None, arguments: Iterable[str]
) -> dict[str, Any]:
    """Scenario fields to override, PettingZoo's name for the length among them.

    Raises:
        ValueError: A name that is neither a field nor an argument; lists both.
    """
    for name in overrides:
        check_field(name, {*arguments, *field_owners()})
    if max_cycles is None:
        return dict(overrides)
    require("n_steps" not in overrides, "max_cycles", "given without n_steps, its other name", max_cycles)
    return {**overrides, "n_steps": max_cycles}


def changes_of(options: Mapping[str, Any] | None) -> dict[str, Any]:
    """Scenario fields that reset options change."""
    require(options is None or isinstance(options, Mapping), "options", "None or a mapping", options)
    changes = {name: value for name, value in (options or {}).items() if name not in _IGNORED_OPTIONS}
    for name, value in changes.items():
        require(isinstance(name, str), "options", "a mapping from names of scenario fields", options)
        require(name not in _FIXED, f"options[{name!r}]", "set when the environment is made", value)
    return changes


def next_seed(seed: int | np.integer[Any] | None, before: tuple[int, int] | None) -> tuple[int, int]:
    """Root of all chance, and the number of the episode under it.

    Args:
        seed: Begins a sequence of episodes; without one the next of the sequence follows.
        before: Those of the episode before, if there was one.
    """
    if seed is not None:
        whole = isinstance(seed, int | np.integer) and not isinstance(seed, bool)
        require(whole and seed >= 0, "seed", "None or an integer >= 0", seed)
        return int(seed), 0
    if before is not None:
        return before[0], before[1] + 1
    root = np.random.SeedSequence().entropy
    return root if isinstance(root, int) else 0, 0
