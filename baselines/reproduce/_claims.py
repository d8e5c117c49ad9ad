"""A claim of the paper, and what was found for it under which conditions."""

from collections.abc import Callable, Sequence, Sized
from dataclasses import dataclass, field
from typing import NamedTuple

from baselines.evaluation.intervals import Estimate
from baselines.reproduce._rules import FEW, FEWEST, NOT_RUN, Rule, combined

HEADLINE, BESIDE, SENSITIVITY = "headline", "beside", "sensitivity"
NO_EPISODES = "the scenario refuses this change"


class Sentence(NamedTuple):
    """What the paper says.

    Attributes:
        name: Key, ``fig7.ratio``.
        claim: In words.
        source: Where.
    """

    name: str
    claim: str
    source: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """A figure under one set of conditions.

    Attributes:
        conditions: What was run.
        role: ``headline`` makes the verdict; ``beside`` stands beside it; ``sensitivity`` changes a number
            that is ours and not the paper's.
        value: The figure; None where it does not exist.
        low: Lower end of its 95 % interval.
        high: Upper end.
        n: Seeds, each met by all that is compared.
        verdict: By the claim's rule.
        note: What else to know.
    """

    conditions: str
    role: str
    value: float | None
    low: float | None
    high: float | None
    n: int
    verdict: str
    note: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Claim:
    """A claim and its findings.

    Attributes:
        name: Key, ``fig7.ratio``.
        claim: What the paper says.
        source: Where.
        quantity: What the figure is, with its unit.
        unit: Unit to print after a number.
        rule: When it counts as reproduced, in words.
        verdict: Of all headline findings together.
        goal: What this project set out to reach.
        findings: Under which conditions what was found.
    """

    name: str
    claim: str
    source: str
    quantity: str
    unit: str
    rule: str
    verdict: str
    goal: str = ""
    findings: list[Finding] = field(default_factory=list)


@dataclass(frozen=True, slots=True, kw_only=True)
class Found:
    """A figure before it is judged."""

    conditions: str
    estimate: Estimate
    n: int
    role: str = HEADLINE
    note: str = ""
    verdict: str = ""  # where a test of its own has judged it; else the rule does


def judged(
    sentence: Sentence,
    *,
    quantity: str,
    rule: Rule,
    found: Sequence[Found],
    unit: str = "",
    goal: str = "",
) -> Claim:
    """Judge every figure by the rule, and the claim by its headlines.

    Args:
        sentence: What the paper says.
        quantity: What the figure is.
        rule: Fixed beforehand.
        found: Figures.
        unit: Of the figure.
        goal: What this project set out to reach.
    """
    findings = [_finding(figure, rule) for figure in found]
    verdict = combined([finding.verdict for finding in findings if finding.role == HEADLINE])
    return Claim(
        **sentence._asdict(),
        quantity=quantity,
        unit=unit,
        rule=rule.text,
        verdict=verdict,
        goal=goal,
        findings=findings,
    )


def _finding(figure: Found, rule: Rule) -> Finding:
    """A figure and its verdict: none where nothing was run, or too little."""
    value, low, high = (getattr(figure.estimate, end) for end in ("value", "low", "high"))
    verdict = NOT_RUN if figure.n == 0 else FEW if figure.n < FEWEST else figure.verdict
    return Finding(
        conditions=figure.conditions,
        role=figure.role,
        value=value,
        low=low,
        high=high,
        n=figure.n,
        verdict=verdict or rule.judge(figure.estimate),
        note=figure.note,
    )


def row(
    conditions: str,
    measure: Callable[..., Estimate],
    *samples: Sized,
    role: str = HEADLINE,
    note: str = "",
) -> Found:
    """A figure of some samples, each a row a trial; one that is empty was not run."""
    if not all(map(len, samples)):
        return missing(conditions, NO_EPISODES, role)
    return Found(conditions=conditions, estimate=measure(*samples), n=len(samples[0]), role=role, note=note)


def missing(conditions: str, why: str, role: str = HEADLINE) -> Found:
    """A row for what was not run."""
    return Found(conditions=conditions, estimate=Estimate(None, None, None), n=0, role=role, note=why)


def not_run(sentence: Sentence) -> Claim:
    """A claim for which nothing was run."""
    return Claim(**sentence._asdict(), quantity="", unit="", rule="", verdict=NOT_RUN)
