"""Picture of trainings: the mean over all scenarios in large, and each scenario in small."""

from collections.abc import Sequence
from itertools import cycle, product

from wifipgo.command.figures import Axes, Figure

import pandas as pd

from train._learning_curve import LEARNED
from wifipgo.command.palette import GREY, SERIES

_N_SMALL = 3  # small pictures beside each other
# Of recipes: where colours are used up they come again, with another line. Dashes are those of rules.
_LOOKS = tuple(product(("-", ":", "-."), SERIES))


def drawn(curves: pd.DataFrame, scenarios: Sequence[str]) -> Figure:
    """Thin lines are runs, thick ones means of a recipe, bands its range, dashes scripted policies."""
    n_lines = -(-len(scenarios) // _N_SMALL)
    figure = Figure(figsize=(13.0, max(4.5, 1.9 * n_lines)), layout="constrained")
    left, right = figure.subfigures(1, 2, width_ratios=[1.0, 1.35])  # type: ignore[misc]
    large = left.subplots()
    _curve(large, curves)
    large.set(xlabel="agent-steps (millions)", ylabel="mapped share of the floor (%)")
    large.set_title(f"mean of {len(scenarios)} scenarios", loc="left")
    left.legend(loc="outside lower left", frameon=False, fontsize=9)
    small = right.subplots(n_lines, min(_N_SMALL, len(scenarios)), squeeze=False, sharex=True).ravel()
    for axes, scenario in zip(small, scenarios, strict=False):
        _curve(axes, curves[curves["scenario"] == scenario])
        axes.set_title(scenario, loc="left", fontsize=8)
    for axes in small[len(scenarios) :]:
        axes.set_visible(False)
    return figure


def _curve(axes: Axes, curves: pd.DataFrame) -> None:
    """One line and band a recipe, one dashed line a scripted policy."""
    learned, rules = curves[curves["policy"] == LEARNED], curves[curves["policy"] != LEARNED]
    recipes = learned.groupby("recipe", sort=False)
    for (line, colour), (recipe, mine) in zip(cycle(_LOOKS), recipes, strict=False):
        by_run = 100.0 * mine.pivot_table(index="agent_steps", columns="run", values="mapped_share")
        together, n_runs = by_run.dropna(), by_run.shape[1]
        x = together.index.to_numpy(float) / 1e6
        seeds = f", mean and range of {n_runs} seeds" if n_runs > 1 else ""
        axes.plot(by_run.index.to_numpy(float) / 1e6, by_run, line, color=colour, lw=0.8, alpha=0.7)
        marker = "o" if len(together) == 1 else None  # a line of one point is not seen
        mean, label = together.mean(axis=1), f"{recipe}{seeds}"
        axes.plot(x, mean, line, color=colour, marker=marker, lw=2.0, label=label)
        axes.fill_between(x, together.min(axis=1), together.max(axis=1), color=colour, alpha=0.25, lw=0)
    for policy, scores in rules.groupby("policy", sort=False)["mapped_share"]:
        axes.axhline(100.0 * scores.mean(), color=GREY, ls="--", lw=1.2, label=str(policy))
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(alpha=0.3)
