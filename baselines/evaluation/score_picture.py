"""Picture of the score: mapped share over iterations, and each policy's at the end with its interval."""

from pathlib import Path

from wifipgo.command.figures import Axes, Figure

import matplotlib as mpl

from baselines.evaluation.intervals import mean_of
from baselines.evaluation.plan import Plan
from baselines.evaluation.plots import (
    STYLE,
    Trials,
    by_trial,
    colour_of,
    curve,
    name_rows,
    row_heights_in,
    title_of,
)
from baselines.evaluation.rows import shown
from baselines.evaluation.run_folder import Tables
from wifipgo.world.coverage import TOLERANCE_M

_CURVES_IN, _AROUND_IN = 3.3, 1.6


def draw_score(path: Path, plan: Plan, tables: Tables) -> None:
    """Draw mean curves with their bands, and below them a row for each policy, the best first."""
    trials = [by_trial(tables.steps, policy) for policy in plan.policies]
    rows_in = row_heights_in(plan.policies)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(8.4, _CURVES_IN + rows_in + _AROUND_IN), dpi=130, layout="constrained")
        above, below = figure.subplots(2, 1, height_ratios=[_CURVES_IN, rows_in])
        for place, of in enumerate(trials):
            curve(above, of.score, place, len(trials))
        _rows(below, plan, trials)
        above.set_title(title_of(plan, 84), loc="left")
        above.set(xlabel="iteration", ylabel=f"score: share of the floor\nmapped within {TOLERANCE_M:g} m")
        above.set_xlim(0, plan.scenario.n_steps + 1)
        above.set_ylim(bottom=0.0)
        figure.savefig(path)


def _rows(axes: Axes, plan: Plan, trials: list[Trials]) -> None:
    """Mean score at the end and its interval, in the looks and the order that stand beside them."""
    final = [of.score[:, -1] for of in trials]
    order = sorted(range(len(final)), key=lambda place: -final[place].mean())
    name_rows(axes, [plan.policies[place] for place in order], order)
    for row, place in zip(range(len(order))[::-1], order, strict=True):
        found = mean_of(final[place])
        if found.low is not None and found.high is not None:
            axes.plot([found.low, found.high], [row, row], color=colour_of(place), lw=2.0)
        axes.plot(final[place].mean(), row, "o", color=colour_of(place), ms=6)
        axes.text(1.02, row, shown(found), transform=axes.get_yaxis_transform(), va="center", fontsize=9)
    interval = ", 95 % interval over trials" if plan.trials > 1 else ""
    axes.set_xlabel(f"score at the end: mean{interval}")
    axes.grid(axis="x", alpha=0.3)
    axes.spines["left"].set_visible(False)
