"""Scores of many scenarios as one figure: interquartile mean and probability of improvement.

Agarwal, Schwarzer, Castro, Courville and Bellemare, "Deep reinforcement learning at the edge of the
statistical precipice", NeurIPS 2021. Intervals are from a bootstrap that is stratified by scenario, as there;
unlike there, worlds are drawn for all policies at once, since all play the same.
"""

from typing import cast

import numpy as np
from jaxtyping import Float, Int
from scipy import stats

from baselines.evaluation.intervals import CONFIDENCE, Estimate

N_RESAMPLES = 2_000
_CUT = 0.25  # of the scores at either end
_SEED = 0  # of the resampling: the same scores give the same interval

Scores = Float[np.ndarray, "scenarios worlds"]
Draws = Int[np.ndarray, "resamples scenarios worlds"]


def draws(n_scenarios: int, n_worlds: int, n_resamples: int = N_RESAMPLES) -> Draws:
    """Numbers of the worlds of each resample, drawn within each scenario."""
    rng = np.random.default_rng(_SEED)
    return rng.integers(n_worlds, size=(n_resamples, n_scenarios, n_worlds))


def interquartile_mean(scores: Scores, drawn: Draws) -> Estimate:
    """Mean of the middle half of the scores of all scenarios and worlds."""
    again = scores[np.arange(len(scores))[:, None], drawn].reshape(len(drawn), -1)
    return _between(float(_middle(scores.reshape(1, -1))[0]), _middle(again))


def probability_of_improvement(one: Scores, other: Scores, drawn: Draws) -> Estimate:
    """Chance that a score of one is above one of the other, ties half, averaged over scenarios.

    Both are taken of any two worlds of a scenario, not of the same: it is the U of Mann and Whitney over the
    number of pairs.
    """
    wins = (one[:, :, None] > other[:, None]) + 0.5 * (one[:, :, None] == other[:, None])
    again = np.zeros(len(drawn))
    for k, of in enumerate(wins):
        counts = _counts(drawn[:, k])
        again += np.einsum("rw,rw->r", counts @ of, counts)
    return _between(float(wins.mean()), again / wins.size)


def _counts(drawn: Int[np.ndarray, "resamples worlds"]) -> Float[np.ndarray, "resamples worlds"]:
    """How often each world is in each resample."""
    n, n_worlds = drawn.shape
    places = (np.arange(n)[:, None] * n_worlds + drawn).ravel()
    return np.bincount(places, minlength=n * n_worlds).reshape(n, n_worlds).astype(np.float64)


def _middle(scores: Float[np.ndarray, "rows scores"]) -> Float[np.ndarray, " rows"]:
    return cast(np.ndarray, stats.trim_mean(scores, _CUT, axis=1))


def _between(value: float, again: Float[np.ndarray, " resamples"]) -> Estimate:
    """With the percentile interval of what the resamples gave."""
    low, high = np.quantile(again, [0.5 - 0.5 * CONFIDENCE, 0.5 + 0.5 * CONFIDENCE])
    return Estimate(value, float(low), float(high))
