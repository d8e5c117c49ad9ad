"""A suite's standings in one picture: scores by scenario, interquartile mean, probability of improvement."""

from collections.abc import Sequence
from pathlib import Path

from wifipgo.command.figures import Axes, Figure

import matplotlib as mpl
import numpy as np

from baselines.evaluation.intervals import Estimate
from baselines.evaluation.labels import names_of
from baselines.evaluation.plots import STYLE
from baselines.suite.standings import Standing
from wifipgo.command.palette import SERIES


def draw_suite(path: Path, standings: Sequence[Standing], *, title: str, reference: str) -> None:
    """Draw a row for each policy, the best at the top."""
    n_scenarios = len(standings[0].scores)
    with mpl.rc_context(STYLE):
        size = (5.4 + 0.72 * n_scenarios, 1.6 + 0.42 * len(standings))
        figure = Figure(figsize=size, dpi=130, layout="constrained")
        of_all, iqm, better = figure.subplots(1, 3, sharey=True, width_ratios=[0.72 * n_scenarios, 1.7, 1.7])
        _scores(of_all, standings)
        _estimates(iqm, [one.iqm for one in standings])
        iqm.set_xlabel("interquartile mean\nof normalised scores")
        _estimates(better, [one.improvement for one in standings])
        better.axvline(0.5, color="0.6", lw=1.0, zorder=0)
        better.set_xlabel(f"P(better than\n{reference})")
        figure.suptitle(title, fontsize=10, x=0.01, ha="left")
        figure.savefig(path)


def _scores(axes: Axes, standings: Sequence[Standing]) -> None:
    """Mapped share in per cent, coloured by where it lies between the floor and the ceiling."""
    shades = np.array([list(one.normalised.values()) for one in standings])
    axes.imshow(shades, vmin=0.0, vmax=1.0, cmap="Purples", aspect="auto")
    for row, one in enumerate(standings):
        for column, score in enumerate(one.scores.values()):
            ink = "white" if shades[row, column] > 0.6 else "black"
            text = f"{100.0 * (score.value or 0.0):.0f}"
            axes.text(column, row, text, ha="center", va="center", color=ink, fontsize=9)
    axes.set_xticks(range(shades.shape[1]), list(standings[0].scores), fontsize=8)
    axes.set_yticks(range(len(standings)), names_of([one.label for one in standings]), fontsize=9)
    axes.tick_params(length=0)
    axes.set_xlabel("mapped share, %; dark: near the ceiling of the scenario")


def _estimates(axes: Axes, found: Sequence[Estimate | None]) -> None:
    """Dots with their intervals."""
    for row, one in enumerate(found):
        if one is not None and one.value is not None and one.low is not None and one.high is not None:
            axes.plot([one.low, one.high], [row, row], color=SERIES[0], lw=2.0)
            axes.plot(one.value, row, "o", color=SERIES[0], ms=5)
    axes.grid(axis="x", alpha=0.3)
    axes.tick_params(axis="y", length=0)
