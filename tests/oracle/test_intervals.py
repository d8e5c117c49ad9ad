"""Intervals over trials against closed forms and scipy."""

import numpy as np
import pytest
from scipy import stats

from baselines.evaluation import intervals
from baselines.evaluation.intervals import Estimate

SAMPLE, OTHER = np.array([1.0, 4.0, 2.0, 8.0, 5.0, 7.0]), np.array([2.0, 3.0, 9.0, 4.0, 1.0])


def ends(found: Estimate) -> tuple[float | None, float | None]:
    return found.low, found.high


def test_a_mean_has_students_interval() -> None:
    expected = stats.ttest_1samp(SAMPLE, 0.0).confidence_interval(0.95)
    found = intervals.mean_of(SAMPLE)
    assert found.value == pytest.approx(4.5)
    assert ends(found) == pytest.approx((expected.low, expected.high))


def test_a_difference_has_welchs_interval() -> None:
    expected = stats.ttest_ind(SAMPLE, OTHER, equal_var=False).confidence_interval(0.95)
    found = intervals.difference(SAMPLE, OTHER)
    assert found.value == pytest.approx(4.5 - 3.8)
    assert ends(found) == pytest.approx((expected.low, expected.high))


def test_a_ratio_is_the_inverse_of_its_inverse() -> None:
    """What an interval of a ratio ought to obey, and one that is symmetric about it does not."""
    found, turned = intervals.ratio(SAMPLE[:5], OTHER), intervals.ratio(OTHER, SAMPLE[:5])
    assert found.value == pytest.approx(20.0 / 19.0)
    assert found.low is not None
    assert found.high is not None
    assert ends(turned) == pytest.approx((1.0 / found.high, 1.0 / found.low))


def test_the_spread_of_a_ratio_is_the_jackknifes() -> None:
    """Standard error of the logarithm, with every trial left out once."""
    rng = np.random.default_rng(0)
    one, other = rng.gamma(3.0, 2.0, (2, 400))
    total, n = np.array([one.sum(), other.sum()]), len(one)
    logs = np.log((total[0] - one) / (total[1] - other))
    error = np.sqrt((n - 1) / n * ((logs - logs.mean()) ** 2).sum())
    found = intervals.ratio(one, other)
    assert found.high is not None
    assert found.value is not None
    assert np.log(found.high / found.value) == pytest.approx(stats.t.ppf(0.975, n - 1) * error, rel=0.01)


def test_pairs_that_all_have_one_ratio_are_certain() -> None:
    found = intervals.ratio(6.0 * OTHER, OTHER)
    assert (found.value, *ends(found)) == pytest.approx((6.0, 6.0, 6.0))
    saved = intervals.reduction(0.25 * OTHER, OTHER)
    assert (saved.value, *ends(saved)) == pytest.approx((75.0, 75.0, 75.0))


def test_a_share_of_trials_of_one_item_is_a_mean() -> None:
    hits = np.repeat([0.0, 1.0], [12, 28])
    found, mean = intervals.share(hits, np.ones(40)), intervals.mean_of(hits)
    assert (found.value, *ends(found)) == pytest.approx((mean.value, *ends(mean)))
    assert intervals.share(np.array([3.0, 2.0, 4.0]), np.array([3.0, 3.0, 4.0])).high == 1.0


@pytest.mark.parametrize("n", [6, 7, 20, 61])
def test_a_median_lies_between_order_statistics_that_hold_it(n: int) -> None:
    """Too few heads or tails put the median outside, in at most 5 %; no narrower pair has that."""
    sample = np.arange(float(n))
    found = intervals.median_of(sample)
    assert found.low is not None
    outside = 2.0 * stats.binom.cdf(found.low, n, 0.5)  # so few values on one side
    assert outside <= 0.05 < 2.0 * stats.binom.cdf(found.low + 1, n, 0.5)
    assert found.high == n - 1 - found.low


def test_what_has_no_interval_warns_of_nothing() -> None:
    assert intervals.mean_of(np.ones(1)) == Estimate(1.0, None, None)
    assert intervals.mean_of(np.full(5, 2.0)) == Estimate(2.0, 2.0, 2.0)
    assert intervals.ratio(np.ones(3), np.zeros(3)) == Estimate(None, None, None)
    assert intervals.ratio(np.zeros(3), np.ones(3)) == Estimate(0.0, None, None)
    assert intervals.median_of(np.arange(5.0)) == Estimate(2.0, None, None)
    assert intervals.difference(np.ones(1), np.ones(2)) == Estimate(0.0, None, None)
    assert intervals.difference(np.ones(4), np.ones(2)) == Estimate(0.0, 0.0, 0.0)
