"""Figures over trials with 95 % intervals that cover: t of means, and of the logarithm of a ratio.

A bootstrap (BCa) of the ratio of two means holds the truth in 88 to 94 % of samples of 20 to 60 trials;
the t interval of its logarithm in 93 to 95 % (`benchmarks/coverage.py`).
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy import stats

CONFIDENCE = 0.95
INTERVALS = "t over trials; of a ratio, t of its logarithm; of a median, order statistics"
_TAIL = 0.5 + 0.5 * CONFIDENCE

Sample = Float[np.ndarray, " trials"]


@dataclass(frozen=True, slots=True)
class Estimate:
    """A statistic over trials and its 95 % interval; None where there is none."""

    value: float | None
    low: float | None
    high: float | None


def linearised(value: float, influence: Sample) -> Estimate:
    """A smooth statistic with its t interval.

    Args:
        value: The statistic.
        influence: How much each trial moves it, times the number of trials (infinitesimal jackknife).
    """
    if len(influence) < 2 or not np.isfinite(value):
        return Estimate(value if np.isfinite(value) else None, None, None)
    half = _half(influence)
    return Estimate(value, value - half, value + half)


def mean_of(sample: Sample) -> Estimate:
    """Mean."""
    return linearised(float(sample.mean()), sample)


def difference(one: Float[np.ndarray, " ones"], other: Float[np.ndarray, " others"]) -> Estimate:
    """Mean of one sample less that of another, whose trials are not the same worlds (Welch)."""
    value = float(one.mean() - other.mean())
    if min(len(one), len(other)) < 2:
        return Estimate(value, None, None)
    of_each = [sample.var(ddof=1) / len(sample) for sample in (one, other)]
    variance = sum(of_each)
    if variance == 0.0:
        return Estimate(value, value, value)
    freedom = variance**2 / sum(v**2 / (len(x) - 1) for v, x in zip(of_each, (one, other), strict=True))
    half = float(stats.t.ppf(_TAIL, freedom) * np.sqrt(variance))
    return Estimate(value, value - half, value + half)


def ratio(other: Sample, reference: Sample) -> Estimate:
    """Mean of one sample over that of another of the same trials; none if that is not positive."""
    above, below = float(other.mean()), float(reference.mean())
    if below <= 0.0:
        return Estimate(None, None, None)
    if len(other) < 2 or above <= 0.0:
        return Estimate(above / below, None, None)
    factor = float(np.exp(_half(other / above - reference / below)))
    return Estimate(above / below, above / below / factor, above / below * factor)


def share(hits: Sample, of: Sample) -> Estimate:
    """Share of the items of all trials that are hits; a trial has any number of items."""
    if of.sum() == 0.0:
        return Estimate(None, None, None)
    whole = float(hits.sum() / of.sum())
    found = linearised(whole, (hits - whole * of) / of.mean())
    ends = (None if end is None else min(max(end, 0.0), 1.0) for end in (found.low, found.high))
    return Estimate(whole, *ends)


def reduction(better: Sample, worse: Sample) -> Estimate:
    """By how much the mean of one sample is less than that of another of the same trials, per cent."""
    kept = ratio(better, worse)
    ends = (kept.value, kept.high, kept.low)  # the more is kept, the less is gone
    return Estimate(*(None if end is None else 100.0 * (1.0 - end) for end in ends))


def median_of(sample: Sample) -> Estimate:
    """Median, between the order statistics that hold it with at least 95 % whatever the distribution."""
    value = float(np.median(sample))
    below = int(stats.binom.ppf(0.5 - 0.5 * CONFIDENCE, len(sample), 0.5))  # values that may lie on one side
    if below < 1:
        return Estimate(value, None, None)
    ordered = np.sort(sample)
    return Estimate(value, float(ordered[below - 1]), float(ordered[-below]))


def _half(influence: Sample) -> float:
    """Half the width of the interval."""
    n = len(influence)
    return float(stats.t.ppf(_TAIL, n - 1) * influence.std(ddof=1) / np.sqrt(n))
