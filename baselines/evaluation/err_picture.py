"""Picture of the error that robots know of: Err over iterations, and every rendezvous."""

from pathlib import Path

from wifipgo.command.figures import Axes, Figure

import matplotlib as mpl
import numpy as np
from matplotlib.collections import LineCollection

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
from baselines.evaluation.run_folder import Tables

_CURVES_IN, _AROUND_IN = 3.6, 1.2
_LANES_IN = 3.3  # at most, unless the names need more
_WIDE = 25.0  # in thresholds: where a mean rises so high, small values need a scale of their own


def draw_err(path: Path, plan: Plan, tables: Tables) -> None:
    """Draw mean Err over iterations with its band, and below it every rendezvous."""
    trials = [by_trial(tables.steps, policy) for policy in plan.policies]
    lanes_in = max(row_heights_in(plan.policies), min(0.55 * len(trials), _LANES_IN))
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(8.4, _CURVES_IN + lanes_in + _AROUND_IN), dpi=130, layout="constrained")
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=[_CURVES_IN, lanes_in])
        for place, of in enumerate(trials):
            curve(above, _until_half_ended(of), place, len(trials))
            often = tables.episodes["rendezvous"][tables.episodes["policy"] == plan.policies[place]].mean()
            _raster(below, of, len(trials) - 1 - place, colour_of(place), per_trial=float(often))
        name_rows(below, plan.policies, range(len(trials)))
        _label(above, below, plan, trials)
        figure.savefig(path)


def _until_half_ended(of: Trials) -> np.ndarray:
    """Err while more than half of the episodes last: later, worlds that stand still would hide the others."""
    end = int(np.sort(of.length)[len(of.length) // 2])
    return of.err[:, :end]


def _raster(axes: Axes, of: Trials, lane: int, colour: str, *, per_trial: float) -> None:
    """A tick for each iteration with a rendezvous, a row for each trial, a lane for each policy."""
    height = 0.8 / len(of.met)
    length = max(0.9 * height, 0.13)  # ticks of many trials overlap rather than vanish
    trial, iteration = np.nonzero(of.met)
    row = lane + 0.4 - height * (trial + 0.5)
    ends = np.stack([row - 0.5 * length, row + 0.5 * length], axis=1)
    ticks = np.stack([np.repeat(iteration[:, None] + 1.0, 2, axis=1), ends], axis=2)
    axes.add_collection(LineCollection(list(ticks), linewidths=1.5, colors=colour, alpha=0.7))
    axes.axhspan(lane - 0.44, lane + 0.44, color=colour, alpha=0.07, lw=0)
    axes.text(1.01, lane, f"{per_trial:.3g}", transform=axes.get_yaxis_transform(), va="center", fontsize=9)


def _label(above: Axes, below: Axes, plan: Plan, trials: list[Trials]) -> None:
    """Everything that makes the picture readable without its text."""
    threshold = plan.scenario.rendezvous.err_threshold
    above.axhline(threshold, color="0.2", lw=0.8)
    right = above.get_yaxis_transform()
    above.text(1.01, threshold, f"threshold\n{threshold:g}", transform=right, va="center", fontsize=9)
    above.set_title(title_of(plan, 84), loc="left")
    highest = max(float(of.err.mean(axis=0).max()) for of in trials)
    wide = highest > _WIDE * threshold > 0.0
    if wide:
        above.set_yscale("symlog", linthresh=threshold)
    above.set_ylabel(f"Err (Eq. 4, unitless{', log above the threshold' * wide})\n{_words(plan, trials)}")
    above.set_ylim(bottom=0.0)
    below.set_title("rendezvous, a row a trial; right: mean number", loc="left", fontsize=10)
    below.set_xlim(0, plan.scenario.n_steps + 1)
    below.set_xlabel("iteration")
    below.spines["left"].set_visible(False)


def _words(plan: Plan, trials: list[Trials]) -> str:
    """What curve and band are."""
    band = ", 95 % of the mean" if plan.trials > 1 else ""
    ends_early = any(of.length.min() < of.length.max() for of in trials)
    return f"mean over robots and trials{band}" + "\nuntil half ended" * ends_early
