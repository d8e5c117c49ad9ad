"""An evaluation on the terminal: a table, the paired comparison, where the results are."""

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.table import Table
from rich.text import Text

from baselines.evaluation.plan import Plan
from baselines.evaluation.rows import (
    SIDE_BY_SIDE,
    Row,
    by_score,
    compared_with,
    figure_rows,
    ladder_rows,
    paired_rows,
)
from baselines.evaluation.statistics import Summary
from wifipgo.command.checkout import runnable
from wifipgo.command.terminal import say


def announce(plan: Plan, *, jobs: int, n_left: int, console: Console) -> None:
    """Say what is about to run."""
    sc = plan.scenario
    what = f"{sc.name}: {sc.n_robots} robots, {sc.n_steps} iterations"
    how = f"{', '.join(plan.policies)}; {plan.trials_in_words} each, seed {plan.seed}"
    episodes = plan.trials * len(plan.policies)
    left = "" if n_left == episodes else f", {episodes - n_left} of them done before"
    say(console, f"{what}\n{how}\n{episodes} episodes{left}; jobs: {jobs}")
    for remark in plan.remarks:
        say(console, f"note: {remark}")


def report(summary: Summary, plan: Plan, *, out: str, console: Console) -> None:
    """Print the table, the comparison, and where everything is."""
    title = f"mean and 95 % interval over {plan.trials_in_words}"
    few = len(plan.policies) <= SIDE_BY_SIDE
    for table in [_side_by_side(title, summary, plan)] if few else _ladders(title, summary, plan):
        console.print(table)
    for warning in summary.warnings:
        say(console, f"warning: {warning}")
    say(console, f"results: {out}")
    record = str(Path(out) / "config.json")
    say(console, f"repeat:  {runnable('evaluate', '--config', record, '--out', 'OTHER')}")


def _side_by_side(title: str, summary: Summary, plan: Plan) -> Table:
    """One column a policy, and below the figures the comparison."""
    table = Table(title=title, title_justify="left")
    table.add_column("", no_wrap=True)
    for policy in plan.policies:
        table.add_column(Text(policy), justify="right")
    for row in figure_rows(summary, plan.policies):
        table.add_row(row.label, *map(Text, row.cells()))
    if summary.paired:
        table.add_section()
        table.add_row(Text(compared_with(summary)))
    for row in paired_rows(summary, plan.policies):
        table.add_row(f"  {row.label}", *map(Text, row.cells()))
    return table


def _ladders(title: str, summary: Summary, plan: Plan) -> list[Table]:
    """One row a policy, the figures and the comparison apart; summary.json has the other figures."""
    policies = by_score(summary, plan.policies)
    others = [policy for policy in policies if policy in summary.paired]
    return [
        _ladder(title, policies, ladder_rows(summary, policies)),
        _ladder(compared_with(summary), others, paired_rows(summary, others), no_wrap=False),
    ]


def _ladder(title: str, policies: Sequence[str], rows: Sequence[Row], *, no_wrap: bool = True) -> Table:
    table = Table(title=title, title_justify="left")
    table.add_column("policy", no_wrap=True)
    for row in rows:
        table.add_column(row.label, justify="right", no_wrap=no_wrap)
    for policy, cells in zip(policies, zip(*(row.cells(digits=2) for row in rows), strict=True), strict=True):
        table.add_row(Text(policy), *map(Text, cells))
    return table
