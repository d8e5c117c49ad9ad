"""What pages share: tables in Markdown, and where numbers come from."""

from collections.abc import Mapping, Sequence
from math import isfinite
from typing import Any

from baselines.evaluation.intervals import Estimate

ENDS = ("", "_low", "_high")  # of the columns of an estimate


def columns(name: str, estimate: Estimate) -> dict[str, float | None]:
    """An estimate as columns of a table."""
    ends = (estimate.value, estimate.low, estimate.high)
    return {name + end: value for end, value in zip(ENDS, ends, strict=True)}


def estimate_in(row: Any, name: str) -> Estimate:
    """An estimate from the columns of a row; None where there was none."""
    ends = (float(getattr(row, name + end)) for end in ENDS)
    return Estimate(*(value if isfinite(value) else None for value in ends))


def about(run: Mapping[str, Any]) -> str:
    """Where a figure's numbers come from."""
    versions = ", ".join(f"{name} {version}" for name, version in run["versions"].items())
    pool = f"{_roots(run['roots'])}, {run['trials']} worlds each"
    return f"    {run['command']}\n\n{run['date']}; {pool}; {versions}."


def _roots(roots: Sequence[int]) -> str:
    return (
        f"{len(roots)} roots of seeds ({roots[0]} to {roots[-1]})" if len(roots) > 1 else f"root {roots[0]}"
    )


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table in Markdown."""
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines)
