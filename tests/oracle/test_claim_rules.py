"""Rules of verdicts, the equivalence test, figures of paired episodes: against answers known otherwise."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from baselines.evaluation.episodes import Episode, run_episode
from baselines.evaluation.statistics import Estimate
from baselines.reproduce import _measures, _rules
from baselines.reproduce._claims import BESIDE, HEADLINE, Found, judged
from wifipgo.scenarios import scenario_named


@pytest.mark.parametrize(
    ("rule", "value", "low", "high", "verdict"),
    [
        (_rules.at_least(6.0, 1.0), 7.0, 2.0, 9.0, "reproduced"),
        (_rules.at_least(6.0, 1.0), 5.9, 2.0, 9.0, "partly"),
        (_rules.at_least(6.0, 1.0), 7.0, 0.9, 20.0, "not"),
        (_rules.at_most(1.2), 1.0, 0.9, 1.2, "reproduced"),
        (_rules.at_most(1.2), 1.1, 0.9, 1.3, "partly"),
        (_rules.at_most(1.2), 1.3, 0.9, 1.5, "not"),
        (_rules.above(1.2), 2.0, 1.3, 3.0, "reproduced"),
        (_rules.above(1.2), 2.0, 1.1, 3.0, "partly"),
        (_rules.above(1.2), 1.0, 0.5, 3.0, "not"),
        (_rules.within(0.1), 0.0, -0.05, 0.1, "reproduced"),
        (_rules.within(0.1), 0.05, -0.2, 0.2, "partly"),
        (_rules.within(0.1), -0.2, -0.3, 0.0, "not"),
        (_rules.no_better(), 1.0, 1.0, 1.0, "reproduced"),
        (_rules.no_better(), 0.9, 0.7, 1.1, "partly"),
        (_rules.no_better(), 0.5, 0.3, 0.9, "not"),
        (_rules.differs(0.5), -1.0, -1.5, -0.1, "reproduced"),
        (_rules.differs(0.5), -1.0, -2.0, 0.1, "partly"),
        (_rules.differs(0.5), 0.2, -1.0, 1.0, "not"),
    ],
)
def test_verdicts(rule: _rules.Rule, value: float, low: float, high: float, verdict: str) -> None:
    assert rule.judge(Estimate(value, low, high)) == verdict


def test_one_seed_has_no_verdict() -> None:
    rules = [_rules.at_least(6.0, 1.0), _rules.at_most(1.0), _rules.above(1.0), _rules.within(0.1)]
    rules += [_rules.no_better(), _rules.differs(1.0)]
    assert {rule.judge(Estimate(7.0, None, None)) for rule in rules} == {_rules.OPEN}


@pytest.mark.parametrize(
    ("verdicts", "whole"),
    [
        (["reproduced", "reproduced"], "reproduced"),
        (["reproduced", "not"], "partly"),
        (["partly"], "partly"),
        (["not", "not"], "not"),
        (["reproduced", _rules.OPEN], _rules.OPEN),
    ],
)
def test_verdict_of_several_conditions(verdicts: list[str], whole: str) -> None:
    assert _rules.combined(verdicts) == whole


def test_only_headlines_make_the_verdict() -> None:
    good, bad = Estimate(7.0, 6.0, 8.0), Estimate(0.5, 0.4, 0.6)
    found = [
        Found(conditions="a", estimate=good, n=9, role=HEADLINE),
        Found(conditions="b", estimate=bad, n=9, role=BESIDE),
    ]
    claim = judged("x", "y", source="z", quantity="q", rule=_rules.at_least(6.0, 1.0), found=found)
    assert claim.verdict == "reproduced"
    assert [finding.verdict for finding in claim.findings] == ["reproduced", "not"]


def test_equivalence_is_the_larger_of_two_one_sided_welch_tests() -> None:
    """By the textbook formula: t of the difference less the margin on either side, Satterthwaite's df."""
    one, other, margin = np.array([1.0, 2.0, 3.0, 2.0]), np.array([2.0, 3.0, 1.0, 4.0, 2.0]), 1.5
    va, vb = one.var(ddof=1) / 4, other.var(ddof=1) / 5
    df = (va + vb) ** 2 / (va**2 / 3 + vb**2 / 4)
    difference, spread = one.mean() - other.mean(), np.sqrt(va + vb)
    p = [stats.t.sf((difference + margin) / spread, df), stats.t.cdf((difference - margin) / spread, df)]
    assert _rules.equivalence_p(one, other, margin) == pytest.approx(max(p))
    assert np.isnan(_rules.equivalence_p(np.ones(3), np.ones(3), 0.5))


def test_equivalence_is_seldom_found_where_there_is_none() -> None:
    """Means that are a margin apart are called equal in about 5 % of samples."""
    rng = np.random.default_rng(0)
    samples = rng.normal([[0.0], [1.0]], 1.0, (600, 2, 30))
    share = np.mean([_rules.equivalence_p(one, other, 1.0) < _rules.ALPHA for one, other in samples])
    assert 0.02 < share < 0.085


@pytest.fixture(scope="module")
def episodes() -> list[Episode]:
    """Two short episodes."""
    scenario = scenario_named("paper-sim-2", n_steps=14)
    return [run_episode(scenario, "random", seed, trial=seed) for seed in (1, 2)]


def test_figures_of_known_episodes(episodes: list[Episode]) -> None:
    """Episodes whose errors are doubled by hand have twice the error and half the reduction to go."""
    double = [replace(e, figures={name: 2.0 * v for name, v in e.figures.items()}) for e in episodes]
    assert _measures.err_ratio(double, episodes).value == pytest.approx(2.0)
    assert _measures.truth_reduction(episodes, double).value == pytest.approx(50.0)
    sums = [e.figures["ate_trans"] + e.figures["ate_rot"] for e in episodes]
    np.testing.assert_allclose(_measures.truth_error(episodes), sums)


def test_highest_point_of_the_mean_curve_after_the_first_ten(episodes: list[Episode]) -> None:
    curve = np.mean([e.steps["err"].mean(axis=1) for e in episodes], axis=0)
    found = _measures.highest_mean(episodes, 10.0)
    assert found.value == pytest.approx(curve[10:].max() / 10.0)


def test_difference_of_unpaired_means() -> None:
    one, other = np.arange(40.0), np.arange(40.0) - 3.0
    found = _measures.difference_of_means(one, other)
    half = 1.96 * np.sqrt(2.0 * one.var() / 40.0)
    assert found.value == pytest.approx(3.0)
    assert (found.low, found.high) == pytest.approx((3.0 - half, 3.0 + half), abs=0.5)
    assert _measures.difference_of_means(one[:1], other[:1]).low is None
