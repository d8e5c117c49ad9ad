"""Names in lines that fit, wherever they are drawn."""

import re
from collections.abc import Sequence

LABEL_WIDTH = 30  # letters of a policy's name in a line


def names_of(policies: Sequence[str], width: int = LABEL_WIDTH) -> list[str]:
    """Policies in lines that fit, as few as tell them apart: what differs may be in the middle of a path."""
    few = 2
    while len({wrapped(policy, width, most_lines=few) for policy in policies}) < len(set(policies)):
        few += 1
    return [wrapped(policy, width, most_lines=few) for policy in policies]


def wrapped(text: str, width: int, *, most_lines: int = 3) -> str:
    """A text in lines of some letters, broken after a sign if there is one; a long one loses its middle."""
    kept = min(len(text), width * most_lines)
    while len(lines := _lines(_without_middle(text, kept), width)) > most_lines:
        kept -= 1
    return "\n".join(lines)


def _without_middle(text: str, kept: int) -> str:
    """A text of which so many letters stay, more of its end than of its beginning."""
    return text if kept >= len(text) else f"{text[: kept // 3]}…{text[len(text) - (kept - kept // 3) :]}"


def _lines(text: str, width: int) -> list[str]:
    lines = [""]
    for piece in re.findall(rf"[^\s:,/\\=_-]{{1,{width - 1}}}[\s:,/\\=_-]?|[\s:,/\\=_-]", text):
        if len(lines[-1]) + len(piece.rstrip()) > width:
            lines.append("")
        lines[-1] += piece
    return [line.strip() for line in lines if line.strip()]


def whole(value: float) -> str:
    """A number without decimals, and without a sign where it is zero."""
    return f"{round(value) + 0:d}"
