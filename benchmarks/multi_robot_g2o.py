"""Multi-robot pose graphs: the optimum of one computer, and what the robots reach by themselves.

Run: ``wifipgo bench multi_robot_g2o [--data DIR] [--json FILE]``. DIR holds one folder
a data set, with one g2o file a robot; if left out it is ``g2o`` in $WIFIPGO_DATA, or else in ../shared/data.
Where DIR also has a ``reference.json`` of format g2o-reference/1, its figures stand beside ours. Times are of
one core and include the building of the problem. "two stages" (``distributed_two_stage`` in the file) is the
method as published; "refined" (``distributed``) is ours: over-relaxed, with the second stage once more.
"""

import os

for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro
from rich.console import Console
from rich.progress import track
from rich.table import Table

from wifipgo.command.command_line import exit_code
from wifipgo.command.terminal import Terminal
from wifipgo.data import public_data
from wifipgo.errors import require
from wifipgo.files.atomic_files import write_json
from wifipgo.files.text_files import read_json
from wifipgo.graph.chordal import chordal_cost, chordal_optimum, links, matrices, pose_rows, two_stage
from wifipgo.graph.distributed import DistributedConfig, solve_distributed
from wifipgo.graph.files.g2o import read_g2o, symbols
from wifipgo.graph.posegraph import PoseGraph
from wifipgo.graph.residuals import chi_squares
from wifipgo.graph.solvers.spatial import solve_graph
from wifipgo.graph.subgraphs import anchors, components

DATA = public_data() / "g2o"
THRESHOLDS = (0.1, 0.01)
METHODS = {"distributed": 1, "distributed_two_stage": 0}  # name: refinements
SHORT = {"distributed": "refined", "distributed_two_stage": "two stages"}
ROUNDS = ("rounds_rotation", "rounds_pose", "rounds_refinement")


@dataclass(frozen=True, slots=True, kw_only=True)
class G2oConfig:
    """What to measure, and where to write."""

    data: Annotated[Path, tyro.conf.arg(help="Folder with one folder a data set.")] = DATA
    json: Annotated[Path | None, tyro.conf.arg(help="Also write the figures to this file.")] = None
    repeats: Annotated[int, tyro.conf.arg(help="Runs of each; the fastest is shown.")] = 3


def timed(call: Callable[[], Any], repeats: int) -> tuple[Any, float]:
    """Result of a call, and its fastest time, s."""
    times = []
    for _ in range(max(repeats, 1)):
        begin = time.perf_counter()
        result = call()
        times.append(time.perf_counter() - begin)
    return result, min(times)


def gtsam_error(graph: PoseGraph, rows: Any) -> float:
    """Half the chi-square, as gtsam counts."""
    return 0.5 * float(chi_squares(graph, rows).sum())


def central_figures(graph: PoseGraph, repeats: int) -> dict[str, Any]:
    """Optima of both costs."""
    start, edges = matrices(graph.poses), links(graph)
    stages, stages_s = timed(lambda: two_stage(graph, start), repeats)
    optimum, optimum_s = timed(lambda: chordal_optimum(graph, stages), repeats)
    (rows, report), lm_s = timed(lambda: solve_graph(graph), repeats)
    return {
        "robots": len(graph.robots),
        "poses": len(graph.poses),
        "edges": len(graph.tail),
        "inter_robot_edges": int(graph.between_robots.sum()),
        "components": int(components(graph).max()) + 1,
        "anchor_keys": symbols(graph)[anchors(graph)].tolist(),
        "cost_of_file_values": chordal_cost(start, edges),
        "gtsam_error_of_file_values": gtsam_error(graph, graph.poses),
        "chordal_optimum": chordal_cost(optimum, edges),
        "gtsam_error_of_chordal_optimum": gtsam_error(graph, pose_rows(optimum)),
        "chordal_cost_two_stage_centralised": chordal_cost(stages, edges),
        "gtsam_lm_error": 0.5 * report.chi2_after,
        "gtsam_lm_iterations": report.iterations,
        "chordal_cost_of_lm_solution": chordal_cost(matrices(rows), edges),
        "seconds": {"two_stage_centralised": stages_s, "chordal_optimum": optimum_s, "gtsam_lm": lm_s},
    }


