"""Bootstrap intervals against closed forms."""

import numpy as np
import pytest
from scipy import stats

from baselines.evaluation.statistics import bootstrap


def test_interval_of_a_mean_is_the_normal_one() -> None:
    """Of many samples with little skew, the interval is mean +- 1.96 s / sqrt(n)."""
    sample = np.random.default_rng(0).normal(3.0, 2.0, 400)
    found = bootstrap((sample,), np.mean)
    half = stats.norm.ppf(0.975) * sample.std() / np.sqrt(len(sample))
    assert found.value == pytest.approx(sample.mean())
    assert found.low == pytest.approx(sample.mean() - half, abs=0.1 * half)
    assert found.high == pytest.approx(sample.mean() + half, abs=0.1 * half)


def test_interval_of_zeros_and_ones_is_binomial() -> None:
    """Resamples of n zeros and ones have binomial means: the interval is their quantiles, to a step."""
    n, share = 40, 10 / 40
    sample = np.repeat([0.0, 1.0], np.array([30, 10]))
    found = bootstrap((sample,), np.mean, method="percentile")
    assert found.low == pytest.approx(stats.binom.ppf(0.025, n, share) / n, abs=1.01 / n)
    assert found.high == pytest.approx(stats.binom.ppf(0.975, n, share) / n, abs=1.01 / n)


def test_degenerate_samples_warn_of_nothing() -> None:
    """Equal values have an interval of no width, one value has none."""
    equal = bootstrap((np.full(5, 2.0),), np.mean)
    assert (equal.value, equal.low, equal.high) == (2.0, 2.0, 2.0)
    one = bootstrap((np.ones(1),), np.mean)
    assert (one.value, one.low, one.high) == (1.0, None, None)
