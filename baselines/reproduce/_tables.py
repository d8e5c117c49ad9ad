"""What pages share: tables in Markdown, and where numbers come from."""

from collections.abc import Mapping, Sequence
from typing import Any


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
