"""The panels of Fig. 10."""

from pathlib import Path
from typing import Any

from wifipgo.command.figures import Axes

import numpy as np
import pandas as pd
from jaxtyping import Float
from matplotlib.figure import SubFigure

from baselines.evaluation.labels import whole
from baselines.reproduce import _draw
from baselines.reproduce._outlier_trials import METHODS
from wifipgo.command.palette import BLUE, ORANGE, PURPLE, VERMILION
from wifipgo.graph.outliers.aoa_weights import PAPER_GATE_RAD, likelihood

SAMPLES = 100  # AOA samples in the picture, as in the paper
SHOWN = {"none": "before", "paper": "after\n(Eq. 11)", "huber": "Huber", "bearing": "bearings\n(default)"}
_KINDS = {"no": "no outliers", "random": "mild, any sign", "same": "mild, one sign", "gross": "gross"}
_GATE_DEG = float(np.rad2deg(PAPER_GATE_RAD))


def draw(
    path: Path, errors: Float[np.ndarray, "trials methods"], met: pd.DataFrame, grid: pd.DataFrame
) -> None:
    """Before and after, AOA errors, weights, the joint distribution, and the grid."""
    with _draw.page(path, (10.4, 6.4)) as figure:
        parts: Any = figure.subfigures(2, 1)
        panels = parts[0].subplots(1, 3)
        _before_after(panels[0], errors)
        _samples(panels[1], met)
        _weights(panels[2], met)
        below: Any = parts[1].subfigures(1, 2, width_ratios=[1.0, 2.0])
        _joint(below[0].subplots(), met)
        _grid(below[1], grid)


def _before_after(axes: Axes, errors: Float[np.ndarray, "trials methods"]) -> None:
    """Mean error under each method, and every trial."""
    for place, name in enumerate(SHOWN):
        own = errors[:, METHODS.index(name)]
        axes.bar(place, own.mean(), color=(VERMILION, BLUE, ORANGE, PURPLE)[place], width=0.6, alpha=0.6)
        axes.plot(np.full(len(own), place), own, "k_", ms=7, mew=0.7)
    axes.set_xticks(range(len(SHOWN)), list(SHOWN.values()), fontsize=7)
    axes.set_ylabel("ground-truth error: Eq. 12 (m²)\n+ Eq. 13 (unitless), as the paper adds")
    ceiling, shown = (
        1.1 * float(np.percentile(errors, 98.0)),
        errors[:, [METHODS.index(name) for name in SHOWN]],
    )
    axes.set_ylim(0.0, ceiling)
    above = int((shown > ceiling).sum())
    over = f", {above} marks above" if above else ""
    axes.set_title(f"(a) mean and {len(errors)} trials{over}", fontsize=9, loc="left")


def _samples(axes: Axes, met: pd.DataFrame) -> None:
    """Error of the highest peak of the first samples."""
    error_deg = np.rad2deg(met.aoa_error_rad.to_numpy(float)[:SAMPLES])
    edge = _edge_deg(error_deg)
    beyond = int((np.abs(error_deg) > edge).sum())
    axes.hist(
        np.clip(error_deg, -edge, edge), bins=np.linspace(-edge, edge, 31).tolist(), color=BLUE, alpha=0.7
    )
    outer = f"; {beyond} beyond {edge:g} in the outer bins" if beyond else ""
    axes.set(xlabel=f"AOA error (deg){outer}", ylabel="samples")
    middle = float(np.median(np.abs(error_deg)))
    axes.set_title(f"(b) {len(error_deg)} AOA samples, median |.| {middle:.1f} deg", fontsize=9, loc="left")


def _edge_deg(error_deg: np.ndarray) -> float:
    """Edge of an axis that most errors fill, deg."""
    most = float(np.percentile(np.abs(error_deg), 95.0)) if len(error_deg) else 0.0
    return next((edge for edge in (1.0, 2.0, 3.0, 5.0, 10.0, 20.0) if edge >= 1.2 * most), 30.0)


