"""Picture of the benchmark of outlier methods: a summary in numbers, and every cell as a colour."""

from collections.abc import Sequence
from itertools import product
from typing import Any

from wifipgo.command.figures import Axes, Figure

import numpy as np
import pandas as pd

from baselines.evaluation.labels import whole
from baselines.reproduce.encounter_grid import ODOMETRY
from wifipgo.command.palette import BLUE, VERMILION

WRONG = " / wrong bearings"
LABELS = {
    "paper": "Eq. 11 (paper)",
    "range_aware": "range-aware gate",
    "pcm": "PCM",
    "huber": "Huber",
    "gnc": "GNC-TLS",
    "bearing": "Huber + bearings\n(default)",
    "oracle": "true outliers\nremoved",
}
SHOWN = LABELS | {"bearing" + WRONG: "default, every\nbearing wrong"}  # in the picture
KINDS = {"no": "no outliers", "random": "mild, random signs", "same": "mild, same signs", "gross": "gross"}
PAPER_CLAIM = 32.0  # per cent


def drawn(frame: pd.DataFrame, table: pd.DataFrame, title: str) -> Figure:
    """A summary in numbers, and below it the cells as colours: odometry, kind and even number, range."""
    figure = Figure(figsize=(12.0, 8.6), layout="constrained")
    above, below = figure.subfigures(2, 1, height_ratios=[1.0, 1.25])  # type: ignore[misc]
    _summary(above, table.loc[list(SHOWN)])
    _cells(below, frame)
    figure.suptitle(title, fontsize=12)
    return figure


def _summary(figure: Any, table: pd.DataFrame) -> None:
    """Mean reduction of each method by kind of outlier, over all cells with outliers, and in its worst."""
    left, right = figure.subplots(1, 2, width_ratios=[2.0, 1.0])
    names = [label.replace("\n", " ") for label in SHOWN.values()]
    values = table[list(KINDS)].to_numpy(float)
    left.imshow(values, **_COLOURS)
    _numbers(left, values, fontsize=11)
    left.set_xticks(range(len(KINDS)), [kind.replace(", ", ",\n") for kind in KINDS.values()])
    left.set_yticks(range(len(names)), names)
    left.set_title("mean reduction of ground-truth error (%), by kind of outlier", fontsize=10, loc="left")
    rows = np.arange(len(names))
    right.errorbar(table["all"], rows, xerr=table.half, fmt="o", color=BLUE, label="mean, 95 %")
    right.plot(table.worst, rows, "x", color=VERMILION, label="worst cell")
    right.axvline(0.0, color="0.4", lw=0.8)
    right.axvline(PAPER_CLAIM, color="0.4", lw=0.8, ls="--", label=f"claim: {PAPER_CLAIM:.0f} %")
    right.set(yticks=rows, yticklabels=[], ylim=(len(names) - 0.5, -0.5), xlabel="reduction (%)")
    right.set_title("all cells with outliers; the worst of all", fontsize=10, loc="left")
    figure.legend(loc="outside lower right", ncols=3, fontsize=9, frameon=False)


def _cells(figure: Any, frame: pd.DataFrame) -> None:
    """One column of small maps a method, one row an odometry."""
    axes = figure.subplots(len(ODOMETRY), len(SHOWN), sharex=True, sharey=True)
    frame = frame[frame.n_outliers % 2 == 0].assign(
        outliers=lambda f: f.n_outliers.astype(str) + " " + f.kind
    )
    order = list(dict.fromkeys(frame.sort_values(["kind", "n_outliers"], key=_rank).outliers))
    for (row, quality), (column, method) in product(enumerate(ODOMETRY.values()), enumerate(SHOWN)):
        ax, part = axes[row, column], frame[(frame.method == method) & (frame.odometry == quality)]
        grid_of = part.pivot_table(index="outliers", columns="range_m", values="reduction").loc[order]
        image = ax.imshow(grid_of, **_COLOURS)
        ax.set_xticks(range(grid_of.shape[1]), [f"{r:g}" for r in grid_of.columns], fontsize=8)
        ax.set_yticks(*_by_kind(order), fontsize=8)
        if row == 0:
            ax.set_title(SHOWN[method], fontsize=9)
        if column == 0:
            ax.set_ylabel(f"{quality} odometry", fontsize=9)
    figure.supxlabel("range of the encounter (m)", fontsize=9)
    figure.supylabel("outliers of 9, by number and kind", fontsize=9)
    bar = figure.colorbar(image, ax=axes, shrink=0.8, extend="both")
    bar.set_label("reduction (%), blue: better than no method")


def _by_kind(order: Sequence[str]) -> tuple[list[float], list[str]]:
    """Middle of the rows of each kind of outlier, and what they are."""
    rows = {kind: [k for k, name in enumerate(order) if name.split()[1] == kind] for kind in KINDS}
    numbers = {kind: [order[k].split()[0] for k in places] for kind, places in rows.items()}
    texts = [f"{', '.join(numbers[kind])} {kind}" if kind != "no" else "none" for kind in rows]
    return [float(np.mean(places)) for places in rows.values()], texts


_COLOURS: Any = {"cmap": "RdBu", "vmin": -80.0, "vmax": 80.0, "aspect": "auto"}


def _numbers(axes: Axes, values: np.ndarray, *, fontsize: float) -> None:
    """Whole numbers in the cells of a map, without a sign where they are zero."""
    for (y, x), value in np.ndenumerate(values):
        colour = "white" if abs(value) > 50.0 else "black"
        axes.text(x, y, whole(value), ha="center", va="center", fontsize=fontsize, color=colour)


def _rank(column: pd.Series) -> pd.Series:
    return column.map(list(KINDS).index) if column.name == "kind" else column
