"""When a claim counts as reproduced: rules that were fixed before anything was run."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy import stats

from baselines.evaluation.statistics import Estimate

REPRODUCED, PARTLY, NOT, OPEN = "reproduced", "partly", "not", "no interval"
ALPHA = 0.05  # of the equivalence test
SAME_COUNT = 0.25  # counts within a quarter of each other are called equal
HELD = 1.2  # an error up to this many thresholds is held at the threshold


class Rule(NamedTuple):
    """How a figure and its interval become a verdict."""

    text: str
    judge: Callable[[Estimate], str]


def at_least(claimed: float, nothing: float, unit: str = "") -> Rule:
    """The paper's figure or more; ``nothing`` is the figure of no effect at all."""

    def judge(found: Estimate) -> str:
        if found.value is None or found.low is None:
            return OPEN
        effect = found.low > nothing
        return REPRODUCED if effect and found.value >= claimed else PARTLY if effect else NOT

    return Rule(
        f"reproduced: at least {claimed:g}{unit} and the whole interval above {nothing:g}{unit} (no effect); "
        f"partly: the whole interval above {nothing:g}{unit}; not: otherwise",
        judge,
    )


def above(bound: float) -> Rule:
    """Beyond a bound."""

    def judge(found: Estimate) -> str:
        if found.value is None or found.low is None:
            return OPEN
        return REPRODUCED if found.low > bound else PARTLY if found.value > bound else NOT

    return Rule(
        f"reproduced: the whole interval above {bound:g}; partly: the figure above it; not: otherwise", judge
    )


def at_most(bound: float, unit: str = "") -> Rule:
    """Within a bound."""

    def judge(found: Estimate) -> str:
        if found.value is None or found.high is None:
            return OPEN
        return REPRODUCED if found.high <= bound else PARTLY if found.value <= bound else NOT

    return Rule(
        f"reproduced: the whole interval at most {bound:g}{unit}; partly: the figure at most that; "
        "not: otherwise",
        judge,
    )


def within(margin: float) -> Rule:
    """No further than a margin from none, on either side."""

    def judge(found: Estimate) -> str:
        if found.value is None or found.low is None or found.high is None:
            return OPEN
        inside = max(abs(found.low), abs(found.high)) <= margin
        return REPRODUCED if inside else PARTLY if abs(found.value) <= margin else NOT

    return Rule(
        f"reproduced: the whole interval within {margin:+g} and {-margin:+g}; partly: the figure within; "
        "not: otherwise",
        judge,
    )


def no_better() -> Rule:
    """Not below 1, the level of the other."""

    def judge(found: Estimate) -> str:
        if found.value is None or found.high is None:
            return OPEN
        return NOT if found.high < 1.0 else REPRODUCED if found.value >= 1.0 else PARTLY

    return Rule(
        "reproduced: the figure is at least 1; partly: below 1, but the interval reaches 1; "
        "not: the whole interval below 1",
        judge,
    )


def differs(margin: float) -> Rule:
    """A difference that is not chance."""

    def judge(found: Estimate) -> str:
        if found.value is None or found.low is None or found.high is None:
            return OPEN
        apart = found.low > 0.0 or found.high < 0.0
        return REPRODUCED if apart else PARTLY if abs(found.value) > margin else NOT

    return Rule(
        f"reproduced: the interval excludes 0; partly: it does not, but the figure is beyond {margin:g}; "
        "not: otherwise",
        judge,
    )


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


def combined(verdicts: list[str]) -> str:
    """One verdict of several conditions: reproduced where all are, not where none is, else partly."""
    found = set(verdicts)
    return found.pop() if len(found) == 1 else OPEN if OPEN in found else PARTLY
