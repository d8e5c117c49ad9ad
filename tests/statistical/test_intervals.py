"""Intervals hold the truth as often as they say, where figures are as skewed as errors of episodes are."""

from collections.abc import Callable

import numpy as np
import pytest

from baselines.evaluation import intervals
from baselines.evaluation.intervals import Estimate

SAMPLES = 1_000


def errors(rng: np.random.Generator, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of errors: the other's seven times the reference's, both skewed (gamma), a third of it shared."""
    shared = rng.gamma(0.6, 1.0, n)
    return 7.0 * (shared + rng.gamma(1.2, 1.0, n)), shared + rng.gamma(1.2, 1.0, n)


def held(found: Estimate, truth: float) -> bool:
    return found.low is not None and found.high is not None and found.low <= truth <= found.high


def ratio(rng: np.random.Generator, n: int) -> bool:
    return held(intervals.ratio(*errors(rng, n)), 7.0)


def reduction(rng: np.random.Generator, n: int) -> bool:
    other, reference = errors(rng, n)
    return held(intervals.reduction(reference, other), 100.0 * (1.0 - 1.0 / 7.0))


def difference(rng: np.random.Generator, n: int) -> bool:
    return held(intervals.difference(rng.poisson(2.6, n) * 1.0, rng.poisson(2.6, n) * 1.0), 0.0)


def share(rng: np.random.Generator, n: int) -> bool:
    """Items of a trial are alike: each trial has a chance of its own."""
    items = rng.integers(20, 60, n)
    return held(intervals.share(rng.binomial(items, rng.beta(4.0, 2.0, n)) * 1.0, items * 1.0), 4.0 / 6.0)


def median(rng: np.random.Generator, n: int) -> bool:
    return held(intervals.median_of(rng.exponential(1.0, n)), float(np.log(2.0)))


@pytest.mark.parametrize("of", [ratio, reduction, difference, share, median])
@pytest.mark.parametrize("n", [20, 60, 480])
def test_coverage(of: Callable[[np.random.Generator, int], bool], n: int) -> None:
    """95 % but for 1.5 % of chance and some of skewness with few trials; of a median, which is safe, more."""
    rng = np.random.default_rng(n)
    covered = np.mean([of(rng, n) for _ in range(SAMPLES)])
    assert 0.93 - 0.01 * (n == 20) <= covered <= (0.99 if of is median else 0.968)


def test_a_mean_level_does_not_fall_with_the_number_of_trials_as_the_highest_point_does() -> None:
    """Curves of independent noise about 1: the mean stays, the maximum of the mean curve falls by half."""
    curves = np.random.default_rng(0).gamma(1.0, 1.0, (400, 480, 40))
    few, many = curves[:, :20], curves
    assert abs(few.mean() - many.mean()) < 0.01
    highest = [part.mean(axis=1).max(axis=1).mean() - 1.0 for part in (few, many)]
    assert highest[1] < 0.5 * highest[0]
