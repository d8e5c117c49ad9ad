"""Results as tables for papers: CSV with every number, Markdown and LaTeX with the best in bold."""

import csv
import io
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType

from baselines.evaluation.plan import Plan
from baselines.evaluation.rows import (
    COMPARED,
    Row,
    by_score,
    compared_with,
    figure_rows,
    paired_rows,
)
from baselines.evaluation.statistics import Estimate, Summary
from wifipgo.errors import require
from wifipgo.files.atomic_files import write_text
from wifipgo.files.targets import check_target

_NOTHING = Estimate(None, None, None)
_CSV = ("policy", "figure", "unit", "trials", "mean", "low", "high")
_CSV_COMPARED = ("reference", "compared", "value", "value_low", "value_high")
_COLUMNS = 5  # more policies than this stand in rows
# Every sign that LaTeX reads as its own.
_TEX = {c: rf"\{c}" for c in "&%$#_{}"} | {"~": r"\textasciitilde{}", "^": r"\textasciicircum{}"}
_TEX |= {"\\": r"\textbackslash{}", "<": r"\textless{}", ">": r"\textgreater{}", "|": r"\textbar{}"}
_TEX |= {"²": "$^2$"}


def check_tables(paths: Sequence[Path], out: Path, *, overwrite: bool) -> None:
    """Refuse, before anything runs, a table that could not be written.

    Args:
        paths: Where tables go; one in the folder of the results appears with these.
        out: Folder of the results.
        overwrite: Whether tables that are there may be replaced.

    Raises:
        BadInputError: An unknown kind of file (the message lists those that exist), a file twice, a folder
            that does not exist, or a file that may not be replaced.
    """
    given = [str(path) for path in paths]
    require(len({path.resolve() for path in paths}) == len(paths), "table", "given once each", given)
    for path in paths:
        inside = path.resolve().parent == out.resolve()
        check_target("table", path, KINDS, overwrite=overwrite, folder_comes=inside)


def write_paper_tables(paths: Iterable[Path], summary: Summary, plan: Plan) -> None:
    """Write each by its suffix; it is there whole or not at all.

    Raises:
        OSError: A file that cannot be written.
    """
    for path in paths:
        write_text(path, KINDS[path.suffix.lower()](summary, plan))


def as_csv(summary: Summary, plan: Plan) -> str:
    """One row for each policy and figure, with every digit; what there is not is empty."""
    compared = {figure: (how, field) for field, figure, how, _ in COMPARED}
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow([*_CSV, *_CSV_COMPARED])
    for policy in plan.policies:
        for figure, estimate in summary.policies[policy].items():
            how, field = compared.get(figure, ("", ""))
            paired = summary.paired.get(policy)
            against = getattr(paired, field) if paired and field else _NOTHING
            compares = (summary.reference, how) if paired and field else ("", "")
            head = (policy, figure, summary.units[figure], summary.trials)
            table.writerow([*head, *_plain(estimate), *compares, *_plain(against)])
    return text.getvalue()


def as_markdown(summary: Summary, plan: Plan) -> str:
    """A pipe table, as GitHub and MkDocs show it."""
    head, rows = _grid(summary, plan, _markdown_cell, markdown_text)
    return "\n".join([pipe_table(head, rows), "", markdown_text(_caption(summary, plan)), ""])


def as_latex(summary: Summary, plan: Plan) -> str:
    r"""A ``tabular`` for the package booktabs."""
    head, rows = _grid(summary, plan, _latex_cell, latex_text)
    body = [rf"{' & '.join(row)} \\" for row in rows]
    return "\n".join(
        [
            r"% \usepackage{booktabs}",
            f"% {_caption(summary, plan)}",
            rf"\begin{{tabular}}{{l{'r' * (len(head) - 1)}}}",
            r"\toprule",
            rf"{' & '.join(head)} \\",
            r"\midrule",
            *body,
            r"\bottomrule",
            r"\end{tabular}",
            "",
        ]
    )


KINDS: Mapping[str, Callable[[Summary, Plan], str]] = MappingProxyType(
    {".csv": as_csv, ".md": as_markdown, ".tex": as_latex}
)


def _plain(estimate: Estimate) -> list[float | str]:
    return ["" if x is None else x for x in (estimate.value, estimate.low, estimate.high)]


def _caption(summary: Summary, plan: Plan) -> str:
    """What the numbers are, in a line."""
    what = f"{plan.title}, {plan.trials_in_words}, seed {plan.seed}: mean and 95 % interval"
    pairs = f"; differences and ratios are paired, {compared_with(summary)}" if summary.paired else ""
    warned = "".join(f"; {warning}" for warning in summary.warnings)
    return f"{what}; the best is bold{pairs}{warned}."


def _grid(
    summary: Summary,
    plan: Plan,
    cell: Callable[[str, bool], str],
    text: Callable[[str], str],
) -> tuple[list[str], list[list[str]]]:
    """Heads of the columns, and rows: a figure a row for a few policies, a policy a row for many."""
    few = len(plan.policies) <= _COLUMNS
    policies = plan.policies if few else by_score(summary, plan.policies)
    rows = [*figure_rows(summary, policies), *paired_rows(summary, policies)]
    labels, cells = [text(row.label) for row in rows], [_cells(row, cell) for row in rows]
    names = [text(policy) for policy in policies]
    if few:
        return ["", *names], [[label, *line] for label, line in zip(labels, cells, strict=True)]
    lines = zip(names, zip(*cells, strict=True), strict=True)
    return [text("policy"), *labels], [[name, *line] for name, line in lines]


def _cells(row: Row, cell: Callable[[str, bool], str]) -> list[str]:
    return [cell(words, place in row.best) for place, words in enumerate(row.cells())]


def pipe_table(head: Sequence[str], rows: Sequence[Sequence[str]], *, n_words: int = 1) -> str:
    """A table in Markdown; columns after the first few are numbers, and end on the right."""
    rule = ["---"] * n_words + ["---:"] * (len(head) - n_words)
    return "\n".join(f"| {' | '.join(line)} |" for line in (head, rule, *rows))


def markdown_text(text: str) -> str:
    """Text that means nothing to Markdown."""
    return re.sub(r"([\\`*_{}\[\]<>#|~$])", r"\\\1", text)


def _markdown_cell(words: str, best: bool) -> str:
    value, _, interval = words.partition(" ")
    return f"**{value}** {interval}".strip() if best else words


def latex_text(text: str) -> str:
    """Text that means nothing to LaTeX; in braces, so that a bracket is no option of the line above."""
    return f"{{{''.join(_TEX.get(sign, sign) for sign in text)}}}"


def _latex_cell(words: str, best: bool) -> str:
    value, _, interval = words.partition(" ")
    numbers = re.sub(r"[-+]?\d[\d.]*(?:e[-+]?\d+)?", lambda found: _latex_number(found[0]), interval)
    shown = _latex_number(value, bold=best) if re.search(r"\d", value) else value.replace("-", "--")
    return f"{shown} {numbers.replace('[-]', '[--]')}".strip()


def _latex_number(text: str, *, bold: bool = False) -> str:
    """A number in mathematics, its exponent as a power of ten."""
    digits, _, exponent = text.partition("e")
    power = rf"\times 10^{{{int(exponent)}}}" if exponent else ""
    return rf"$\mathbf{{{digits}{power}}}$" if bold else f"${digits}{power}$"
