"""A suite's standings as a table, on the terminal and in Markdown."""

from collections.abc import Callable, Sequence

from rich.box import SIMPLE
from rich.table import Table
from rich.text import Text

from baselines.evaluation.intervals import Estimate
from baselines.evaluation.paper_tables import markdown_text, pipe_table
from baselines.suite.standings import Standing

HEADS = ("policy", "IQM", "P(better)", "above, below")


def terminal_table(standings: Sequence[Standing], title: str) -> Table:
    """A row a policy: aggregates, then the mapped share in each scenario, per cent."""
    table = Table(title=title, title_justify="left", box=SIMPLE, padding=(0, 1, 0, 0))
    for head in HEADS:
        table.add_column(head, no_wrap=True)
    for name in standings[0].scores:
        table.add_column(name, justify="right", no_wrap=True)
    for one in standings:
        cells = [_two_lines(each) for each in one.scores.values()]
        improvement = "" if one.improvement is None else _interval(one.improvement, "\n")
        counts = "" if one.improvement is None else f"{one.above}, {one.below}"
        table.add_row(Text(one.label), _interval(one.iqm, "\n"), improvement, counts, *cells)
    return table


def markdown_table(standings: Sequence[Standing]) -> str:
    """The same as a pipe table; the highest mean of a column is bold."""
    names = list(standings[0].scores)
    rows = []
    best = {name: max(_per_cent(one.scores[name]) for one in standings) for name in names}
    for one in standings:
        improvement = "" if one.improvement is None else _interval(one.improvement, " ")
        counts = "" if one.improvement is None else f"{one.above}, {one.below}"
        cells = [_cell(one.scores[name], best[name]) for name in names]
        rows.append([markdown_text(one.label), _interval(one.iqm, " "), improvement, counts, *cells])
    return pipe_table([*HEADS, *names], rows)


def pairs_table(labels: Sequence[str], decided: Callable[[str, str], tuple[int, int]]) -> str:
    """Every policy against every other: in how many scenarios that of the row is above, and below."""
    rows = []
    for label in labels:
        counts = ["" if label == other else "{}, {}".format(*decided(label, other)) for other in labels]
        rows.append([markdown_text(label), *counts])
    head = ["", *map(markdown_text, labels)]
    return pipe_table(head, rows, n_words=len(head))


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


def _interval(found: Estimate, between: str) -> str:
    return f"{found.value:.3f}{between}[{found.low:.3f}, {found.high:.3f}]"