def _weights(axes: Axes, met: pd.DataFrame) -> None:
    """W of Eq. 7 against the difference, and where good and bad measurements lie."""
    x_deg = np.linspace(0.0, 30.0, 301)
    axes.plot(x_deg, likelihood(np.deg2rad(x_deg)), color="0.3", lw=1.0, label="W (Eq. 7)")
    _marked(axes, met, np.minimum(np.rad2deg(met.off_rad.abs().to_numpy(float)), 30.0), met.weight)
    axes.axvline(_GATE_DEG, color="0.3", lw=0.8, ls="--", label=f"{_GATE_DEG:.1f} deg")
    axes.set(xlabel="|reported azimuth - nearest peak| (deg)", ylabel="W")
    axes.legend(fontsize=7)
    axes.set_title("(c) weights", fontsize=9, loc="left")


def _joint(axes: Axes, met: pd.DataFrame) -> None:
    """Errors of both azimuths against each other."""
    pose, aoa = (np.rad2deg(met[c].to_numpy(float)) for c in ("pose_azimuth_error_rad", "aoa_error_rad"))
    _marked(axes, met, pose, aoa)
    edge = np.array([-40.0, 40.0])
    for sign in (-1.0, 1.0):
        axes.plot(edge, edge + sign * _GATE_DEG, color="0.3", lw=0.8, ls="--")
    tall = min(max(2.0 * _GATE_DEG, 1.2 * _edge_deg(aoa)), 40.0)
    axes.set(xlim=(-40, 40), ylim=(-tall, tall), xlabel="error of reported azimuth (deg)")
    axes.set_ylabel("error of highest peak (deg)")
    axes.set_title(f"(d) joint distribution; dashed: {_GATE_DEG:.1f} deg apart", fontsize=9, loc="left")


def _marked(axes: Axes, met: pd.DataFrame, x: np.ndarray, y: object) -> None:
    """Good measurements as dots, outliers as crosses."""
    bad, height = met.is_outlier.to_numpy(bool), np.asarray(y, dtype=float)
    axes.plot(x[~bad], height[~bad], "o", color=BLUE, ms=3, alpha=0.5, mew=0, label="good")
    axes.plot(x[bad], height[bad], "x", color=VERMILION, ms=5, alpha=0.8, label="outlier")


def _grid(figure: SubFigure, grid: pd.DataFrame) -> None:
    """Reduction by kind, odometry and range, of Eq. 11 and of bearings."""
    means = grid.groupby(["method", "kind", "range_m", "odometry"]).error.mean()
    panels = figure.subplots(1, 2, sharey=True)
    kinds, ranges = ("no", "random", "same", "gross"), sorted(grid.range_m.unique())
    rows = [(kind, r) for kind in kinds for r in ranges]
    names = ("good", "mid", "noisy")
    for axes, method, title in zip(panels, ("paper", "bearing"), ("Eq. 11", "bearings"), strict=True):
        values = [
            [100.0 * (1.0 - means[method, k, r, o] / means["none", k, r, o]) for o in names] for k, r in rows
        ]
        image = axes.imshow(values, cmap="RdBu", vmin=-80.0, vmax=80.0, aspect="auto")
        for (y, x), value in np.ndenumerate(np.array(values)):
            colour = "white" if abs(value) > 50.0 else "black"
            axes.text(x, y, whole(value), ha="center", va="center", fontsize=8, color=colour)
        axes.set_xticks(range(3), names)
        axes.set_yticks(range(len(rows)), [f"{_KINDS[k]}, {r:g} m" for k, r in rows], fontsize=8)
        axes.set_xlabel("odometry")
        axes.set_title(f"(e) grid: {title}", fontsize=9, loc="left")
    figure.colorbar(
        image, ax=panels, label="reduction of ground-truth error (%),\nblue: better than no method"
    )
