"""An evaluation on the terminal: a table, the paired comparison, where the results are."""

from rich.console import Console
from rich.table import Table
from rich.text import Text

from baselines._plan import Plan
from baselines._statistics import Estimate, Paired, Summary

# Figure of the summary, what to call it, and digits after the point (None: three significant).
_ROWS = (
    ("err_last10", "Err, last 10 iterations"),
    ("share_above", "share of time above threshold"),
    ("ate_trans", "ATE, translation (m²)"),
    ("ate_rot", "ATE, rotation"),
    ("rendezvous", "rendezvous"),
    ("coverage", "share of cells seen"),
    ("distance_m", "distance, all robots (m)"),
    ("bumps", "bumps"),
    ("bytes_sent", "bytes sent"),
    ("n_steps", "iterations"),
)


def announce(plan: Plan, *, jobs: int, n_left: int, console: Console) -> None:
    """Say what is about to run."""
    sc = plan.scenario
    what = f"{sc.name}: {sc.n_robots} robots, {sc.n_steps} iterations"
    how = f"{', '.join(plan.policies)}; {plan.trials} trials each, seed {plan.seed}"
    episodes = plan.trials * len(plan.policies)
    left = "" if n_left == episodes else f", {episodes - n_left} of them done before"
    say(console, f"{what}\n{how}\n{episodes} episodes{left}; jobs: {jobs}")


def report(summary: Summary, plan: Plan, *, out: str, console: Console) -> None:
    """Print the table, the comparison, and where everything is."""
    table = Table(title=f"mean and 95 % bootstrap interval over {plan.trials} trials", title_justify="left")
    table.add_column("", no_wrap=True)
    for policy in plan.policies:
        table.add_column(Text(policy), justify="right")
    for figure, label in _ROWS:
        table.add_row(label, *(Text(shown(summary.policies[p][figure])) for p in plan.policies))
    console.print(table)
    for policy, paired in summary.paired.items():
        say(console, _comparison(policy, summary.reference, paired))
    say(console, f"results: {out}")
    say(console, f"repeat:  python -m baselines.evaluate --config {out}/config.json --out OTHER")


def shown(estimate: Estimate) -> str:
    """Value and interval, ``9.0 [7.1, 11.2]``; ``-`` for what there is not."""
    if estimate.value is None:
        return "-"
    if estimate.low is None or estimate.high is None:
        return f"{_number(estimate.value)} [-]"
    return f"{_number(estimate.value)} [{_number(estimate.low)}, {_number(estimate.high)}]"


def _number(value: float) -> str:
    """Three significant digits, without an exponent where it can be read."""
    if value == 0.0:
        return "0"
    if 1e-3 <= abs(value) < 1e3:
        return f"{value:.3g}"
    return f"{value:.0f}" if 1e3 <= abs(value) < 1e7 else f"{value:.2e}"


def _comparison(policy: str, reference: str, paired: Paired) -> str:
    """A policy against the reference in words."""
    return (
        f"{policy} against {reference}, {paired.n_pairs} pairs: Err of the last 10 iterations "
        f"{shown(paired.err_ratio)} times as large; ATE {shown(paired.ate_trans_difference)} m² and "
        f"{shown(paired.ate_rot_difference)} in rotation more"
    )


def say(console: Console, text: str) -> None:
    """Print as it is: no markup, no colours for numbers, no breaks within a line."""
    console.print(Text(text), soft_wrap=True, highlight=False)
