"""A suite's standings as a table, on the terminal and in Markdown."""

from collections.abc import Callable, Sequence

from rich.box import SIMPLE
from rich.console import Group
from rich.table import Table
from rich.text import Text

from baselines.evaluation.intervals import Estimate
from baselines.evaluation.paper_tables import markdown_text, pipe_table
from baselines.suite.standings import Standing

HEADS = ("policy", "IQM", "P(better)", "above, below")


def terminal_tables(standings: Sequence[Standing], title: str) -> Group:
    """A row a policy: aggregates, and below them the mapped share in each scenario, per cent.

    Each of the two fits into 80 columns, where one table of both would lose its cells.
    """
    whole, each = _table(title, HEADS), _table("", ("policy", *standings[0].scores))
    for one in standings:
        whole.add_row(Text(one.label), *_aggregates(one))
        each.add_row(Text(one.label), *(_two_lines(score) for score in one.scores.values()))
    return Group(whole, "", each, "")


def _table(title: str, heads: Sequence[str]) -> Table:
    table = Table(title=title or None, title_justify="left", box=SIMPLE, padding=0, show_edge=False)
    table.add_column(heads[0])
    for head in heads[1:]:
        table.add_column(head, justify="right", no_wrap=True)
    return table


def markdown_table(standings: Sequence[Standing]) -> str:
    """The same as a pipe table; the highest mean of a column is bold."""
    names = list(standings[0].scores)
    rows = []
    best = {name: max(_per_cent(one.scores[name]) for one in standings) for name in names}
    for one in standings:
        cells = [_cell(one.scores[name], best[name]) for name in names]
        rows.append([markdown_text(one.label), *_aggregates(one), *cells])
    return pipe_table([*HEADS, *names], rows)


def pairs_table(labels: Sequence[str], decided: Callable[[str, str], tuple[int, int]]) -> str:
    """Every policy against every other: in how many scenarios that of the row is above, and below."""
    rows = []
    for label in labels:
        counts = ["" if label == other else "{}, {}".format(*decided(label, other)) for other in labels]
        rows.append([markdown_text(label), *counts])
    head = ["", *map(markdown_text, labels)]
    return pipe_table(head, rows, n_words=len(head))


def _aggregates(one: Standing) -> tuple[str, str, str]:
    """What stands under `HEADS` behind the name; of the reference its mean alone."""
    if one.improvement is None:
        return _interval(one.iqm), "", ""
    return _interval(one.iqm), _interval(one.improvement), f"{one.above}, {one.below}"


def _cell(score: Estimate, best: float) -> str:
    mean = _per_cent(score)
    return f"**{mean:.1f}** ±{_half(score):.1f}" if mean == best else f"{mean:.1f} ±{_half(score):.1f}"


def _two_lines(score: Estimate) -> str:
    return f"{_per_cent(score):.1f}\n±{_half(score):.1f}"


def _per_cent(score: Estimate) -> float:
    return round(100.0 * (score.value or 0.0), 1)


def _half(score: Estimate) -> float:
    """Half the width of the interval, per cent."""
    return 50.0 * ((score.high or 0.0) - (score.low or 0.0))


def _interval(found: Estimate) -> str:
    return f"{found.value:.3f} [{found.low:.3f}, {found.high:.3f}]"
