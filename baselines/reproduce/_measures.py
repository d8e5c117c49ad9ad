"""Figures of paired episodes, each with a 95 % interval."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from baselines.evaluation.episodes import Episode
from baselines.evaluation.statistics import Estimate, bootstrap, ratio_of_means

EARLY = 10  # iterations that the paper's curves need to part


def column(episodes: Sequence[Episode], *figures: str) -> Float[np.ndarray, " trials"]:
    """A figure of every episode, or the sum of several."""
    return np.array([sum(episode.figures[figure] for figure in figures) for episode in episodes], dtype=float)


def truth_error(episodes: Sequence[Episode]) -> Float[np.ndarray, " trials"]:
    """Ground-truth error of the team at the end as the paper adds it up, Eq. 12 + Eq. 13."""
    return column(episodes, "ate_trans", "ate_rot")


def err_ratio(other: Sequence[Episode], reference: Sequence[Episode]) -> Estimate:
    """Err of the last ten iterations, one policy's over another's."""
    return bootstrap((column(other, "err_last10"), column(reference, "err_last10")), ratio_of_means)


def reduction(
    better: Float[np.ndarray, " trials"], worse: Float[np.ndarray, " trials"], *, robust: bool = False
) -> Estimate:
    """By how much the mean of one sample is less than that of another, per cent."""

    def statistic(one: np.ndarray, other: np.ndarray, axis: int = -1) -> np.ndarray:
        return np.asarray(100.0 * (1.0 - ratio_of_means(one, other, axis)))

    return bootstrap((better, worse), statistic, method="percentile" if robust else "BCa")


def truth_reduction(better: Sequence[Episode], worse: Sequence[Episode]) -> Estimate:
    """By how much the ground-truth error is less, per cent."""
    return reduction(truth_error(better), truth_error(worse))


def mean_curves(episodes: Sequence[Episode]) -> Float[np.ndarray, "trials iterations"]:
    """Err of every iteration, mean over robots."""
    return np.stack([episode.steps["err"].mean(axis=1) for episode in episodes])


def highest_mean(episodes: Sequence[Episode], threshold: float) -> Estimate:
    """Highest point of the mean curve after the first ten iterations, in thresholds."""
    curves = mean_curves(episodes)[:, EARLY:] / threshold

    def statistic(trials: np.ndarray, axis: int = -1) -> np.ndarray:
        return np.asarray(curves[trials.astype(int)].mean(axis=-2).max(axis=-1))

    return bootstrap((np.arange(len(curves), dtype=float),), statistic)


def late_mean(episodes: Sequence[Episode], threshold: float) -> Estimate:
    """Mean Err of the last ten iterations, in thresholds."""
    return bootstrap((column(episodes, "err_last10") / threshold,), np.mean)


def difference_of_means(one: Float[np.ndarray, " ones"], other: Float[np.ndarray, " others"]) -> Estimate:
    """Mean of one sample less that of another, drawn apart: their worlds are not the same."""
    value = float(one.mean() - other.mean())
    if min(len(one), len(other)) < 2:
        return Estimate(value, None, None)
    rng = np.random.default_rng(0)
    drawn = [rng.choice(sample, (9_999, len(sample))).mean(axis=1) for sample in (one, other)]
    low, high = np.percentile(drawn[0] - drawn[1], [2.5, 97.5])
    return Estimate(value, float(low), float(high))
