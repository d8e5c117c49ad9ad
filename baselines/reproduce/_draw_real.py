"""The picture of the recorded team: paths, what sightings take off the error, and what directions do."""

from collections.abc import Mapping
from pathlib import Path

from wifipgo.command.figures import Axes

import numpy as np
import pandas as pd
from jaxtyping import Float

from baselines.evaluation.intervals import Estimate, reduction
from baselines.reproduce import _draw
from baselines.reproduce.real_windows import USED
from wifipgo.command.palette import BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILION
from wifipgo.datasets.team_run import TeamRun
from wifipgo.graph.solvers.sightings import solve_sightings

_SOURCES = {
    "camera": "cameras",
    "in_sight": "CSI,\nin sight",
    "beyond": "CSI,\nbeyond",
    "wifi_6": "like Wi-Fi,\n6 deg",
    "wifi_12": "like Wi-Fi,\n12 deg",
}


def draw(
    path: Path, run: TeamRun, errors: pd.DataFrame, by_window: pd.DataFrame, whole: Mapping[str, float]
) -> None:
    """Paths of one robot, reductions by sightings, and reductions with outliers."""
    with _draw.page(path, (10.8, 3.9)) as figure:
        paths, sightings, outliers = figure.subplots(1, 3, width_ratios=[1.0, 1.0, 1.25])
        _paths(paths, run)
        _sightings(sightings, errors, whole)
        _outliers(outliers, by_window)


def _paths(axes: Axes, run: TeamRun) -> None:
    """Where the robot was that dead reckoning knows least of."""
    off_m = np.hypot(*(run.start - run.truth)[..., :2].transpose(2, 0, 1))
    robot = int(np.nanmean(off_m, axis=1).argmax())
    solved, _ = solve_sightings(run.start, run.odometry, bearings=run.bearings, robots=range(len(run.start)))
    for poses, colour, label in (
        (run.truth, "0.2", "motion capture"),
        (run.start, VERMILION, "dead reckoning"),
        (solved, BLUE, "bearings only"),
    ):
        axes.plot(*poses[robot, :, :2].T, color=colour, lw=0.9, alpha=0.85, label=label)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(xlabel="x (m)", ylabel="y (m)")
    axes.legend(fontsize=7, loc="lower left")
    minutes = (run.time_s[-1] - run.time_s[0]) / 60.0
    axes.set_title(f"(a) robot {run.robots[robot]} over {minutes:.0f} minutes", fontsize=9, loc="left")


def _bar(axes: Axes, place: float, found: Estimate, colour: str, label: str = "") -> None:
    """A reduction with its interval."""
    value = found.value or 0.0
    ends = [[value - (found.low or value)], [(found.high or value) - value]]
    axes.bar(place, value, width=0.36, color=colour, alpha=0.75, label=label)
    axes.errorbar([place], [value], yerr=np.abs(ends), color="0.2", lw=1.0, capsize=2)


def _sightings(axes: Axes, errors: pd.DataFrame, whole: Mapping[str, float]) -> None:
    """What each use of the sightings takes off Eq. 12."""
    bare: Float[np.ndarray, " windows"] = errors["dead reckoning"].to_numpy(float)
    for place, used in enumerate(USED):
        for shift, loss, colour in ((-0.2, "huber", SKY), (0.2, "geman_mcclure", GREEN)):
            name = f"{used}, {loss}"
            label = loss.replace("_", "-").title().replace("Mcclure", "McClure") if place == 0 else ""
            _bar(axes, place + shift, reduction(errors[name].to_numpy(float), bare), colour, label)
            gone = 100.0 * (1.0 - whole[name] / whole["dead reckoning"])
            mark = "whole run" if place == 0 and shift < 0.0 else ""
            axes.plot(place + shift, gone, "D", color=PURPLE, ms=5, label=mark)
    axes.axhline(75.0, color="0.3", lw=0.8, ls="--")
    axes.axhline(0.0, color="0.3", lw=0.8)
    axes.set_xticks(range(len(USED)), list(USED))
    axes.set_ylim(-100.0, 105.0)  # an interval of a mean that one window makes is longer
    axes.set_ylabel("reduction of Eq. 12 (%), more is better")
    axes.legend(fontsize=7, loc="lower right")
    axes.set_title(
        f"(b) against dead reckoning: {len(bare)} windows\nbars with 95 %; dashed: goal",
        fontsize=9,
        loc="left",
    )


def _outliers(axes: Axes, by_window: pd.DataFrame) -> None:
    """What directions of every source take off the error with outliers."""
    bare = by_window["nothing"].to_numpy(float)
    for place, source in enumerate(_SOURCES):
        for shift, method, colour, label in (
            (-0.2, "eq11", ORANGE, "weights of Eq. 11"),
            (0.2, "factors", BLUE, "bearings as factors"),
        ):
            after = by_window[f"{method}_{source}"].to_numpy(float)
            if not np.isnan(after).any():
                _bar(axes, place + shift, reduction(after, bare), colour, label if place == 0 else "")
    most = reduction(by_window["removed"].to_numpy(float), bare).value or 0.0
    axes.axhline(most, color=GREEN, lw=1.0, label="true outliers removed")
    axes.axhline(32.0, color="0.3", lw=0.8, ls="--", label="the paper's 32 %")
    axes.axhline(0.0, color="0.3", lw=0.8)
    axes.set_xticks(range(len(_SOURCES)), list(_SOURCES.values()), fontsize=7)
    axes.set_xlabel("where errors of bearings come from")
    axes.set_ylabel("reduction of Eq. 12 + Eq. 13 (%)")
    axes.legend(fontsize=7)
    axes.set_title(
        "(c) 3 outliers of 9 relative poses,\nreal odometry and encounters", fontsize=9, loc="left"
    )
