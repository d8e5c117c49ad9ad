"""Claims as parts of a page: one line each, or a section with every figure."""

from collections import Counter
from collections.abc import Mapping
from typing import Any

from baselines.evaluation.intervals import Estimate
from baselines.evaluation.rows import shown
from baselines.reproduce._claims import BESIDE, HEADLINE, SENSITIVITY
from baselines.reproduce._tables import table

_ROLES = {HEADLINE: "**headline**", BESIDE: "beside", SENSITIVITY: "sensitivity"}
VERDICTS = {"reproduced": "**reproduced**", "partly": "partly", "not": "**not**"}


def summary(figures: Mapping[str, Any]) -> str:
    """One line for each claim."""
    rows = [
        [name, claim["claim"], headlines(claim), VERDICTS.get(claim["verdict"], claim["verdict"])]
        for name, claim in ((claim["name"], claim) for of in figures.values() for claim in of["claims"])
    ]
    return table(["", "claim", "ours, with 95 % interval", "verdict"], rows)


def headlines(claim: Mapping[str, Any]) -> str:
    """Every headline figure of a claim."""
    found = [finding for finding in claim["findings"] if finding["role"] == HEADLINE]
    if not found:
        return "-"
    if len(found) == 1:
        return shown_finding(found[0]) + claim["unit"]
    if len(found) > 4:
        return f"of {len(found)} conditions: " + ", ".join(
            f"{n} {verdict}" for verdict, n in Counter(finding["verdict"] for finding in found).most_common()
        )
    return "; ".join(f"{finding['conditions']} {shown_finding(finding)}{claim['unit']}" for finding in found)


def claim_section(claim: Mapping[str, Any]) -> str:
    """A claim: what it says, how it is judged, every figure."""
    goal = f" Goal of this project: {claim['goal']}." if claim["goal"] else ""
    title = f"### {claim['name']}: {claim['verdict']}\n\n> {claim['claim']} ({claim['source']})"
    if not claim["findings"]:
        return title
    text = f"{title}\n\nFigure: {claim['quantity']}. Rule: {claim['rule']}.{goal}"
    rows = [
        [
            _ROLES[finding["role"]],
            finding["conditions"],
            shown_finding(finding) + claim["unit"],
            str(finding["n"]),
            finding["verdict"],
            finding["note"],
        ]
        for finding in claim["findings"]
    ]
    return f"{text}\n\n" + table(["", "conditions", "ours", "worlds", "verdict", "note"], rows)


def shown_finding(finding: Mapping[str, Any]) -> str:
    """A figure with its interval."""
    return shown(Estimate(finding["value"], finding["low"], finding["high"]))
