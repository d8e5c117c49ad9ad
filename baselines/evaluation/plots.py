"""Two pictures of an evaluation: the error over time, and where the robots drove."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from wifipgo.command.figures import Axes, Figure

import matplotlib as mpl
import numpy as np
import pandas as pd
from jaxtyping import Bool, Float, Int
from matplotlib.collections import LineCollection
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon

from baselines.evaluation.episodes import Episode
from baselines.evaluation.plan import Plan
from baselines.evaluation.run_folder import Tables
from baselines.evaluation.statistics import bootstrap
from wifipgo.command.palette import ROBOTS, SERIES, YELLOW
from wifipgo.errors import require

DASHES = ("-", (0, (5, 1.5)), (0, (1.5, 1)), "-.")
STYLE: dict[Any, Any] = {
    "font.size": 10,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "legend.frameon": False,
}
DASHED = (0, (3, 1.5))
_MANY = 8  # robots from which lines are thin and starts and ends small


def draw_err(path: Path, plan: Plan, tables: Tables) -> None:
    """Mean Err over iterations with its band, and below it every rendezvous."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(8.0, 5.6), dpi=150, layout="constrained")
        low = 0.5 + 0.45 * len(plan.policies)
        above, below = figure.subplots(2, 1, sharex=True, height_ratios=[4.6 - 0.2 * low, low])
        for place, policy in enumerate(plan.policies):
            steps = _by_trial(tables.steps[tables.steps["policy"] == policy])
            _curve(above, steps, policy, _colour(place), DASHES[place % len(DASHES)])
            met = tables.episodes.loc[tables.episodes["policy"] == policy, "rendezvous"].mean()
            _raster(below, steps, len(plan.policies) - 1 - place, _colour(place), per_trial=met)
        threshold = plan.scenario.rendezvous.err_threshold
        above.axhline(threshold, color="0.2", lw=0.8, label=f"threshold {threshold:g}")
        _label_err(above, below, plan)
        figure.savefig(path)


def _colour(place: int) -> str:
    return SERIES[place % len(SERIES)]


class _Trials(NamedTuple):
    """A policy's trials, one row each; iterations after the end of an episode do not count."""

    err: Float[np.ndarray, "trials iterations"]
    met: Bool[np.ndarray, "trials iterations"]
    length: Int[np.ndarray, " trials"]


def _by_trial(steps: pd.DataFrame) -> _Trials:
    """Mean Err over robots, and whether anybody met, in the order of the table."""
    trial, row = np.unique(steps["trial"].to_numpy(), return_inverse=True)
    column, n_robots = steps["iteration"].to_numpy() - 1, int(steps["robot"].max()) + 1
    err, met = (np.zeros((len(trial), column.max() + 1, n_robots)) for _ in range(2))
    at = row, column, steps["robot"].to_numpy()
    err[at], met[at] = steps["err"], steps["met"]
    length = np.bincount(row) // n_robots
    return _Trials(err.mean(axis=2), np.asarray(met.any(axis=2)), length)


