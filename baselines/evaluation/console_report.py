"""An evaluation on the terminal: a table, the paired comparison, where the results are."""

from pathlib import Path

from rich.console import Console
from rich.table import Table
from rich.text import Text

from baselines.evaluation.plan import Plan
from baselines.evaluation.statistics import Estimate, Paired, Summary
from wifipgo.command.checkout import runnable
from wifipgo.command.terminal import say

# More policies than this make a ladder: one row each, the best score first.
_SIDE_BY_SIDE = 3
_LADDER = {
    "mapped_share": "mapped share",
    "err_last10": "Err, last 10",
    "ate_trans": "ATE (m²)",
}
# Figure of the summary, what to call it, and the unit that it is shown in.
_ROWS = (
    ("mapped_share", "score: mapped share", 1.0),
    ("err_last10", "Err, last 10 iterations", 1.0),
    ("share_above", "share above threshold", 1.0),
    ("ate_trans", "ATE, translation (m²)", 1.0),
    ("ate_rot", "ATE, rotation", 1.0),
    ("rendezvous", "rendezvous", 1.0),
    ("coverage", "share of cells seen", 1.0),
    ("distance_m", "distance, team (m)", 1.0),
    ("bumps", "bumps", 1.0),
    ("bytes_sent", "sent in all (kB)", 1e3),
    ("n_steps", "iterations", 1.0),
)


def announce(plan: Plan, *, jobs: int, n_left: int, console: Console) -> None:
    """Say what is about to run."""
    sc = plan.scenario
    what = f"{sc.name}: {sc.n_robots} robots, {sc.n_steps} iterations"
    how = f"{', '.join(plan.policies)}; {plan.trials_in_words} each, seed {plan.seed}"
    episodes = plan.trials * len(plan.policies)
    left = "" if n_left == episodes else f", {episodes - n_left} of them done before"
    say(console, f"{what}\n{how}\n{episodes} episodes{left}; jobs: {jobs}")


def report(summary: Summary, plan: Plan, *, out: str, console: Console) -> None:
    """Print the table, the comparison, and where everything is."""
    fill = _side_by_side if len(plan.policies) <= _SIDE_BY_SIDE else _ladder
    table = Table(title=f"mean and 95 % interval over {plan.trials_in_words}", title_justify="left")
    fill(table, summary, plan)
    console.print(table)
    for policy, paired in summary.paired.items():
        say(console, _comparison(policy, summary.reference, paired))
    say(console, f"results: {out}")
    record = str(Path(out) / "config.json")
    say(console, f"repeat:  {runnable('evaluate', '--config', record, '--out', 'OTHER')}")


def _side_by_side(table: Table, summary: Summary, plan: Plan) -> None:
    """One column a policy."""
    table.add_column("", no_wrap=True)
    for policy in plan.policies:
        table.add_column(Text(policy), justify="right")
    for figure, label, unit in _ROWS:
        cells = [shown(summary.policies[policy][figure], unit=unit) for policy in plan.policies]
        table.add_row(label, *map(Text, cells))


def _ladder(table: Table, summary: Summary, plan: Plan) -> None:
    """One row a policy; summary.json has the other figures."""
    table.add_column("policy", no_wrap=True)
    for label in _LADDER.values():
        table.add_column(label, justify="right", no_wrap=True)
    scores = {policy: summary.policies[policy]["mapped_share"].value or 0.0 for policy in plan.policies}
    for policy in sorted(plan.policies, key=scores.__getitem__, reverse=True):
        cells = [shown(summary.policies[policy][figure], digits=2) for figure in _LADDER]
        table.add_row(Text(policy), *map(Text, cells))


def shown(estimate: Estimate, *, unit: float = 1.0, sign: str = "", digits: int = 3) -> str:
    """Value and interval, ``9.0 [7.1, 11.2]``; ``-`` for what there is not."""
    if estimate.value is None:
        return "-"
    value, low, high = (
        None if x is None else _number(x / unit, sign, digits)
        for x in (estimate.value, estimate.low, estimate.high)
    )
    return f"{value} [-]" if low is None or high is None else f"{value} [{low}, {high}]"


def _number(value: float, sign: str, digits: int) -> str:
    """Some significant digits, without an exponent where it can be read."""
    if value == 0.0:
        return "0"
    if 1e-3 <= abs(value) < 10.0**digits:
        return f"{value:{sign}.{digits}g}"
    return f"{value:{sign}.0f}" if 1.0 <= abs(value) < 1e7 else f"{value:{sign}.{digits - 1}e}"


def _comparison(policy: str, reference: str, paired: Paired) -> str:
    """A policy against the reference in words."""
    ate_m2, ate_rot = (shown(e, sign="+") for e in (paired.ate_trans_difference, paired.ate_rot_difference))
    pairs = f"{paired.n_pairs} pair{'s' if paired.n_pairs > 1 else ''}"
    return (
        f"{policy} against {reference}, {pairs}: score {shown(paired.score_difference, sign='+')};\n"
        f"  Err of the last 10 iterations {shown(paired.err_ratio)} times as large;\n"
        f"  ATE {ate_m2} m² in translation, {ate_rot} in rotation"
    )
