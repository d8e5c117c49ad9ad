"""Picture of an optimisation: the graph from above before and after."""

from pathlib import Path

from wifipgo.command.figures import Axes, Figure

import numpy as np
from jaxtyping import Bool, Float
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke

from wifipgo.command.palette import REJECTED, ROBOTS
from wifipgo.graph.posegraph import PoseGraph


def draw(
    path: Path, graph: PoseGraph, poses: Float[np.ndarray, "poses dims"], weight: Float[np.ndarray, " edges"]
) -> None:
    """Draw the graph from above before and after.

    Each robot has its number and a colour, measurements between robots are grey, those that
    were weighed below a half red.
    """
    figure = Figure(figsize=(11.0, 5.6), dpi=150, layout="constrained")
    panels = figure.subplots(1, 2, sharex=True, sharey=True)
    for axes, rows, name in zip(panels, (graph.poses, poses), ("before", "after"), strict=True):
        _panel(axes, graph, rows[:, :2], weight < 0.5)
        axes.set(title=name, xlabel="x (m)", aspect="equal")
        axes.spines[["top", "right"]].set_visible(False)
    panels[0].set_ylabel("y (m)")
    figure.legend(handles=_key(graph, weight < 0.5), loc="outside lower center", ncols=3, frameon=False)
    figure.savefig(path)


def _key(graph: PoseGraph, rejected: Bool[np.ndarray, " edges"]) -> list[Line2D]:
    """What is there."""
    own = "poses and own measurements of a robot: a colour and its number"
    marks = [Line2D([], [], color=ROBOTS[0], marker="o", ms=4, lw=0.9, label=own)]
    if graph.between_robots.any():
        marks.append(Line2D([], [], color="0.7", lw=0.9, label="between robots"))
    if rejected.any():
        marks.append(Line2D([], [], color=REJECTED, lw=0.9, label="weighed below a half"))
    return marks


def _panel(
    axes: Axes, graph: PoseGraph, p_m: Float[np.ndarray, "poses 2"], rejected: Bool[np.ndarray, " edges"]
) -> None:
    """One state of the graph."""
    lines, between = np.stack([p_m[graph.tail], p_m[graph.head]], axis=1), graph.between_robots
    place = np.searchsorted(graph.robots, graph.robot)
    colour = np.array(ROBOTS)[place % len(ROBOTS)]
    own = np.where(rejected, REJECTED, np.where(between, "0.7", colour[graph.tail]))
    axes.add_collection(LineCollection(list(lines), colors=own.tolist(), linewidths=0.7, zorder=1))
    axes.scatter(p_m[:, 0], p_m[:, 1], s=6.0, c=colour.tolist(), zorder=2)
    halo = [withStroke(linewidth=2.5, foreground="white")]
    for robot in graph.robots.tolist():
        x_m, y_m = p_m[graph.robot == robot].mean(axis=0)
        axes.text(x_m, y_m, str(robot), ha="center", va="center", weight="bold", path_effects=halo, zorder=3)
    axes.autoscale()