def _curve(axes: Axes, steps: _Trials, policy: str, colour: str, dashes: object) -> None:
    """Mean over robots and trials, and the interval of the mean over trials.

    Where episodes end early, the curve ends with half of them: the mean of the few that
    are left would be that of the unlucky.
    """
    lengths = np.sort(steps.length).tolist()
    end = lengths[len(lengths) // 2]
    bands = [band(steps.err[steps.length > k, k]) for k in range(end)]
    mean, low, high = np.array(bands).T
    label = policy + (", until half ended" if end < lengths[-1] else "")
    axes.fill_between(np.arange(1, end + 1), low, high, color=colour, alpha=0.2, lw=0)
    axes.plot(np.arange(1, end + 1), mean, color=colour, lw=2.0, ls=dashes, label=label)


def band(values: Float[np.ndarray, " trials"]) -> tuple[float, float, float]:
    """Mean and its interval; of one trial, the value."""
    found = bootstrap((values,), np.mean, method="percentile", n_resamples=1_000)
    mean = float(values.mean())
    return mean, mean if found.low is None else found.low, mean if found.high is None else found.high


def _raster(axes: Axes, steps: _Trials, lane: int, colour: str, *, per_trial: float) -> None:
    """A tick for each iteration with a rendezvous, a row for each trial, a lane for each policy."""
    height = 0.8 / len(steps.met)
    length = max(0.9 * height, 0.13)  # ticks of many trials overlap rather than vanish
    trial, iteration = np.nonzero(steps.met)
    row = lane + 0.4 - height * (trial + 0.5)
    ends = np.stack([row - 0.5 * length, row + 0.5 * length], axis=1)
    ticks = np.stack([np.repeat(iteration[:, None] + 1.0, 2, axis=1), ends], axis=2)
    axes.add_collection(LineCollection(list(ticks), linewidths=1.5, colors=colour, alpha=0.7))
    axes.axhspan(lane - 0.44, lane + 0.44, color=colour, alpha=0.07, lw=0)
    axes.text(1.01, lane, f"{per_trial:.3g}\na trial", transform=axes.get_yaxis_transform(), va="center")


def _label_err(above: Axes, below: Axes, plan: Plan) -> None:
    """Everything that makes the picture readable without its text."""
    sc = plan.scenario
    above.set_title(
        f"{plan.title}: {sc.n_robots} robots, {plan.trials_in_words}, seed {plan.seed}", loc="left"
    )
    above.set_ylabel("Err, mean over robots and trials\n(Eq. 4, unitless)")
    above.set_ylim(bottom=0.0)
    handles, labels = above.get_legend_handles_labels()
    if plan.trials > 1:
        handles.append(Patch(color="0.6", alpha=0.4, lw=0))
        labels.append("95 % bootstrap of the mean")
    above.legend(handles, labels, loc="upper left")
    below.set_ylabel("rendezvous,\na row a trial")
    below.set_yticks(range(len(plan.policies)), [name.replace(":", ":\n") for name in plan.policies[::-1]])
    below.set_ylim(-0.5, len(plan.policies) - 0.5)
    below.set_xlim(0, sc.n_steps + 1)
    below.set_xlabel("iteration")


def draw_arena(path: Path, plan: Plan, episodes: Sequence[Episode]) -> None:
    """The first trial of every policy: true and estimated trajectories, obstacles, meetings.

    Raises:
        BadInputError: There are no such episodes.
    """
    require(len(episodes) > 0, "first trial", "kept beside the tables, as this version does", "nothing")
    first = {episode.policy: episode for episode in episodes}
    columns = min(3, len(plan.policies))
    rows = -(-len(plan.policies) // columns)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(max(5.2 * columns, 8.0), 5.6 * rows + 1.1), dpi=130, layout=_spacious())
        grid = figure.subplots(rows, columns, squeeze=False)
        panels, limits = grid.ravel().tolist(), _limits(list(first.values()))
        for panel, policy in zip(panels, plan.policies, strict=False):
            _room(panel, first[policy])
            _trajectories(panel, first[policy])
            _label_room(panel, first[policy])
            panel.set(xlim=limits, ylim=limits)
        for panel in grid[:, 0]:
            panel.set_ylabel("y (m)")
        for panel in panels[len(plan.policies) :]:
            panel.set_visible(False)
        one = first[plan.policies[0]]
        title = f"{plan.title}: {plan.scenario.n_robots} robots, trial {one.trial} (seed {one.seed})"
        figure.suptitle(title)
        figure.legend(handles=_key(plan.scenario.n_robots), loc="outside lower center", ncols=4)
        figure.savefig(path)


def _limits(episodes: Sequence[Episode]) -> tuple[float, float]:
    """Limits of both axes that hold the room and every trajectory, m."""
    seen = [a.reshape(-1, 3)[:, :2] for e in episodes for a in (e.reference, e.estimate)]
    corners = [episode.walls_m.reshape(-1, 2) for episode in episodes]
    low, high = (f(np.concatenate(seen + corners)) for f in (np.min, np.max))
    return float(low - 0.04 * (high - low)), float(high + 0.04 * (high - low))


def _spacious() -> ConstrainedLayoutEngine:
    return ConstrainedLayoutEngine(w_pad=0.1, h_pad=0.12, compress=True)


def _room(axes: Axes, episode: Episode) -> None:
    """Walls and obstacles."""
    axes.add_collection(LineCollection(list(episode.walls_m), colors="0.2", linewidths=2.0))
    for corners in episode.obstacles_m:
        axes.add_patch(Polygon(corners, closed=True, facecolor="0.8", edgecolor="0.4", lw=0.8))


def _trajectories(axes: Axes, episode: Episode) -> None:
    """Each robot in its colour: solid as it was, dashed as it is believed to have been."""
    many = len(episode.reference) > _MANY
    thin, size = (0.7, 3.0) if many else (1.6, 7.0)
    for robot, (true, believed) in enumerate(zip(episode.reference, episode.estimate, strict=True)):
        colour = ROBOTS[robot % len(ROBOTS)]
        axes.plot(true[:, 0], true[:, 1], color=colour, lw=thin, zorder=2)
        axes.plot(believed[:, 0], believed[:, 1], color=colour, lw=thin, ls=DASHED, alpha=0.85, zorder=3)
        axes.plot(*true[0, :2], "o", color=colour, ms=size, mec="white", mew=0.5, zorder=4)
        axes.plot(*true[-1, :2], "s", color=colour, ms=size, mec="white", mew=0.5, zorder=4)
        axes.plot(*believed[-1, :2], "s", color="white", ms=size, mec=colour, mew=0.2 * size, zorder=4)
    axes.scatter(episode.meetings[:, 1], episode.meetings[:, 2], **_star(many), zorder=5)


def _star(many: bool) -> dict[str, Any]:
    return {"marker": "*", "s": 45 if many else 190, "c": YELLOW, "edgecolors": "black", "linewidths": 0.7}


def _label_room(axes: Axes, episode: Episode) -> None:
    figures = episode.figures
    ate = f"{figures['ate_trans']:.3g} m², rotation {figures['ate_rot']:.2g}"
    axes.set_title(f"{episode.policy}: {len(episode.meetings)} rendezvous\nfinal ATE {ate}")
    axes.set_aspect("equal")
    axes.set_xlabel("x (m)")
    axes.locator_params(integer=True, nbins=6)


def _key(n_robots: int) -> list[Line2D]:
    """What lines and marks mean; a colour is a robot, and comes again where there are many."""
    colours = ROBOTS[:n_robots] if n_robots <= len(ROBOTS) else ()
    robots = [Line2D([], [], color=colour, lw=4, label=f"robot {k}") for k, colour in enumerate(colours)]
    robots = robots or [Line2D([], [], ls="", label="a colour for each robot, repeated")]
    marks = [
        Line2D([], [], color="0.3", lw=1.6, label="true"),
        Line2D([], [], color="0.3", lw=1.6, ls=DASHED, label="as estimated at the end"),
        Line2D([], [], color="0.3", marker="o", ls="", label="start"),
        Line2D([], [], color="0.3", marker="s", ls="", label="end"),
        Line2D([], [], mec="0.3", mfc="white", marker="s", ls="", label="end as estimated"),
        Line2D([], [], marker="*", ls="", ms=12, mfc=YELLOW, mec="black", label="rendezvous"),
    ]
    return [*marks, *robots]
