"""Table and files of an optimisation; imported only by the command."""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from rich.table import Table

from wifipgo.command.terminal import Terminal
from wifipgo.files import results_folder
from wifipgo.files.atomic_files import appearing, write_json
from wifipgo.graph.files.g2o import Reading, write_g2o
from wifipgo.graph.files.jrl import JRL
from wifipgo.graph.files.jrl_writing import shared_solutions, write_jrl, write_jrr
from wifipgo.graph.files.tum_kitti import write_kitti, write_tum
from wifipgo.graph.posegraph import PoseGraph, keys_of
from wifipgo.graph.solvers.spatial import FULL_WEIGHT

KIND = "optimise"
REPORT, PICTURE = "report.json", "before_after.png"


class Results(NamedTuple):
    """A folder of results that appears whole or not at all; hold its lock meanwhile."""

    out: Path

    @classmethod
    def claim(cls, out: Path, *, overwrite: bool) -> "Results":
        """Refuse, before any work, a folder that holds something else, or results without leave.

        Raises:
            BadInputError: There is something that may not be replaced.
        """
        results_folder.check_free(out, KIND, overwrite=overwrite)
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
        """Write everything but the picture beside the folder, then give it the name."""
        partial = results_folder.partial_of(self.out)
        results_folder.remove(partial, KIND)
        results_folder.begin(partial, KIND)
        results_folder.note(partial, ["results/"])
        staging = partial / "results"
        staging.mkdir()
        try:
            _write(staging, reading, poses, weight, table, single=single)
            results_folder.publish(staging, self.out, KIND, later=[PICTURE])
        finally:
            results_folder.remove(partial, KIND)

    def draw(
        self, graph: PoseGraph, poses: Float[np.ndarray, "poses dims"], weight: Float[np.ndarray, " edges"]
    ) -> None:
        """Draw before and after; a picture that cannot be drawn is a warning, results stay."""
        from wifipgo.command.figures import drawing  # noqa: PLC0415 (matplotlib loads slowly)

        with drawing(self.out / PICTURE):
            from wifipgo.graph.files.optimise_picture import draw  # noqa: PLC0415

            with appearing(self.out / PICTURE, by_suffix=True) as unfinished:
                draw(unfinished, graph, poses, weight)


def _write(
    folder: Path,
    reading: Reading,
    poses: Float[np.ndarray, "poses dims"],
    weight: Float[np.ndarray, " edges"],
    table: Mapping[str, object],
    *,
    single: bool,
) -> None:
    """Write graph, trajectories and report."""
    graph = reading.graph
    write_g2o(
        folder / ("optimised.g2o" if single else "optimised"),
        graph.with_poses(poses),
        keys=reading.keys,
        fixed=reading.fixed,
        landmarks=reading.landmarks,
    )
    if reading.format == JRL:
        write_jrl(folder / "optimised.jrl", graph.with_poses(poses), name=reading.name, truth=reading.truth)
        solutions = shared_solutions(graph, poses)
        write_jrr(folder / "optimised.jrr", solutions, name=reading.name, method=str(table["backend"]))
    write_tum(folder / "tum", graph, poses)
    write_kitti(folder / "kitti", graph, poses)
    write_json(folder / REPORT, {**table, "weighed_down": downweighted(graph, weight)}, allow_nan=True)


def downweighted(graph: PoseGraph, weight: Float[np.ndarray, " edges"]) -> list[dict[str, object]]:
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
    Terminal().print(table)
