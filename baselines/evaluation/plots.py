"""What the pictures of an evaluation share: how a policy looks, its trials in rows, labels that fit."""

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

from wifipgo.command.figures import Axes, Figure

import numpy as np
import pandas as pd
from jaxtyping import Bool, Float, Int
from matplotlib.lines import Line2D
from matplotlib.transforms import ScaledTranslation, blended_transform_factory
from PIL import Image
from scipy import stats

from baselines.evaluation.labels import names_of, wrapped
from baselines.evaluation.plan import Plan
from baselines.evaluation.statistics import CONFIDENCE
from wifipgo.command.palette import SERIES

DASHES: tuple[Any, ...] = ("-", (0, (5, 1.5)), (0, (1.5, 1)), "-.")
STYLE: dict[Any, Any] = {
    "font.size": 10,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
}
_SAMPLE_IN = (-0.78, -0.12)  # where the sample of a policy's line begins and ends, from the axes


def colour_of(place: int) -> str:
    """Colour of a policy by its place in the plan."""
    return SERIES[place % len(SERIES)]


def dashes_of(place: int) -> Any:
    """Dashes of a policy: with its colour, no other of the first 24 looks so."""
    return DASHES[(place + place // 12) % len(DASHES)]


class Trials(NamedTuple):
    """A policy's trials, one row each; iterations after the end of an episode stay as it ended.

    Attributes:
        err: Mean over robots.
        score: Mapped share of the team.
        met: Whether anybody met; nobody does after the end.
        length: Iterations played.
    """

    err: Float[np.ndarray, "trials iterations"]
    score: Float[np.ndarray, "trials iterations"]
    met: Bool[np.ndarray, "trials iterations"]
    length: Int[np.ndarray, " trials"]


def by_trial(steps: pd.DataFrame, policy: str) -> Trials:
    """Trials of one policy, in the order of their numbers."""
    rows = steps[steps["policy"] == policy]
    trial, row = np.unique(rows["trial"].to_numpy(), return_inverse=True)
    column, robot = rows["iteration"].to_numpy() - 1, rows["robot"].to_numpy()
    shape = len(trial), column.max() + 1, robot.max() + 1
    length = np.bincount(row) // shape[2]
    until_end = np.minimum(np.arange(shape[1]), length[:, None] - 1)

    def filled(name: str) -> np.ndarray:
        values = np.zeros(shape)
        values[row, column, robot] = rows[name]
        return np.take_along_axis(values.mean(axis=2), until_end, axis=1)

    met = np.zeros(shape, dtype=bool)
    met[row, column, robot] = rows["met"]
    return Trials(filled("err"), filled("mapped_share"), np.asarray(met.any(axis=2)), length)


def bands(values: Float[np.ndarray, "trials iterations"]) -> Float[np.ndarray, "3 iterations"]:
    """Mean over trials and the ends of its 95 % interval (t); of one trial, its values."""
    n, mean = len(values), values.mean(axis=0)
    if n < 2:
        return np.stack([mean] * 3)
    half = stats.t.ppf(0.5 + 0.5 * CONFIDENCE, n - 1) * values.std(axis=0, ddof=1) / np.sqrt(n)
    return np.stack([mean, mean - half, mean + half])


def curve(axes: Axes, values: Float[np.ndarray, "trials iterations"], place: int, n_policies: int) -> None:
    """Mean over trials, and the interval of that mean, in the looks of a policy."""
    iteration = np.arange(1, values.shape[1] + 1)
    mean, low, high = bands(values)
    crowded = n_policies > len(SERIES)
    axes.fill_between(
        iteration, low, high, color=colour_of(place), alpha=0.07 if crowded else 0.2, lw=0, zorder=1
    )
    axes.plot(iteration, mean, color=colour_of(place), ls=dashes_of(place), lw=1.3 if crowded else 2.0)


def name_rows(axes: Axes, policies: Sequence[str], places: Sequence[int]) -> None:
    """Write the policies beside their rows, the first at the top, each with a sample of its line."""
    rows = range(len(policies))[::-1]
    axes.set_yticks(rows, names_of(policies))
    axes.tick_params(axis="y", length=0, pad=72.0 * (0.08 - _SAMPLE_IN[0]), labelsize=9)
    figure: Any = axes.figure
    corner: Any = axes.transAxes
    beside = figure.dpi_scale_trans + ScaledTranslation(0.0, 0.0, corner)
    for row, place in zip(rows, places, strict=True):
        sample = Line2D(_SAMPLE_IN, (row, row), color=colour_of(place), ls=dashes_of(place), lw=2.0)
        sample.set(transform=blended_transform_factory(beside, axes.transData), clip_on=False)
        axes.add_line(sample)
    axes.set_ylim(-0.6, len(policies) - 0.4)


def row_heights_in(policies: Sequence[str]) -> float:
    """Height that the rows of all policies need, in."""
    lines = max(name.count("\n") + 1 for name in names_of(policies))
    return max(0.32, 0.15 * lines + 0.06) * len(policies)


def save_small(figure: Figure, path: Path) -> None:
    """Write a picture in as many colours as a page of the documentation needs."""
    figure.savefig(buffer := BytesIO(), format="png")
    picture = Image.open(buffer).convert("RGB").quantize(256)
    picture.save(path, format="PNG", optimize=True)


def title_of(plan: Plan, width: int) -> str:
    """What was played, how often, from which seed."""
    played = f"{plan.title}: {plan.scenario.n_robots} robots, {plan.trials_in_words}, seed {plan.seed}"
    return wrapped(played, width)
