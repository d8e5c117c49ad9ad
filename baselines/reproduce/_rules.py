"""When a claim counts as reproduced: rules that were fixed before anything was run.

A verdict needs ten trials. What an interval leaves open is undecided, whichever side its middle is on.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy import stats

from baselines.evaluation.intervals import Estimate

REPRODUCED, PARTLY, NOT, UNDECIDED = "reproduced", "partly", "not", "undecided"
BY_CONSTRUCTION, FEW, NOT_RUN, UNJUDGED = "by construction", "too few trials", "not run", "-"
NO_POWER = "no power"  # not even who knows the answer would reach what is claimed
FEWEST = 10  # trials of a verdict
ALPHA = 0.05  # of the equivalence test
SAME_COUNT = 0.25  # counts within a quarter of each other are called equal
HELD = 1.0  # mean Err in thresholds, and
WITHIN = 0.9  # share of robots and iterations at or below it, up to and from which the threshold is held


class Rule(NamedTuple):
    """How a figure and its interval become a verdict."""

    text: str
    judge: Callable[[Estimate], str]


def at_least(claimed: float, nothing: float, unit: str = "") -> Rule:
    """The paper's figure or more; ``nothing`` is the figure of no effect at all."""

    def judge(value: float, low: float, high: float) -> str:
        if low > nothing:
            return REPRODUCED if value >= claimed else PARTLY
        return NOT if high < claimed else UNDECIDED

    return Rule(
        f"reproduced: at least {claimed:g}{unit} and the whole interval above {nothing:g}{unit} (no effect); "
        f"partly: the whole interval above {nothing:g}{unit}; not: it reaches {nothing:g}{unit} and stays "
        f"below {claimed:g}{unit}; undecided: it reaches both",
        _of_interval(judge),
    )


def above(bound: float, unit: str = "") -> Rule:
    """Beyond a bound."""

    def judge(value: float, low: float, high: float) -> str:
        return REPRODUCED if low > bound else NOT if high <= bound else UNDECIDED

    return Rule(f"reproduced: the whole interval above {bound:g}{unit}; {_ELSE}", _of_interval(judge))


def at_most(bound: float, unit: str = "") -> Rule:
    """Within a bound."""

    def judge(value: float, low: float, high: float) -> str:
        return REPRODUCED if high <= bound else NOT if low > bound else UNDECIDED

    return Rule(f"reproduced: the whole interval at most {bound:g}{unit}; {_ELSE}", _of_interval(judge))


def no_less(bound: float, unit: str = "") -> Rule:
    """A bound or more."""

    def judge(value: float, low: float, high: float) -> str:
        return REPRODUCED if low >= bound else NOT if high < bound else UNDECIDED

    return Rule(f"reproduced: the whole interval at least {bound:g}{unit}; {_ELSE}", _of_interval(judge))


def by_construction(value: float, why: str) -> Rule:
    """What cannot come out otherwise in a simulation: not evidence, but it has to be so."""

    def judge(found: float, low: float, high: float) -> str:
        return BY_CONSTRUCTION if found == value else NOT

    return Rule(f"by construction: {why}; not: the figure is not {value:g}", _of_interval(judge))


_ELSE = "not: the whole interval on the other side; undecided: the interval holds both"


def _of_interval(judge: Callable[[float, float, float], str]) -> Callable[[Estimate], str]:
    """A verdict where there is an interval."""

    def of_estimate(found: Estimate) -> str:
        if found.value is None or found.low is None or found.high is None:
            return UNDECIDED
        return judge(found.value, found.low, found.high)

    return of_estimate


INDEPENDENT = (
    f"reproduced: two one-sided Welch tests at {ALPHA:g} find the counts within {100 * SAME_COUNT:.0f} % of "
    "that without obstacles; not: they do not, and the interval excludes 0; undecided: neither"
)
AFFECTED = (
    "reproduced: the interval excludes 0; not: it does not, and two one-sided Welch tests at "
    f"{ALPHA:g} find the counts within {100 * SAME_COUNT:.0f} % of that without obstacles; undecided: neither"
)


def judged_counts(found: Estimate, p: float, *, affected: bool) -> str:
    """Whether a count is the same in two places.

    Args:
        found: Difference of the means.
        p: Of equivalence.
        affected: Whether the claim is that they differ.
    """
    if found.low is None or found.high is None:
        return UNDECIDED
    differ, same = found.low > 0.0 or found.high < 0.0, bool(p < ALPHA)
    if affected:
        return REPRODUCED if differ else NOT if same else UNDECIDED
    return REPRODUCED if same else NOT if differ else UNDECIDED


def equivalence_p(
    one: Float[np.ndarray, " ones"], other: Float[np.ndarray, " others"], margin: float
) -> float:
    """P of two one-sided Welch tests: small if the means differ by less than the margin (Schuirmann 1987).

    Args:
        one: A sample.
        other: An independent one.
        margin: Largest difference of the means that counts as none.

    Returns:
        The larger of the two p; nan where nothing varies or a sample has fewer than two values.
    """
    if min(len(one), len(other)) < 2 or one.std() + other.std() == 0.0:
        return float("nan")
    below = stats.ttest_ind(one, other - margin, equal_var=False, alternative="greater").pvalue
    beyond = stats.ttest_ind(one, other + margin, equal_var=False, alternative="less").pvalue
    return float(max(below, beyond))


def combined(verdicts: Sequence[str]) -> str:
    """One verdict of several conditions: partly where they are not all the same, none where one has none.

    Conditions in which nothing could show what is claimed neither confirm nor refute it: beside others that
    do not show it they do not count, beside those that do, the claim holds in a part of what it is about.
    """
    found = set(verdicts) or {NOT_RUN}
    if len(found) > 1 and found != {NO_POWER, REPRODUCED}:
        found -= {NO_POWER}
    if len(found) == 1:
        return found.pop()
    return next((none for none in (NOT_RUN, FEW, UNDECIDED) if none in found), PARTLY)
