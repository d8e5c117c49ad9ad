"""Optimise a pose graph of several robots from its files, on the command line.

::

    wifipgo optimise DIR_OR_FILE [--backend distributed] [--robust gnc] [--out DIR]
"""

import sys
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Annotated, Literal, TypeVar

import numpy as np
import tyro
from jaxtyping import Float, Int

from wifipgo.command.command_line import exit_code, printable, say
from wifipgo.command.docstrings import documented
from wifipgo.command.processes import in_a_process
from wifipgo.data import GRAPH, example_or_path
from wifipgo.errors import DoubtfulError, pick, require
from wifipgo.files.folder_lock import held
from wifipgo.graph.bearings import Bearings
from wifipgo.graph.distributed import (
    Channel,
    DistributedConfig,
    DistributedReport,
    TwoLevelConfig,
    solve_two_level,
)
from wifipgo.graph.distributed.agreement import disagreement
from wifipgo.graph.distributed.robust import solve_reweighted
from wifipgo.graph.files.bearings_csv import read_bearings
from wifipgo.graph.files.graph_files import cut, read_graph
from wifipgo.graph.optimise_accuracy import against_truth, incremental, truth_of
from wifipgo.graph.optimise_figures import Gated, Outcome, check_heard, contradiction, figures, seconds_each
from wifipgo.graph.outliers.graph_directions import graph_direction_weights
from wifipgo.graph.outliers.methods import OUTLIER_METHODS, OutlierMethod
from wifipgo.graph.outliers.pcm import consistent_sets
from wifipgo.graph.posegraph import PoseGraph
from wifipgo.graph.residuals import chi_squares
from wifipgo.graph.solvers.spatial import solve_graph

T = TypeVar("T")
Backend = Literal["gtsam", "distributed", "two_level"]
Robust = Literal[
    "none",
    "huber",
    "gnc",
    "paper",
    "paper+huber",
    "paper+gnc",
    "range_aware",
    "range_aware+huber",
    "range_aware+gnc",
    "pcm",
    "pcm+huber",
    "pcm+gnc",
]
Initial = Literal["best", "given", "chordal", "odometry", "frames"]
ITERATIONS = 100  # of gtsam's search at most
FEW_EDGES = 300  # a search of so many is over before somebody could stop it


