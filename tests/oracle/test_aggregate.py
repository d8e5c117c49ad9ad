"""Figures over a suite beside those of rliable 1.2, the code of Agarwal et al. (2021)."""

import numpy as np
import pytest

from baselines.suite.aggregate import draws, interquartile_mean, probability_of_improvement

# Runs times tasks, as rliable has them, and what its `metrics` says of them.
ONE = (
    (0.5, 1.9, 1.0),
    (0.1, 1.5, 0.6),
    (2.0, 1.1, 0.2),
    (1.6, 0.7, 2.1),
    (1.2, 0.3, 1.7),
    (0.8, 2.2, 1.3),
    (0.4, 1.8, 0.9),
)
OTHER = (
    (1.38, 0.25, 1.5),
    (0.38, 1.62, 0.5),
    (1.75, 0.62, 1.88),
    (0.75, 2.0, 0.88),
    (2.12, 1.0, 2.25),
    (1.12, 0.0, 1.25),
    (0.12, 1.38, 0.25),
)
IQM_ONE, IQM_OTHER, P_ONE, P_OTHER = (
    1.1272727272727272,
    1.0909090909090908,
    0.5306122448979592,
    0.46938775510204084,
)


def test_values_are_those_of_rliable() -> None:
    one, other, drawn = np.array(ONE).T, np.array(OTHER).T, draws(3, 7, 50)
    assert interquartile_mean(one, drawn).value == pytest.approx(IQM_ONE, abs=1e-12)
    assert interquartile_mean(other, drawn).value == pytest.approx(IQM_OTHER, abs=1e-12)
    assert probability_of_improvement(one, other, drawn).value == pytest.approx(P_ONE, abs=1e-12)
    assert probability_of_improvement(other, one, drawn).value == pytest.approx(P_OTHER, abs=1e-12)


def test_ties_are_half_and_certainty_is_one() -> None:
    scores, drawn = np.linspace(0.0, 1.0, 12).reshape(2, 6), draws(2, 6, 50)
    assert probability_of_improvement(scores, scores, drawn).value == 0.5
    sure = probability_of_improvement(scores + 2.0, scores, drawn)
    assert (sure.value, sure.low, sure.high) == (1.0, 1.0, 1.0)


def test_resampled_chance_is_that_of_the_resampled_scores() -> None:
    """Counts of worlds give what the drawn worlds themselves give."""
    rng = np.random.default_rng(3)
    one, other, drawn = rng.random((2, 9)), rng.random((2, 9)), draws(2, 9, 40)
    each = []
    for resample in drawn:
        pairs = [(x[w], y[w]) for x, y, w in zip(one, other, resample, strict=True)]
        each.append(np.mean([(x[:, None] > y).mean() + 0.5 * (x[:, None] == y).mean() for x, y in pairs]))
    found = probability_of_improvement(one, other, drawn)
    assert [found.low, found.high] == pytest.approx(np.quantile(each, [0.025, 0.975]), abs=1e-12)


def test_intervals_cover() -> None:
    """The interquartile mean of a normal sample of two scenarios is held in about 95 % of 100 samples."""
    rng, drawn = np.random.default_rng(0), draws(2, 40, 100)
    found = [interquartile_mean(rng.normal(size=(2, 40)), drawn) for _ in range(100)]
    held = np.mean([e.low is not None and e.high is not None and e.low <= 0.0 <= e.high for e in found])
    assert 0.85 <= held <= 1.0
