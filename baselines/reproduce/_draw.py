"""What the figures' pictures share: colours, curves with bands, marks of meetings, small files."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from wifipgo.command.figures import Axes, Figure, drawing

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist

from baselines.evaluation.episodes import Episode
from baselines.evaluation.plots import STYLE, bands, save_small
from baselines.reproduce._measures import mean_curves
from wifipgo.command.palette import BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILION

LOOKS: dict[str, tuple[str, Any]] = {
    "active": (BLUE, "-"),
    "random": (VERMILION, (0, (5, 1.5))),
    "random, every step": (ORANGE, (0, (1.5, 1))),
    "active, every step": (GREEN, "-."),
    "vision": (PURPLE, (0, (3, 1, 1, 1))),
}
CALLING = SKY


@contextmanager
def page(path: Path, size_in: tuple[float, float]) -> Iterator[Figure]:
    """A figure in the project's style, written when the block ends; what fails in it is a warning."""
    with drawing(path), mpl.rc_context({**STYLE, "font.size": 9}):
        figure = Figure(figsize=size_in, dpi=110, layout="constrained")
        yield figure
        save_small(figure, path)


def err_curve(axes: Axes, episodes: Sequence[Episode], label: str) -> None:
    """Mean Err over robots and trials, and the 95 % interval of the mean over trials."""
    colour, dashes = LOOKS[label]
    curves = mean_curves(episodes)
    iteration = np.arange(1, curves.shape[1] + 1)
    mean, low, high = bands(curves)
    axes.fill_between(iteration, low, high, color=colour, alpha=0.18, lw=0)
    axes.plot(iteration, mean, color=colour, ls=dashes, lw=1.8, label=label)


def threshold_line(axes: Axes, threshold: float) -> None:
    """The desired threshold, dashed as in the paper."""
    axes.axhline(threshold, color="0.25", lw=0.9, ls="--", label=f"threshold {threshold:g}")


def robots(axes: Axes, episode: Episode, colour: str, label: str = "") -> None:
    """Err of each robot in one trial."""
    prefix = f"{label}, " if label else ""
    errs = episode.steps["err"]
    for robot, err in enumerate(errs.T):
        style = ("-", "--")[robot % 2]
        axes.plot(
            np.arange(1, len(errs) + 1), err, color=colour, ls=style, lw=1.3, label=f"{prefix}robot {robot}"
        )


def meetings(axes: Axes, episode: Episode) -> None:
    """A line for each rendezvous."""
    for k, t in enumerate(episode.meetings[:, 0]):
        axes.axvline(t, color="0.6", lw=0.8, zorder=0, label=None if k else "rendezvous")


def shaded_calls(axes: Axes, episode: Episode) -> None:
    """Shade the iterations in which a call is up."""
    calling: Any = np.any(episode.steps["calling"], axis=1)
    iteration = np.arange(1, len(calling) + 1)
    low, high = 0.0, 1.0
    axes.fill_between(
        iteration,
        low,
        high,
        where=calling,
        step="mid",
        transform=axes.get_xaxis_transform(),
        color=CALLING,
        alpha=0.2,
        lw=0,
        label="call is up",
    )


def err_axes(axes: Axes, *, left: bool = True) -> None:
    """Labels of an axis of Err over iterations."""
    axes.set_xlabel("iteration")
    if left:
        axes.set_ylabel("Err (Eq. 4)")
    axes.set_xlim(left=0.0)


def from_zero(figure: Figure) -> None:
    """Let every axis of Err begin at 0, once all is drawn: panels may share their axes."""
    for axes in figure.axes:
        axes.set_ylim(bottom=0.0)


def key(figure: Figure) -> None:
    """One legend for all panels, below them."""
    entries: dict[str, Artist] = {}
    for axes in figure.axes:
        handles, labels = axes.get_legend_handles_labels()
        entries |= dict(zip(labels, handles, strict=True))
    columns = -(-len(entries) // -(-len(entries) // 6))  # lines of about as many
    figure.legend(
        list(entries.values()), list(entries), loc="outside lower center", ncols=columns, fontsize=8
    )