def optimise(
    graph: PoseGraph,
    *,
    fixed: Int[np.ndarray, " fixed"] | None = None,
    backend: Backend = "gtsam",
    robust: Robust = "none",
    threshold: float = 0.01,
    initial: Initial = "best",
    max_iterations: int = ITERATIONS,
    bearings: Bearings | None = None,
) -> Outcome:
    """Optimise a graph.

    Args:
        graph: Poses and measurements.
        fixed: Rows of poses that are known; the first of each part without any stays besides.
        backend: One computer by gtsam, or the robots by themselves.
        robust: What guards against outliers.
        threshold: At which movement the robots stop in two stages, see `DistributedConfig`.
        initial: Where gtsam's search starts, see `wifipgo.graph.solve_graph`; robots start chordal.
        max_iterations: Of gtsam's search.
        bearings: Directions between poses of the graph, for a gate on direction.

    Raises:
        ValueError: Coordinates or information are so large that their products are no numbers; a method
            needs directions, or has none to do with.
        NumericalError: No step can be found; says at which pose.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        error = float(chi_squares(graph, graph.poses).sum())
    require(bool(np.isfinite(error)), "error of the graph as given", "finite", error)
    begin = time.perf_counter()
    method = pick(OUTLIER_METHODS, robust, "robust")
    gated = _gated(graph, method, bearings, robust)
    guarded = graph.with_weight(graph.weight * gated.weight)
    if backend == "gtsam":
        poses, report = solve_graph(
            guarded, fixed=fixed, initial=initial, robust=method.loss, max_iterations=max_iterations
        )
        poses, weight = _put_back(poses, graph, fixed), gated.weight * report.weights(len(gated.weight))
        seconds = time.perf_counter() - begin
        steps = (report.iterations,)
        return Outcome(poses, weight, steps, report.converged, 0, seconds, report.doubt, gated)
    config = TwoLevelConfig() if backend == "two_level" else DistributedConfig(threshold=threshold)
    poses, told, left = _by_robots(guarded, fixed, method.loss, config)
    doubt = "" if told.converged else "the robots' rounds or steps were used up before they settled"
    settled = (told.rounds, told.converged, told.bytes_sent, time.perf_counter() - begin, doubt)
    sve = disagreement(told.held) if told.held else None
    return Outcome(poses, gated.weight * left, *settled, gated, sve, told.seconds)


def _gated(graph: PoseGraph, method: OutlierMethod, bearings: Bearings | None, name: str) -> Gated:
    """What the gate of a method leaves of the measurements."""
    gate = method.gate
    needs = "given (--bearings FILE) for a gate on direction, and for no other"
    require((gate.by_direction is None) == (bearings is None), "bearings", needs, name)
    if bearings is not None:
        weight, heard = graph_direction_weights(graph, bearings, gate)
        return Gated(weight, heard=heard)
    if gate.by_agreement is not None:
        sets = consistent_sets(graph)
        return Gated(sets.keep.astype(np.float64), sets.unproven)
    return Gated(np.ones(len(graph.tail)))


def _by_robots(
    graph: PoseGraph,
    fixed: Int[np.ndarray, " fixed"] | None,
    loss: str,
    config: DistributedConfig | TwoLevelConfig,
) -> tuple[Float[np.ndarray, "poses dims"], DistributedReport, Float[np.ndarray, " edges"]]:
    """Solve without a computer that knows everything; poses, report, and what the loss left."""
    if isinstance(config, TwoLevelConfig):
        return solve_two_level(graph, fixed=fixed, loss=loss, config=config)
    return solve_reweighted(graph, loss=loss, fixed=fixed, config=config, channel=Channel())


def _put_back(
    poses: Float[np.ndarray, "poses dims"], graph: PoseGraph, fixed: Int[np.ndarray, " fixed"] | None
) -> Float[np.ndarray, "poses dims"]:
    """Known poses to the bit: a search holds them by a stiff spring."""
    poses = poses.copy()
    if fixed is not None:
        poses[fixed] = graph.poses[fixed]
    return poses


def run(
    path: Annotated[tyro.conf.Positional[Path], tyro.conf.arg(metavar="DIR_OR_FILE")],
    *,
    backend: Backend = "gtsam",
    robust: Robust = "none",
    out: Path = Path("results/optimise"),
    threshold: float = 0.01,
    initial: Initial = "best",
    max_iterations: int = ITERATIONS,
    robots: int | None = None,
    bearings: Path | None = None,
    reference: Path | None = None,
    steps: int = 0,
    lenient: bool = False,
    overwrite: bool = False,
) -> None:
    """Optimise a multi-robot pose graph from g2o, JRL or dpgo's CSV files, in the plane or in space.

    Prints a table and writes the optimised g2o (and JRL, where it was read), TUM and KITTI files of all
    robots, a report.json with the table and the measurements that were weighed down, and a picture of
    before and after. The folder appears whole or not at all, the picture after it. Exit code 1 if the search
    did not converge, 2 if the graph cannot be read or the folder not be written, 3 if the search broke down.

    Example: wifipgo optimise example --robust gnc

    Example: wifipgo optimise graphs/team --robust gnc --out results/team

    Example: wifipgo optimise graph.g2o --backend distributed --overwrite

    Example: wifipgo optimise team.jrl --robust gnc --out results/team

    Example: wifipgo optimise INTEL.g2o --robots 5 --backend distributed

    Args:
        path: A file .g2o, .jrl, .cbor (JRL) or .csv (dpgo), or a folder with one file a robot: 0.g2o, 1.g2o,
            ... or .csv; "example" for a simulated team that ships with the package.
        backend: One computer by gtsam, or the robots by themselves: in two stages (chordal cost), or on two
            levels (the cost of gtsam).
        robust: What guards against outliers, for all measurements but odometry: a gate on directions (paper,
            range_aware) or on agreement (pcm), a loss, or one of each.
        out: Folder for the results.
        threshold: Movement at which the robots stop, m and rad together.
        initial: Where gtsam's search starts: the file's poses, chordal ones, along the odometry, with
            robots' frames aligned by the loops that agree most, or the best.
        max_iterations: Of gtsam's search.
        robots: Cut the trajectory of a lone robot into those of so many, each as long.
        bearings: Directions in which robots heard each other, for a gate on direction: a CSV file with the
            columns observer, observer_pose, target, target_pose, azimuth_deg; a line more is a lower peak.
        reference: True trajectories, see wifipgo ate: the report then has ATE and RPE. JRL brings its own.
        steps: Report iATE too, the mean ATE at so many steps of the robots' way, each optimised.
        lenient: Skip lines, fields and measurements of unknown kinds, and list them.
        overwrite: Replace results that are in the folder.
    """
    from wifipgo.graph.files.optimise_report import Results, print_table  # noqa: PLC0415

    require(0.0 < threshold < np.inf, "threshold", "positive and finite", threshold)
    path = example_or_path(path, GRAPH)
    with held(out):
        results = Results.claim(out, overwrite=overwrite)
        reading = read_graph(path, lenient=lenient)
        reading = reading if robots is None else cut(reading, robots)
        truth = truth_of(reading, reference, steps)
        heard = None if bearings is None else read_bearings(bearings, reading.graph)
        job = partial(optimise, backend=backend, robust=robust, threshold=threshold)
        job = partial(job, initial=initial, max_iterations=max_iterations, bearings=heard)
        long = backend == "gtsam" and len(reading.graph.tail) > FEW_EDGES
        outcome = _stoppable(partial(job, reading.graph, fixed=reading.fixed), long=long)
        check_heard(outcome, bearings)
        table, report = figures(reading, outcome, backend=backend, robust=robust), seconds_each(outcome)
        if truth is not None:
            against = against_truth(truth, reading, outcome.poses)
            over_time = partial(incremental, truth, reading, job, steps=steps)
            table |= against.table | (_stoppable(over_time, long=long) if steps else {})
            report["accuracy"] = against.report
        results.publish(reading, outcome.poses, outcome.weight, table | report, single=not path.is_dir())
        print_table(table, title=printable(path.resolve().name))
        if doubt := contradiction(table):
            say(f"note: {doubt}")
        say(f"results: {out}")
        results.draw(reading.graph, outcome.poses, outcome.weight)
    if not outcome.converged:
        raise DoubtfulError(f"not converged, the poses are there but no optimum: {outcome.doubt}")


def _stoppable(job: Callable[[], T], *, long: bool) -> T:
    """Do the job so that Ctrl-C ends it at once: gtsam's loops, once in them, do not hear it."""
    return in_a_process(job) if long else job()


def main(args: Sequence[str] | None = None) -> int:
    """Run from the command line; the exit code is that of `wifipgo.command.command_line`."""
    return exit_code(lambda: tyro.cli(documented(run), prog="wifipgo optimise", args=args))


if __name__ == "__main__":
    sys.exit(main())
