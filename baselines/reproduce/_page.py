"""Claims as a page to read: ``claims.md`` from ``claims.json``."""

from collections.abc import Callable, Mapping
from typing import Any

from baselines.evaluation.marked_pages import filled
from baselines.reproduce._claim_sections import VERDICTS, claim_section, headlines, summary
from baselines.reproduce._figures import NOT_REDONE
from baselines.reproduce._tables import about, table

_INTRODUCTION = """\
Each claim has one figure of ours, its 95 % interval over worlds that all that is compared meets, and a
verdict by a rule that is fixed in the code (`baselines/reproduce/_rules.py`) before anything is run.
**Headline** rows make the verdict. *Beside* them stand rows that do not: other methods, and the strong walker
that optimises at every step. *Sensitivity* rows change one number that is ours and not the paper's, or
one reading of its text, all else as it was.

- **Pool.** Worlds of all roots of seeds are one pool; each figure says how many. A verdict needs ten.
- **Intervals** are t intervals over worlds; of a ratio of means, of its logarithm, because a bootstrap of it
  (BCa) covers too little with few worlds. How often each holds the truth: `wifipgo bench coverage`.
- **Held at the threshold** is judged by the mean of Err after iteration 10, and by the share of robots and
  iterations at or below it. On average neither changes with the number of worlds, as the highest point of a
  mean curve does. Beside them stands what is *read once a pass of Algorithm 2*: only where no call of the
  robot's is up, since Algorithm 1 runs to its end within a pass.
- **Verdicts**: *reproduced*, *partly*, *not*; *undecided* where the interval holds both answers;
  *by construction* where the simulation cannot answer otherwise, which is no evidence; *too few trials*;
  *not run*."""
BEGIN, END = "<!-- claims: written by baselines.reproduce -->", "<!-- end of claims -->"
# Claims that the README shows: the paper's main ones, whatever came of them.
MAIN = ("fig5.held", "fig7.ratio", "fig8.held", "fig8.truth", "fig10.reduction")


def page(record: Mapping[str, Any], picture: Callable[[str], str]) -> str:
    """The whole page.

    Args:
        record: Content of ``claims.json``.
        picture: Takes a figure's name and says where its picture is.
    """
    figures: Mapping[str, Any] = record["figures"]
    parts = [f"# The paper's claims, judged\n\n{_INTRODUCTION}", summary(figures)]
    parts += [NOT_REDONE, *(_figure(name, of, picture(name)) for name, of in figures.items())]
    return "\n\n".join(parts) + "\n"


def with_summary(text: str, figures: Mapping[str, Any]) -> str:
    """A text with the main claims between its marks; as it was if it has none."""
    marked = END in text.partition(BEGIN)[2]
    return filled(text, BEGIN, END, brief(figures), where="README.md") if marked else text


def brief(figures: Mapping[str, Any]) -> str:
    """One short line for each of the main claims."""
    claims = [claim for of in figures.values() for claim in of["claims"] if claim["name"] in MAIN]
    rows = [
        [claim["claim"], headlines(claim), VERDICTS.get(claim["verdict"], claim["verdict"])]
        for claim in claims
    ]
    return table(["claim", "ours, with 95 % interval", "verdict"], rows)


def _figure(name: str, of: Mapping[str, Any], picture: str) -> str:
    parts = [f"## {name}: {of['title']}"]
    parts += [f"![{of['title']}]({picture})", about(of["run"])] if of["run"] else []
    return "\n\n".join([*parts, *map(claim_section, of["claims"])])
