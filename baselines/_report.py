"""An evaluation on the terminal: a table, the paired comparison, where the results are."""

from rich.console import Console
from rich.table import Table
from rich.text import Text

from baselines._plan import Plan
from baselines._statistics import Estimate, Paired, Summary

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
    table = Table(title=f"mean and 95 % bootstrap interval over {plan.trials_in_words}", title_justify="left")
    table.add_column("", no_wrap=True)
    for policy in plan.policies:
        table.add_column(Text(policy), justify="right")
    for figure, label, unit in _ROWS:
        cells = [shown(summary.policies[policy][figure], unit=unit) for policy in plan.policies]
        table.add_row(label, *map(Text, cells))
    console.print(table)
    for policy, paired in summary.paired.items():
        say(console, _comparison(policy, summary.reference, paired))
    say(console, f"results: {out}")
    say(console, f"repeat:  python -m baselines.evaluate --config {out}/config.json --out OTHER")


def shown(estimate: Estimate, *, unit: float = 1.0, sign: str = "") -> str:
    """Value and interval, ``9.0 [7.1, 11.2]``; ``-`` for what there is not."""
    if estimate.value is None:
        return "-"
    if estimate.low is None or estimate.high is None:
        return f"{_number(estimate.value / unit, sign)} [-]"
    low, high = _number(estimate.low / unit, sign), _number(estimate.high / unit, sign)
    return f"{_number(estimate.value / unit, sign)} [{low}, {high}]"


def _number(value: float, sign: str = "") -> str:
    """Three significant digits, without an exponent where it can be read."""
    if value == 0.0:
        return "0"
    if 1e-3 <= abs(value) < 1e3:
        return f"{value:{sign}.3g}"
    return f"{value:{sign}.0f}" if 1e3 <= abs(value) < 1e7 else f"{value:{sign}.2e}"


def _comparison(policy: str, reference: str, paired: Paired) -> str:
    """A policy against the reference in words."""
    ate_m2, ate_rot = (shown(e, sign="+") for e in (paired.ate_trans_difference, paired.ate_rot_difference))
    pairs = f"{paired.n_pairs} pair{'s' if paired.n_pairs > 1 else ''}"
    return (
        f"{policy} against {reference}, {pairs}: Err of the last 10 iterations "
        f"{shown(paired.err_ratio)} times as large;\n  ATE {ate_m2} m² in translation, {ate_rot} in rotation"
    )


def say(console: Console, text: str) -> None:
    """Print as it is: no markup, no colours for numbers, no breaks within a line."""
    console.print(Text(text), soft_wrap=True, highlight=False)
