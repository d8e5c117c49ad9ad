"""Figures of paired episodes, each with a 95 % interval; none is biased by how many there are."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float

from baselines.evaluation.episodes import Episode
from baselines.evaluation.intervals import Estimate, mean_of, ratio, reduction, share

EARLY = 10  # iterations that the paper's curves need to part

Trials = Float[np.ndarray, " trials"]


def column(episodes: Sequence[Episode], *figures: str) -> Trials:
    """A figure of every episode, or the sum of several."""
    return np.array([sum(episode.figures[figure] for figure in figures) for episode in episodes], dtype=float)


def truth_error(episodes: Sequence[Episode]) -> Trials:
    """Ground-truth error of the team at the end as the paper adds it up, Eq. 12 + Eq. 13."""
    return column(episodes, "ate_trans", "ate_rot")


def err_ratio(other: Sequence[Episode], reference: Sequence[Episode]) -> Estimate:
    """Err of the last ten iterations, one policy's over another's."""
    return ratio(column(other, "err_last10"), column(reference, "err_last10"))


def truth_reduction(better: Sequence[Episode], worse: Sequence[Episode]) -> Estimate:
    """By how much the ground-truth error is less, per cent."""
    return reduction(truth_error(better), truth_error(worse))


def mean_curves(episodes: Sequence[Episode]) -> Float[np.ndarray, "trials iterations"]:
    """Err of every iteration, mean over robots."""
    return np.stack([episode.steps["err"].mean(axis=1) for episode in episodes])


def late_level(episodes: Sequence[Episode], threshold: float) -> Estimate:
    """Mean Err of the last ten iterations, in thresholds."""
    return mean_of(column(episodes, "err_last10") / threshold)


def level(episodes: Sequence[Episode], threshold: float, *, at_passes: bool = False) -> Estimate:
    """Mean Err after the first ten iterations, in thresholds.

    Args:
        episodes: One a trial.
        threshold: delta of Algorithm 2.
        at_passes: Only where Algorithm 2 reads it: once a pass, so never while a call of the robot's is up.
    """
    return ratio(*_summed([_late(episode) / threshold for episode in episodes], episodes, at_passes))


def share_within(episodes: Sequence[Episode], threshold: float, *, at_passes: bool = False) -> Estimate:
    """Share of robots and iterations after the first ten whose Err is at most the threshold."""
    within = [(_late(episode) <= threshold).astype(float) for episode in episodes]
    return share(*_summed(within, episodes, at_passes))


def _late(episode: Episode) -> Float[np.ndarray, "iterations robots"]:
    return np.asarray(episode.steps["err"][EARLY:], dtype=float)


def _summed(
    values: Sequence[np.ndarray], episodes: Sequence[Episode], at_passes: bool
) -> tuple[Trials, Trials]:
    """Sum over robots and iterations of each trial, and how many they were: there are as many as passes."""
    counted = [_read(episode) | (not at_passes) for episode in episodes]
    total = np.array([x[at].sum() for x, at in zip(values, counted, strict=True)])
    return total, np.array([at.sum() for at in counted], dtype=float)


def _read(episode: Episode) -> Bool[np.ndarray, "iterations robots"]:
    """Whether Algorithm 2 is between two passes."""
    return ~np.asarray(episode.steps["calling"][EARLY:], dtype=bool)
