"""Rules of verdicts, the equivalence test, figures of paired episodes: against answers known otherwise."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from baselines.evaluation.episodes import Episode, run_episode
from baselines.evaluation.intervals import Estimate, mean_of
from baselines.reproduce import _measures, _rules
from baselines.reproduce._claims import BESIDE, HEADLINE, Found, Sentence, judged, not_run, row
from wifipgo.scenarios import scenario_named

SAID = Sentence("x", "y", "z")


@pytest.mark.parametrize(
    ("rule", "value", "low", "high", "verdict"),
    [
        (_rules.at_least(6.0, 1.0), 7.0, 2.0, 9.0, "reproduced"),
        (_rules.at_least(6.0, 1.0), 5.9, 2.0, 9.0, "partly"),
        (_rules.at_least(6.0, 1.0), 7.0, 0.9, 20.0, "undecided"),
        (_rules.at_least(6.0, 1.0), 2.0, 0.9, 5.0, "not"),
        (_rules.at_most(1.2), 1.0, 0.9, 1.2, "reproduced"),
        (_rules.at_most(1.2), 1.1, 0.9, 1.3, "undecided"),
        (_rules.at_most(1.2), 1.3, 1.21, 1.5, "not"),
        (_rules.no_less(0.9), 0.95, 0.9, 1.0, "reproduced"),
        (_rules.no_less(0.9), 0.95, 0.85, 1.0, "undecided"),
        (_rules.no_less(0.9), 0.8, 0.7, 0.89, "not"),
        (_rules.above(1.2), 2.0, 1.3, 3.0, "reproduced"),
        (_rules.above(1.2), 2.0, 1.1, 3.0, "undecided"),
        (_rules.above(1.0), 1.0, 1.0, 1.0, "not"),
        (_rules.by_construction(0.0, "why"), 0.0, 0.0, 0.0, "by construction"),
        (_rules.by_construction(0.0, "why"), 0.01, 0.0, 0.1, "not"),
    ],
)
def test_verdicts(rule: _rules.Rule, value: float, low: float, high: float, verdict: str) -> None:
    assert rule.judge(Estimate(value, low, high)) == verdict


@pytest.mark.parametrize(
    ("low", "high", "p", "equal", "affected"),
    [
        (-0.1, 0.1, 0.01, "reproduced", "not"),
        (-0.5, 0.5, 0.60, "undecided", "undecided"),
        (0.1, 0.5, 0.60, "not", "reproduced"),
        (0.01, 0.05, 0.01, "reproduced", "reproduced"),  # a difference, and a small one
    ],
)
def test_verdicts_of_counts(low: float, high: float, p: float, equal: str, affected: str) -> None:
    found = Estimate(0.5 * (low + high), low, high)
    assert _rules.judged_counts(found, p, affected=False) == equal
    assert _rules.judged_counts(found, p, affected=True) == affected


def test_what_is_not_significant_is_never_partly() -> None:
    """Whatever the figure: an interval that holds no effect at all is not or undecided."""
    rules = [_rules.at_least(6.0, 1.0), _rules.above(1.0)]
    found = [Estimate(value, 1.0 - below, value + 1.0) for value in (1.1, 5.0, 9.0) for below in (0.0, 0.5)]
    assert {rule.judge(one) for rule in rules for one in found} <= {"not", "undecided"}


@pytest.mark.parametrize(
    ("n", "verdict"), [(0, "not run"), (1, "too few trials"), (9, "too few trials"), (10, "reproduced")]
)
def test_a_verdict_needs_ten_trials(n: int, verdict: str) -> None:
    for own in ("", "reproduced"):
        found = [Found(conditions="a", estimate=Estimate(7.0, 6.0, 8.0), n=n, verdict=own)]
        assert judged(SAID, quantity="q", rule=_rules.at_least(6.0, 1.0), found=found).verdict == verdict


@pytest.mark.parametrize(
    ("verdicts", "whole"),
    [
        (["reproduced", "reproduced"], "reproduced"),
        (["reproduced", "not"], "partly"),
        (["partly"], "partly"),
        (["not", "not"], "not"),
        (["no power", "no power"], "no power"),
        (["no power", "reproduced"], "partly"),
        (["no power", "not"], "not"),
        (["no power", "undecided", "reproduced"], "undecided"),
        (["by construction", "by construction"], "by construction"),
        (["reproduced", "undecided"], "undecided"),
        (["reproduced", "undecided", "too few trials"], "too few trials"),
        (["reproduced", "not run", "too few trials"], "not run"),
        ([], "not run"),
    ],
)
def test_verdict_of_several_conditions(verdicts: list[str], whole: str) -> None:
    assert _rules.combined(verdicts) == whole


def test_only_headlines_make_the_verdict() -> None:
    good, bad = Estimate(7.0, 6.0, 8.0), Estimate(0.5, 0.4, 0.6)
    found = [
        Found(conditions="a", estimate=good, n=10, role=HEADLINE),
        Found(conditions="b", estimate=bad, n=10, role=BESIDE),
    ]
    claim = judged(SAID, quantity="q", rule=_rules.at_least(6.0, 1.0), found=found)
    assert claim.verdict == "reproduced"
    assert [finding.verdict for finding in claim.findings] == ["reproduced", "not"]


def test_a_sample_that_is_not_there_is_a_row_that_says_so() -> None:
    found = row("a", lambda one, other: mean_of(one - other), np.zeros(0), np.ones(12))
    claim = judged(SAID, quantity="q", rule=_rules.above(0.0), found=[found])
    assert [(finding.verdict, finding.value) for finding in claim.findings] == [("not run", None)]
    assert not_run(SAID).verdict == claim.verdict == "not run"


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


def test_level_and_share_of_a_known_episode(episodes: list[Episode]) -> None:
    """Four late iterations by hand; with a call up, a robot's error is not read."""
    err = np.full((14, 2), 1e9)
    err[10:] = [[5.0, 5.0], [5.0, 15.0], [5.0, 35.0], [5.0, 5.0]]
    calling = np.zeros((14, 2), dtype=bool)
    calling[12, 1] = True
    one = replace(episodes[0], steps={**episodes[0].steps, "err": err, "calling": calling})
    two = [one, one]
    assert _measures.level(two, 10.0).value == pytest.approx(80.0 / 80.0)
    assert _measures.level(two, 10.0, at_passes=True).value == pytest.approx(45.0 / 70.0)
    assert _measures.share_within(two, 10.0).value == pytest.approx(6 / 8)
    assert _measures.share_within(two, 10.0, at_passes=True).value == pytest.approx(6 / 7)
