"""A claim of the paper, and what was found for it under which conditions."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from baselines.evaluation.statistics import Estimate
from baselines.reproduce._rules import Rule, combined

HEADLINE, BESIDE, SENSITIVITY = "headline", "beside", "sensitivity"


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
    name: str,
    claim: str,
    *,
    source: str,
    quantity: str,
    rule: Rule,
    found: Sequence[Found],
    unit: str = "",
    goal: str = "",
) -> Claim:
    """Judge every figure by the rule, and the claim by its headlines.

    Args:
        name: Key.
        claim: What the paper says.
        source: Where it says so.
        quantity: What the figure is.
        rule: Fixed beforehand.
        found: Figures.
        unit: Of the figure.
        goal: What this project set out to reach.
    """
    findings = [
        Finding(
            conditions=figure.conditions,
            role=figure.role,
            value=figure.estimate.value,
            low=figure.estimate.low,
            high=figure.estimate.high,
            n=figure.n,
            verdict=figure.verdict or rule.judge(figure.estimate),
            note=figure.note,
        )
        for figure in found
    ]
    verdict = combined([finding.verdict for finding in findings if finding.role == HEADLINE])
    return Claim(
        name=name,
        claim=claim,
        source=source,
        quantity=quantity,
        unit=unit,
        rule=rule.text,
        verdict=verdict,
        goal=goal,
        findings=findings,
    )
