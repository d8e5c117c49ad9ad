"""Picture of where the robots drove, and where they believe they did, in the median trial."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from wifipgo.command.figures import Axes, Figure

import matplotlib as mpl
import numpy as np
from jaxtyping import Float
from matplotlib.collections import LineCollection
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon

from baselines.evaluation.episodes import Episode
from baselines.evaluation.labels import names_of, wrapped
from baselines.evaluation.median_trial import MedianTrial
from baselines.evaluation.plan import Plan
from baselines.evaluation.plots import STYLE
from wifipgo.command.palette import ROBOTS, YELLOW

DASHED = (0, (3, 1.5))
_MANY = 8  # robots from which lines are thin and starts and ends small
_MARGIN = 0.05
_LEAST_RATIO = 0.5  # of the short side of a panel to the long one
_PANEL_IN, _TITLE_IN, _AROUND_IN = 4.7, 0.75, 1.6


def draw_arena(path: Path, plan: Plan, episodes: Mapping[str, Episode], median: MedianTrial) -> None:
    """Draw a panel for each policy: true and estimated trajectories, obstacles, meetings."""
    n, limits = len(plan.policies), window(list(episodes.values()))
    columns = min(n, 3 if n <= 6 else 5)
    rows = -(-n // columns)
    width_in, height_in = _panel_in(limits, columns)
    size_in = (max(width_in * columns, 8.0) + 0.5, (height_in + _TITLE_IN) * rows + _AROUND_IN)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=size_in, dpi=120, layout=ConstrainedLayoutEngine(w_pad=0.08, h_pad=0.1))
        grid = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
        names = names_of(plan.policies, round(10.5 * width_in))
        for panel, policy, name in zip(grid.flat, plan.policies, names, strict=False):
            _room(panel, episodes[policy])
            _trajectories(panel, episodes[policy])
            _label(panel, episodes[policy], name, f"{median.ranks[policy]} of {median.n_trials}")
            panel.set(xlim=limits[0], ylim=limits[1])
        _outer_labels(grid, n)
        figure.suptitle(_title(plan, episodes, median, letters=round(9.0 * size_in[0])))
        figure.legend(handles=_key(plan.scenario.n_robots), loc="outside lower center", ncols=4)
        figure.savefig(path)


def window(episodes: Sequence[Episode]) -> Float[np.ndarray, "axes 2"]:
    """Limits of x and y (m) that hold all that happened, not the whole room where most of it stayed empty."""
    seen = [a.reshape(-1, 3)[:, :2] for e in episodes for a in (e.reference, e.estimate)]
    points = np.concatenate(seen)
    low, high = points.min(axis=0), points.max(axis=0)
    side = high - low
    side = np.maximum(side, max(_LEAST_RATIO * float(side.max()), 1.0)) * (1.0 + 2.0 * _MARGIN)
    middle = 0.5 * (low + high)
    return np.stack([middle - 0.5 * side, middle + 0.5 * side], axis=1)


def _panel_in(limits: Float[np.ndarray, "axes 2"], columns: int) -> tuple[float, float]:
    """Width and height of a panel in which both axes have one scale, in."""
    side_m = limits[:, 1] - limits[:, 0]
    width_in, height_in = (side_m * (_PANEL_IN if columns <= 3 else 3.4) / side_m.max()).tolist()
    return max(width_in, 2.6) + 0.3, height_in


def _room(axes: Axes, episode: Episode) -> None:
    """Walls and obstacles."""
    axes.add_collection(LineCollection(list(episode.walls_m), colors="0.2", linewidths=2.5))
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


def _label(axes: Axes, episode: Episode, name: str, rank: str) -> None:
    figures = episode.figures
    end = f"{len(episode.meetings)} rendezvous, final ATE {figures['ate_trans']:.3g} m²"
    axes.set_title(f"{name}\nscore {figures['mapped_share']:.2f} (rank {rank})\n{end}", fontsize=10)
    axes.set_aspect("equal")
    axes.locator_params(integer=True, nbins=6)


def _outer_labels(grid: Any, n: int) -> None:
    """Units on the outer axes; empty places of the grid stay empty."""
    rows, columns = grid.shape
    for place, axes in enumerate(grid.flat):
        row, column = divmod(place, columns)
        axes.set_visible(place < n)
        if column == 0:
            axes.set_ylabel("y (m)")
        if place + columns >= n and row < rows:
            axes.set_xlabel("x (m)")
            axes.tick_params(labelbottom=True)


def _title(plan: Plan, episodes: Mapping[str, Episode], median: MedianTrial, *, letters: int) -> str:
    one = episodes[plan.policies[0]]
    which = f"trial {one.trial} (seed {one.seed})"
    if median.n_trials > 1:
        whose = "the median score" + " of every policy" * (len(plan.policies) > 1)
        which += f": of {median.n_trials} trials the nearest to {whose}"
    played = f"{plan.title}: {plan.scenario.n_robots} robots, {plan.scenario.n_steps} iterations"
    return f"{wrapped(played, letters, most_lines=2)}\n{wrapped(which, letters)}"


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
