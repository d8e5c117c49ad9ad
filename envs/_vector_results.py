"""Results of many worlds as arrays: put together from worlds that play, and those that stand still."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Float32, Int, Shaped

from envs._playing import Settings, Shown

Infos = dict[str, np.ndarray]
Columns = dict[str, Shaped[np.ndarray, "worlds robots ..."]]
_INFO = "infos/"


class Buffers(NamedTuple):
    """Arrays of the caller's that results are written into; flat observations only.

    Attributes:
        observations: Flat ones.
        rewards: Of each robot.
        terminations, truncations: Whether an episode ended, and how.
    """

    observations: Float32[np.ndarray, "worlds robots numbers"]
    rewards: Float[np.ndarray, "worlds robots"]
    terminations: Bool[np.ndarray, "worlds robots"]
    truncations: Bool[np.ndarray, "worlds robots"]


class VectorStep(NamedTuple):
    """What a step of all worlds gives; a world that is over stands still, with reward 0.

    Attributes:
        observations: float32, ``(worlds, robots, numbers)``; a dict of such arrays where asked for.
        rewards: Of each robot.
        terminations: The task of the world ended, by robot; stays until the world is reset.
        truncations: Its time is up, by robot; stays too.
        infos: Of fixed shapes and dtypes, ``(worlds, robots, ...)``.
    """

    observations: Any
    rewards: Float[np.ndarray, "worlds robots"]
    terminations: Bool[np.ndarray, "worlds robots"]
    truncations: Bool[np.ndarray, "worlds robots"]
    infos: Infos


class Part(NamedTuple):
    """Results of worlds that play together.

    Attributes:
        worlds: Numbers of those that count, in the batch.
        among: The same worlds among those of the part.
        columns: Of all worlds of the part.
    """

    worlds: Int[np.ndarray, " some"]
    among: Int[np.ndarray, " some"]
    columns: Columns


def columns_of(
    view: Shown,
    n_robots: int,
    rewards: Float[np.ndarray, " rows"] | None = None,
    ended: Bool[np.ndarray, " worlds"] | None = None,
    cut: Bool[np.ndarray, " worlds"] | None = None,
) -> Columns:
    """All that a step gives, with an axis of worlds; of a reset without rewards and ends."""
    n_rows = len(view.observations)
    off = np.zeros(n_rows // n_robots, dtype=bool)
    rows = {
        "observations": view.observations,
        "rewards": np.zeros(n_rows) if rewards is None else rewards,
        "terminations": (off if ended is None else ended).repeat(n_robots),
        "truncations": (off if cut is None else cut).repeat(n_robots),
        **{_INFO + name: column for name, column in view.infos.items()},
    }
    return {name: column.reshape(-1, n_robots, *column.shape[1:]) for name, column in rows.items()}


def merged(parts: Sequence[Part], last: Columns, n_worlds: int) -> Columns:
    """Results of all worlds; those in no part stand still."""
    if len(parts) == 1 and len(parts[0].worlds) == n_worlds:  # all of them, in order
        return parts[0].columns
    shapes = last or parts[0].columns
    out = {name: np.zeros((n_worlds, *column.shape[1:]), column.dtype) for name, column in shapes.items()}
    for name, column in last.items():
        if name != "rewards":
            out[name][...] = column
    for worlds, among, columns in parts:
        for name, column in columns.items():
            out[name][worlds] = column[among]
    return out


def step_of(columns: Columns, settings: Settings, buffers: Buffers | None) -> VectorStep:
    """Columns as a step gives them, in the caller's buffers if there are any."""
    infos = {name.removeprefix(_INFO): column for name, column in columns.items() if name.startswith(_INFO)}
    names = ("observations", "rewards", "terminations", "truncations")
    given = [columns[name] for name in names]
    if buffers is not None:
        for buffer, column in zip(buffers, given, strict=True):
            np.copyto(buffer, column, casting="same_kind")
        given = list(buffers)
    seen, rewards, ended, cut = given
    return VectorStep(_as_asked(seen, infos, settings), rewards, ended, cut, infos)


def _as_asked(seen: np.ndarray, infos: Infos, settings: Settings) -> Any:
    """Observations in the form of the environment's space."""
    if not settings.as_dict:
        return seen
    if settings.form.masks:
        return {"observation": seen, "action_mask": infos["action_mask"]}
    return {field.name: seen[..., field.where] for field in settings.layout}
