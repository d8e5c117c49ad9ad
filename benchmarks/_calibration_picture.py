"""Distributions of errors, simulated beside recorded: a row a scenario, in and beyond sight."""

from collections.abc import Sequence
from pathlib import Path

from wifipgo.command.figures import Axes, Figure, drawing

import numpy as np
import pandas as pd
from jaxtyping import Float

from wifipgo.command.palette import BLUE, GRID, VERMILION

LIMITS_DEG = (0.05, 180.0)
_TICKS_DEG = (0.1, 1.0, 10.0, 100.0)


def save_picture(rows: pd.DataFrame, sights: Sequence[str], recorded: str, path: Path) -> None:
    """Two curves a panel: of the recordings, a step for each, and of the scenario."""
    names = [name for name in rows["scenario"].unique() if name != recorded]
    with drawing(path, asked_for=True):
        figure = Figure(figsize=(9.0, 0.6 + 2.5 * len(names)), layout="constrained")
        panels = figure.subplots(len(names), len(sights), squeeze=False, sharex=True, sharey=True)
        for name, line in zip(names, panels, strict=True):
            for sight, axes in zip(sights, line, strict=True):
                of_sight = rows[rows["sight"] == sight]
                simulated, real = (
                    np.abs(of_sight.loc[of_sight["scenario"] == one, "error_deg"].to_numpy(float))
                    for one in (name, recorded)
                )
                _draw(axes, simulated, real)
                axes.set_title(f"{name}, {sight}" if len(simulated) else f"{name}: nothing {sight}")
        panels[0, 0].legend(loc="upper left", frameon=False)
        for axes in panels[-1]:
            axes.set_xlabel("|error| of the bearing (deg)")
        for axes in panels[:, 0]:
            axes.set_ylabel("share of bearings")
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, dpi=110)


def _draw(axes: Axes, simulated_deg: Float[np.ndarray, " n"], real_deg: Float[np.ndarray, " m"]) -> None:
    axes.axvline(20.0, color=GRID, lw=1.0)
    axes.ecdf(np.maximum(real_deg, LIMITS_DEG[0]), color=VERMILION, lw=2.5, label="recordings")
    if len(simulated_deg):
        axes.ecdf(np.maximum(simulated_deg, LIMITS_DEG[0]), color=BLUE, lw=1.8, label="simulated")
    axes.set(xscale="log", xlim=LIMITS_DEG, ylim=(0.0, 1.0))
    axes.set_xticks(_TICKS_DEG, [f"{tick:g}" for tick in _TICKS_DEG])
    axes.spines[["top", "right"]].set_visible(False)
