"""Findings as a page, and as a section of the documentation."""

from collections.abc import Sequence
from hashlib import sha256

from baselines.conduct import tables
from baselines.conduct.failures import World, usual_world
from baselines.conduct.findings import Findings
from baselines.evaluation.marked_pages import filled
from baselines.evaluation.paper_tables import markdown_text
from wifipgo.command.checkout import recorded

PAGE = "training.md"  # of the documentation, which has the marks
BEGIN, END = "<!-- made by wifipgo bench why -->", "<!-- end of what it made -->"
_INTERVALS = """\
Means over worlds; differences are taken world by world, with 95 % t intervals, and are bold where the
interval holds no zero."""
_CAUSES = """\
*Lost*: at least half of what is missing was seen, but is not where it is thought to be. *Saw less*: the
others."""
_DIGEST = "<!-- its digest: {} -->"


def section(findings: Findings, *, command: str, picture: str, worst: int) -> str:
    """All tables and the picture.

    Args:
        findings: What was found.
        command: What made it.
        picture: Where the picture is, from the page.
        worst: Worlds of each scenario that are listed.
    """
    policy, rule = _names(findings)
    parts = [
        f"`{command}`",
        f"{markdown_text(title(findings))}. {_INTERVALS}",
        f"![When robots meet, how far they go, where errors grow]({picture})",
        f"**What it does otherwise**: mean of {rule}; what {policy} has more or less.",
        tables.conduct_table(findings),
        f"**What it uses**: the score of each policy; what it has more or less than {policy}.",
        tables.score_table(findings),
        *_failures(findings, tables.worst_worlds(findings, worst)),
    ]
    return "\n\n".join(parts)


def _names(findings: Findings) -> tuple[str, str]:
    """Policy and rule, as the page has them."""
    return markdown_text(findings.policy), markdown_text(findings.rule)


def _failures(findings: Findings, worlds: Sequence[World]) -> list[str]:
    """Where the policy is below the rule, and how to watch that."""
    policy, rule = _names(findings)
    parts = [
        f"**Where it fails**: worlds in which {policy} maps less than {rule}. {_CAUSES}",
        tables.shortfall_table(findings),
    ]
    if worlds:
        parts += ["The worlds in which it is furthest below:", tables.world_table(worlds)]
    films = [_film(findings, usual_world(findings, findings.scenarios[0]), "the median difference")]
    films += [_film(findings, world, "the greatest shortfall") for world in worlds[:1]]
    return [*parts, "Side by side in a film:", "\n".join(films)]


def title(findings: Findings) -> str:
    """What was played."""
    (root,) = {part.root for part in findings.suite.parts.values()}
    worlds = f"{findings.suite.worlds} worlds of each scenario from root {root}"
    return f"{findings.policy} beside {findings.rule}, {worlds}"


def _film(findings: Findings, world: World, what: str) -> str:
    """How to watch a world, a line of a list."""
    return f"- world {world.trial} of `{world.scenario}`, with {what}: `{film_command(findings, world)}`"


def film_command(findings: Findings, world: World) -> str:
    """Command line that films the policy beside the rule in one world."""
    words = findings.suite.parts[world.scenario].command
    scenario = words[: words.index("--seed")]
    played = ["--seed", str(world.seed), "--policies", ",".join(findings.texts)]
    return recorded("watch", *scenario, *played, "--out", "beside.gif")


def documented(page: str, text: str) -> str:
    """The page of the documentation with a section between its marks, sealed against editing by hand."""
    return filled(page, BEGIN, END, f"{text}\n\n{_DIGEST.format(_digest(text))}", where=PAGE)


def is_as_made(page: str) -> bool:
    """Whether what stands between the marks of a page is what a command wrote there."""
    text = page.partition(f"{BEGIN}\n\n")[2].partition(f"\n\n{END}")[0]
    body, _, _ = text.rpartition("\n\n")
    return bool(body) and text == f"{body}\n\n{_DIGEST.format(_digest(body))}"


def _digest(text: str) -> str:
    return sha256(text.encode()).hexdigest()[:16]
