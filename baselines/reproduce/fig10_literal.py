"""Fig. 10 where Sec. 7.3 is read literally: whether Eq. 11 gives 32 % there, and what gives it."""

from collections.abc import Iterator
from pathlib import Path

from wifipgo.command.figures import Axes

import numpy as np
import pandas as pd
from matplotlib.image import AxesImage

from baselines.evaluation.intervals import Estimate, reduction
from baselines.evaluation.labels import whole
from baselines.reproduce import _draw, _rules
from baselines.reproduce._claims import BESIDE, HEADLINE, Claim, Found, Sentence, judged, missing
from baselines.reproduce._recordings import ABSENT
from baselines.reproduce._runs import TRIALS, Setting
from baselines.reproduce.nine_poses_trials import (
    COUNTS,
    ODOMETRY_SCALES,
    RANGES_M,
    READINGS,
    TREATMENTS,
    NineRuns,
    chance_of_a_panel,
)

__all__ = ["SENTENCES", "TITLE", "TRIALS", "claims", "make", "tasks"]

TITLE = "Outlier rejection, Sec. 7.3 read literally"
SENTENCE = Sentence(
    "fig10.literal",
    "Eq. 11 cuts the ground-truth error by 32 % where Sec. 7.3 is read literally: nine relative poses, "
    "errors in them only, equal information matrices.",
    "Sec. 7.3, Fig. 10 (a)",
)
SENTENCES = (SENTENCE,)
CLAIMED = 32.0  # per cent
_BESIDE = {
    "eq11_recorded_in_sight": "AOA errors of recordings in sight",
    "eq11_recorded_beyond": "AOA errors of recordings beyond sight",
}


def tasks(setting: Setting) -> list[NineRuns]:
    """Every reading on every world's seed; no field of a scenario touches them."""
    seeds = tuple(world.seed for world in setting.worlds())
    return [
        NineRuns(cfg, seeds, setting.cache / f"nine-poses-{k:03d}-{len(seeds)}.npz")
        for k, cfg in enumerate(READINGS)
    ]


def make(setting: Setting, folder: Path) -> list[Claim]:
    """Draw, write the data, judge."""
    found = _errors(setting)
    found.to_parquet(folder / "errors.parquet", index=False)
    _draw_gains(folder / "fig10_literal.png", found)
    return [_judged(found)]


def claims(setting: Setting) -> list[Claim]:
    """Judge only."""
    return [_judged(_errors(setting))]


def _errors(setting: Setting) -> pd.DataFrame:
    """One row for each reading and trial, one column for each treatment."""

    def parts() -> Iterator[pd.DataFrame]:
        for task in tasks(setting):
            of = pd.DataFrame(task.load()["errors"], columns=list(TREATMENTS))
            cfg = task.cfg
            where = {"odometry": cfg.odometry_scale, "range_m": cfg.range_m, "n_outliers": cfg.n_outliers}
            yield of.assign(**where, trial=range(len(of)))

    return pd.concat(parts(), ignore_index=True)


def _judged(found: pd.DataFrame) -> Claim:
    """Judge every reading with outliers in which the claim could hold at all."""
    rows = [
        row
        for odometry in ODOMETRY_SCALES
        for range_m in RANGES_M
        for row in _reading(found[(found.odometry == odometry) & (found.range_m == range_m)])
    ]
    return judged(
        SENTENCE,
        quantity="ground-truth error (Eq. 12 + Eq. 13), reduction against equal information matrices",
        unit=" %",
        rule=_rules.at_least(CLAIMED, 0.0, " %"),
        found=rows,
    )


def _gain(of: pd.DataFrame, treatment: str) -> Estimate:
    """Reduction of the error by a treatment, per cent."""
    return reduction(of[treatment].to_numpy(float), of["nothing"].to_numpy(float))


