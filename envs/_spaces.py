"""Spaces of observations, and observations in the form that a space asks for."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium import spaces
from jaxtyping import Float, Int8

from envs._observation import Field


def flat_space(fields: tuple[Field, ...]) -> spaces.Box:
    """Box of the flat observation."""
    low = np.concatenate([np.full(f.size, f.low, np.float32) for f in fields])
    high = np.concatenate([np.full(f.size, f.high, np.float32) for f in fields])
    return spaces.Box(low, high, dtype=np.float32)


def dict_space(fields: tuple[Field, ...]) -> spaces.Dict:
    """The same blocks by name."""
    return spaces.Dict({f.name: spaces.Box(f.low, f.high, (f.size,), np.float32) for f in fields})


def space_of(fields: tuple[Field, ...], *, as_dict: bool, n_choices: int) -> spaces.Space[Any]:
    """Space of one robot; ``n_choices`` > 0 puts a mask beside the flat observation of a dict."""
    if not as_dict:
        return flat_space(fields)
    if not n_choices:
        return dict_space(fields)
    mask = spaces.Box(0, 1, (n_choices,), np.int8)
    return spaces.Dict({"observation": flat_space(fields), "action_mask": mask})


def by_agent(
    rows: Float[np.ndarray, "robots numbers"],
    agents: list[str],
    fields: tuple[Field, ...] | None,
    masks: Int8[np.ndarray, "robots choices"] | None,
) -> dict[str, Any]:
    """Observations as `space_of` has them: of dicts where there are ``fields``."""
    if fields is None:
        return dict(zip(agents, rows, strict=True))
    if masks is None:
        return {agent: by_name(row, fields) for agent, row in zip(agents, rows, strict=True)}
    pairs = zip(agents, rows, masks.copy(), strict=True)  # infos have the same masks
    return {agent: {"observation": row, "action_mask": mask} for agent, row, mask in pairs}


def by_name(
    row: Float[np.ndarray, " numbers"], fields: tuple[Field, ...]
) -> Mapping[str, Float[np.ndarray, " size"]]:
    """Cut a flat observation into its blocks."""
    return {f.name: row[f.where] for f in fields}