def distributed_figures(
    graph: PoseGraph, threshold: float, refinements: int, optimum: float, repeats: int
) -> dict[str, Any]:
    """What the robots reach with one threshold."""
    relaxation = None if refinements else 1.0
    config = DistributedConfig(threshold=threshold, refinements=refinements, relaxation=relaxation)
    (rows, report), seconds = timed(lambda: solve_distributed(graph, config=config), repeats)
    return {
        "converged": report.converged,
        "order": list(report.order),
        **dict(zip(ROUNDS, report.rounds, strict=False)),
        "rounds": sum(report.rounds),
        "chordal_cost": report.cost_after,
        "gap_to_chordal_optimum": report.cost_after / optimum - 1.0,
        "gtsam_error": gtsam_error(graph, rows),
        "bytes_sent": report.bytes_sent,
        "messages": report.n_messages,
        "seconds": seconds,
    }


def figures(folder: Path, repeats: int) -> dict[str, Any]:
    """All figures of one data set."""
    (reading, read_s) = timed(lambda: read_g2o(folder), 1)
    out = central_figures(reading.graph, repeats)
    out["seconds"]["read"] = read_s
    for method, refinements in METHODS.items():
        out[method] = {
            str(threshold): distributed_figures(
                reading.graph, threshold, refinements, out["chordal_optimum"], repeats
            )
            for threshold in THRESHOLDS
        }
    return out


def data_sets(folder: Path) -> list[Path]:
    """Folders with g2o files, in the order of their sizes."""
    found = {path.parent for path in folder.glob("*/*.g2o")} or {p.parent for p in folder.glob("*.g2o")}
    return sorted(found, key=lambda path: (len(list(path.glob("*.g2o"))), path.name))


def beside(ours: float, reference: dict[str, Any] | None, name: str) -> str:
    """A figure, and how far it is from the reference."""
    if reference is None or name not in reference:
        return f"{ours:.6g}"
    return f"{ours:.6g} ({100.0 * (ours / reference[name] - 1.0):+.4f} %)"


def show(results: dict[str, Any], reference: dict[str, Any], console: Console) -> None:
    """Print both tables."""
    table = Table(title="one computer; in brackets the difference to the reference")
    for column in ("data set", "robots", "poses", "edges", "chordal optimum", "gtsam LM error", "LM ms"):
        left = column == "data set"
        table.add_column(column, justify="left" if left else "right", no_wrap=left)
    for name, r in results.items():
        known = reference.get(name)
        optimum = beside(r["chordal_optimum"], known, "chordal_optimum")
        lm = beside(r["gtsam_lm_error"], known, "gtsam_lm_error")
        counts = (str(r[key]) for key in ("robots", "poses", "edges"))
        table.add_row(name, *counts, optimum, lm, f"{1e3 * r['seconds']['gtsam_lm']:.1f}")
    console.print(table)
    console.print(distributed_table(results, reference))


def distributed_table(results: dict[str, Any], reference: dict[str, Any]) -> Table:
    """Distributed costs, rounds, bytes and times, the reference's below."""
    table = Table(title="robots by themselves", pad_edge=False)
    for column in ("data set", "method", "threshold", "rounds", "gap %", "kB", "s"):
        left = column in {"data set", "method"}
        table.add_column(column, justify="left" if left else "right", no_wrap=left)
    for name, r in results.items():
        for threshold in map(str, THRESHOLDS):
            rows = {method: r[method][threshold] for method in METHODS}
            known = reference.get(name, {}).get("distributed", {}).get(threshold)
            for method, row in (rows | ({"reference": known} if known else {})).items():
                rounds = "+".join(str(row[key]) for key in ROUNDS if key in row)
                gap = f"{100.0 * row['gap_to_chordal_optimum']:.2f}"
                seconds = f"{row['seconds']:.3f}" if "seconds" in row else ""
                kb = f"{row['bytes_sent'] / 1e3:.0f}"
                table.add_row(name, SHORT.get(method, method), threshold, rounds, gap, kb, seconds)
    return table


def main(config: G2oConfig) -> None:
    """Measure, show, write.

    Raises:
        BadInputError: There is nothing to measure, or a file is bad.
    """
    console = Terminal()
    folders = data_sets(config.data)
    require(bool(folders), "data", "a folder with folders of g2o files", str(config.data))
    path = config.data / "reference.json"
    reference = read_json(path).get("datasets", {}) if path.is_file() else {}
    results = {f.name: figures(f, config.repeats) for f in track(folders, "data sets", console=console)}
    if config.json is not None:
        write_json(config.json, {"format": "g2o-benchmark/1", "datasets": results}, allow_nan=True)
    show(results, reference, console)


if __name__ == "__main__":
    sys.exit(exit_code(lambda: main(tyro.cli(G2oConfig, description=__doc__))))
