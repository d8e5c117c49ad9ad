"""Worlds that end begin anew in the same step: what frameworks call same-step autoreset, in one place."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Bool, Shaped

from envs._vector import RESET_MASK, RendezvousVectorEnv
from envs._vector_results import Infos, VectorStep

Begin = Callable[[Bool[np.ndarray, " worlds"]], tuple[Any, Infos]]


class Turn(NamedTuple):
    """A step of all worlds, after which none is over.

    Attributes:
        step: Rewards, flags and infos of the step; observations of the new episode where one ended.
        ended: Worlds whose episode ended with this step and was followed by the next.
        final_observations: Last ones of the worlds that ended, ``(ended worlds, robots, numbers)``.
        first_infos: Of all worlds, those of new episodes where one began; empty where none ended.
    """

    step: VectorStep
    ended: Bool[np.ndarray, " worlds"]
    final_observations: Any
    first_infos: Infos


def step_and_reset(
    env: RendezvousVectorEnv,
    actions: Shaped[np.ndarray, "worlds robots ..."],
    begin: Begin | None = None,
) -> Turn:
    """Advance every world, and begin the next episode where one ends.

    Args:
        env: None of its worlds is over.
        actions: As `RendezvousVectorEnv.step` takes them.
        begin: Resets the worlds of a mask; without it the next episode of each of these worlds follows.
    """
    step = env.step(actions)
    ended = env.over
    if not ended.any():
        return Turn(step, ended, _of(step.observations, ended), {})
    final = _of(step.observations, ended)
    flags = step.rewards.copy(), step.terminations.copy(), step.truncations.copy()  # buffers are written anew
    seen, first_infos = begin(ended) if begin else env.reset(options={RESET_MASK: ended})
    return Turn(VectorStep(seen, *flags, step.infos), ended, final, first_infos)


def _of(observations: Any, worlds: Bool[np.ndarray, " worlds"]) -> Any:
    """A copy of the observations of some worlds."""
    if isinstance(observations, dict):
        return {name: block[worlds] for name, block in observations.items()}
    return observations[worlds]
