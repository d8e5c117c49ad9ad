"""Findings as tables in Markdown."""

from collections.abc import Sequence

from baselines.conduct.failures import World, furthest_below, shortfalls
from baselines.conduct.findings import Findings, decided
from baselines.conduct.measures import MEASURES
from baselines.evaluation.intervals import Estimate, mean_of
from baselines.evaluation.paper_tables import markdown_text, pipe_table


def conduct_table(findings: Findings) -> str:
    """A measure a row: mean of the rule, and what the policy has more, by scenario."""
    rows = [
        [measure.label, *(_beside_rule(findings, name, key) for name in findings.scenarios)]
        for key, measure in MEASURES.items()
    ]
    return pipe_table(["", *findings.scenarios], rows)


def score_table(findings: Findings) -> str:
    """A policy a row: its score, and what it has more than the policy that is looked at."""
    rows = [
        [markdown_text(label), *(_score(findings, name, label) for name in findings.scenarios)]
        for label in findings.labels
    ]
    return pipe_table(["mapped, %", *findings.scenarios], rows)


def shortfall_table(findings: Findings) -> str:
    """A scenario a row: how often the policy is below the rule, by how much, and why."""
    head = ["", "worlds below", "by, mean (% of the floor)", "lost", "saw less", "of these never met"]
    return pipe_table(head, [_shortfall(findings, name) for name in findings.scenarios])


def world_table(worlds: Sequence[World]) -> str:
    """A world a row."""
    rows = [
        [one.scenario, str(one.trial), str(one.seed), f"{one.rule:.0f}", f"{one.policy:.0f}", one.told]
        for one in worlds
    ]
    head = ["scenario", "world", "seed", "rule, %", "policy, %", "what happened (the rule in brackets)"]
    return pipe_table(head, rows, n_words=len(head))


def worst_worlds(findings: Findings, n: int) -> list[World]:
    """Worlds of every scenario in which the policy is furthest below the rule."""
    return [world for name in findings.scenarios for world in furthest_below(findings, name, n)]


def _beside_rule(findings: Findings, scenario: str, measure: str) -> str:
    rule = mean_of(findings.figures(scenario, findings.rule, measure))
    more = findings.difference(scenario, measure, findings.policy, findings.rule)
    return f"{_mean(rule, measure)}; {_difference(more, measure)}"


def _score(findings: Findings, scenario: str, label: str) -> str:
    mean = _mean(mean_of(findings.figures(scenario, label, "score")), "score")
    if label == findings.policy:
        return mean
    return f"{mean}; {_difference(findings.difference(scenario, 'score', label, findings.policy), 'score')}"


def _mean(found: Estimate, measure: str) -> str:
    return f"{found.value:.{MEASURES[measure].decimals}f}"


def _difference(found: Estimate, measure: str) -> str:
    """A difference and its interval; bold where that holds no zero."""
    decimals = MEASURES[measure].decimals
    ends = (0.0 if x is None else round(x, decimals) for x in (found.value, found.low, found.high))
    value, low, high = (f"{x + 0.0:+.{decimals}f}" for x in ends)
    return f"**{value}** [{low}, {high}]" if decided(found) else f"{value} [{low}, {high}]"


def _shortfall(findings: Findings, scenario: str) -> list[str]:
    found = shortfalls(findings, scenario)
    n, lost = int(found.below.sum()), int(found.lost.sum())
    by = f"{found.points[found.below].mean():.1f}" if n else "-"
    counts = (lost, n - lost, int(found.never_met.sum()))
    return [scenario, f"{n} of {len(found.below)}", by, *map(str, counts)]
