"""Table, files and picture of an optimisation; imported only by the command."""

import json
import os
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from rich.console import Console
from rich.table import Table

from wifipgo.errors import require
from wifipgo.graph.files import Reading, write_g2o
from wifipgo.graph.keyed import PoseGraph, keys_of
from wifipgo.graph.solvers.spatial import FULL_WEIGHT
from wifipgo.graph.trajectories import write_kitti, write_tum

# Okabe and Ito's palette, which colour-blind readers tell apart.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#E69F00", "#CC79A7", "#56B4E9")
REPORT = "report.json"


class Results(NamedTuple):
    """A folder of results that appears whole or not at all."""

    out: Path

    @classmethod
    def claim(cls, out: Path, *, overwrite: bool) -> "Results":
        """Refuse, before any work, a folder that holds something else, or results without leave.

        Raises:
            ValueError: There is something that may not be replaced.
        """
        require(not out.exists() or out.is_dir(), "out", "a folder", str(out))
        if out.is_dir() and any(out.iterdir()):
            require((out / REPORT).is_file(), "out", "new, empty or of an earlier run", str(out))
            require(overwrite, "out", "new or empty (--overwrite replaces what is there)", str(out))
        return cls(out)

    def publish(
        self,
        reading: Reading,
        poses: Float[np.ndarray, "poses dims"],
        weight: Float[np.ndarray, " edges"],
        table: Mapping[str, object],
        *,
        single: bool,
    ) -> None:
        """Write everything beside the folder, then give it the name."""
        partial = self.out.with_name(f"{self.out.name}.partial")
        shutil.rmtree(partial, ignore_errors=True)
        partial.mkdir(parents=True)
        graph = reading.graph
        solved = graph.with_poses(poses)
        write_g2o(
            partial / ("optimised.g2o" if single else "optimised"),
            solved,
            keys=reading.keys,
            fixed=reading.fixed,
            landmarks=reading.landmarks,
        )
        write_tum(partial / "tum", graph, poses)
        write_kitti(partial / "kitti", graph, poses)
        draw(partial / "before_after.png", graph, poses, weight)
        down = {"weighed_down": weighed_down(graph, weight)}
        (partial / REPORT).write_text(json.dumps({**table, **down}, indent=2) + "\n", encoding="utf-8")
        replaced = self.out.with_name(f"{self.out.name}.replaced")
        if self.out.exists():
            os.replace(self.out, replaced)
        os.replace(partial, self.out)
        shutil.rmtree(replaced, ignore_errors=True)


def weighed_down(graph: PoseGraph, weight: Float[np.ndarray, " edges"]) -> list[dict[str, object]]:
    """Measurements that a robust method trusted less, by (robot, index) of their ends."""
    keys = keys_of(graph)
    return [
        {
            "tail": keys[graph.tail[row]].tolist(),
            "head": keys[graph.head[row]].tolist(),
            "weight": weight[row],
        }
        for row in np.flatnonzero(weight < FULL_WEIGHT).tolist()
    ]


def print_table(figures: Mapping[str, object], *, title: str) -> None:
    """Print one line a figure."""
    table = Table(title=title, show_header=False)
    table.add_column(no_wrap=True)
    table.add_column(justify="right")
    for name, value in figures.items():
        if value != {}:
            text = (
                f"{value:.6g}"
                if isinstance(value, float)
                else f"{value:,}"
                if type(value) is int
                else str(value)
            )
            table.add_row(name, text)
    Console().print(table)


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
    figure.savefig(path)


def _panel(
    axes: Axes, graph: PoseGraph, p_m: Float[np.ndarray, "poses 2"], rejected: Bool[np.ndarray, " edges"]
) -> None:
    """One state of the graph."""
    lines, between = np.stack([p_m[graph.tail], p_m[graph.head]], axis=1), graph.between_robots
    place = np.searchsorted(graph.robots, graph.robot)
    colour = np.array(COLOURS)[place % len(COLOURS)]
    own = np.where(rejected, "#D00000", np.where(between, "0.7", colour[graph.tail]))
    axes.add_collection(LineCollection(list(lines), colors=own.tolist(), linewidths=0.7, zorder=1))
    axes.scatter(p_m[:, 0], p_m[:, 1], s=6.0, c=colour.tolist(), zorder=2)
    halo = [withStroke(linewidth=2.5, foreground="white")]
    for robot in graph.robots.tolist():
        x_m, y_m = p_m[graph.robot == robot].mean(axis=0)
        axes.text(x_m, y_m, str(robot), ha="center", va="center", weight="bold", path_effects=halo, zorder=3)
    axes.autoscale()