def _reading(of: pd.DataFrame) -> list[Found]:
    """Eq. 11 with simulated AOA, and beside it with recorded AOA and without outliers."""
    most, none = COUNTS
    bad, clean = of[of.n_outliers == most], of[of.n_outliers == none]
    where = f"odometry {of.odometry.iloc[0]:g} of the noise, {of.range_m.iloc[0]:g} m"
    oracle, n = _gain(bad, "outliers_removed"), len(bad)
    head = Found(
        conditions=f"{where}, {most} outliers of 9",
        estimate=_gain(bad, "eq11"),
        n=n,
        role=HEADLINE,
        note=_note(bad, oracle),
        verdict="" if (oracle.value or 0.0) >= CLAIMED else _rules.NO_POWER,
    )
    real = [_recorded(bad, f"{where}, {called}", name) for name, called in _BESIDE.items()]
    control = Found(conditions=f"{where}, no outliers", estimate=_gain(clean, "eq11"), n=n, role=BESIDE)
    return [head, *real, control]


def _recorded(bad: pd.DataFrame, conditions: str, treatment: str) -> Found:
    """With the errors of real bearings, if they are there."""
    if bad[treatment].isna().any():
        return missing(conditions, ABSENT, BESIDE)
    return Found(conditions=conditions, estimate=_gain(bad, treatment), n=len(bad), role=BESIDE)


def _note(bad: pd.DataFrame, oracle: Estimate) -> str:
    """The most that can be had, what true covariances give, and what five trials show."""
    covariances = _gain(bad, "true_covariances").value or 0.0
    chance = chance_of_a_panel(bad[["nothing", "eq11"]].to_numpy(float), claimed=CLAIMED / 100.0)
    return (
        f"true outliers removed {oracle.value or 0.0:.0f} %, true covariances {covariances:.0f} %; "
        f"{CLAIMED:g} % or more in {100.0 * chance:.0f} of 100 panels of five trials"
    )


_PANELS = {
    ("eq11", COUNTS[0]): "Eq. 11, 3 outliers of 9",
    ("eq11", COUNTS[1]): "Eq. 11, no outliers",
    ("outliers_removed", COUNTS[0]): "true outliers removed",
    ("true_covariances", COUNTS[0]): "true covariances, no method",
}


def _draw_gains(path: Path, found: pd.DataFrame) -> None:
    """What each treatment takes off the error, by odometry and range."""
    with _draw.page(path, (10.4, 3.4)) as figure:
        panels = figure.subplots(1, len(_PANELS), sharey=True)
        for axes, ((treatment, n_outliers), title) in zip(panels, _PANELS.items(), strict=True):
            image = _draw_panel(axes, _mean_gains(found, treatment, n_outliers), title)
        panels[0].set_ylabel("odometry noise, of that of\na relative pose")
        figure.colorbar(image, ax=panels, label="reduction of error (%)")


def _draw_panel(axes: Axes, gains: np.ndarray, title: str) -> AxesImage:
    """One treatment; what reaches the claim is framed."""
    image = axes.imshow(gains, cmap="RdBu", vmin=-85.0, vmax=85.0, aspect="auto")
    for (y, x), value in np.ndenumerate(gains):
        colour = "white" if abs(value) > 55.0 else "black"
        weight = "bold" if value >= CLAIMED else "normal"
        axes.text(x, y, whole(value), ha="center", va="center", color=colour, weight=weight)
    axes.set_xticks(range(len(RANGES_M)), [f"{r:g}" for r in RANGES_M])
    axes.set_yticks(range(len(ODOMETRY_SCALES)), [f"{scale:g}" for scale in ODOMETRY_SCALES])
    axes.set_xlabel("range (m); bold: 32 % or more")
    axes.set_title(title, fontsize=9, loc="left")
    return image


def _mean_gains(found: pd.DataFrame, treatment: str, n_outliers: int) -> np.ndarray:
    """Reduction of the mean error by a treatment, per cent, odometry by range."""
    of = found[found.n_outliers == n_outliers]
    means = of.groupby(["odometry", "range_m"])[["nothing", treatment]].mean()
    kept = (means[treatment] / means["nothing"]).unstack("range_m")
    return np.asarray(100.0 * (1.0 - kept.to_numpy(float)))
