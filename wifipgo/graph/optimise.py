"""Optimise a pose graph of several robots from its files, on the command line.

::

    wifipgo optimise DIR_OR_FILE [--backend distributed] [--robust gnc] [--out DIR]
"""

import sys
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Literal, NamedTuple

import numpy as np
import tyro
from jaxtyping import Float, Int

from wifipgo.command.command_line import exit_code, printable, say
from wifipgo.command.docstrings import documented
from wifipgo.command.processes import in_a_process
from wifipgo.data import GRAPH, example_or_path
from wifipgo.errors import DoubtfulError, require
from wifipgo.files.folder_lock import held
from wifipgo.graph.accuracy import aligned, rmse_rot, rmse_trans
from wifipgo.graph.chordal import chordal_cost, links, matrices
from wifipgo.graph.distributed import (
    Channel,
    DistributedConfig,
    DistributedReport,
    TwoLevelConfig,
    solve_two_level,
)
from wifipgo.graph.distributed.robust import solve_reweighted
from wifipgo.graph.files.g2o import Reading
from wifipgo.graph.files.graph_files import cut, read_graph
from wifipgo.graph.losses import LOSSES
from wifipgo.graph.outliers.pcm import consistent_sets
from wifipgo.graph.posegraph import PoseGraph
from wifipgo.graph.residuals import chi_squares
from wifipgo.graph.solvers.spatial import FULL_WEIGHT, solve_graph
from wifipgo.graph.subgraphs import components

Backend = Literal["gtsam", "distributed", "two_level"]
Robust = Literal["none", "huber", "gnc", "pcm"]
Initial = Literal["best", "given", "chordal", "odometry", "frames"]
ITERATIONS = 100  # of gtsam's search at most
FEW_EDGES = 300  # a search of so many is over before somebody could stop it
STEPS: Mapping[str, str] = MappingProxyType(
    {"gtsam": "iterations", "distributed": "rounds", "two_level": "rounds"}
)


class Outcome(NamedTuple):
    """What an optimisation did. Errors are half the chi-square, as gtsam counts, costs are chordal.

    Attributes:
        poses: Optimised rows.
        weight: What the robust method left of each measurement's information.
        steps: Iterations of the search, or rounds of each stage.
        converged: Whether it ended because there was nothing to gain, here or from another start.
        bytes_sent: Between robots; none with one computer.
        seconds: Without reading and writing.
        doubt: What speaks against the result, in a sentence; nothing if it has converged.
        unproven: Pairs of robots of whose measurements PCM may have kept fewer than it could.
    """

    poses: Float[np.ndarray, "poses dims"]
    weight: Float[np.ndarray, " edges"]
    steps: tuple[int, ...]
    converged: bool
    bytes_sent: int
    seconds: float
    doubt: str = ""
    unproven: tuple[tuple[int, int], ...] = ()


def optimise(
    graph: PoseGraph,
    *,
    fixed: Int[np.ndarray, " fixed"] | None = None,
    backend: Backend = "gtsam",
    robust: Robust = "none",
    threshold: float = 0.01,
    initial: Initial = "best",
    max_iterations: int = ITERATIONS,
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

    Raises:
        ValueError: Coordinates or information are so large that their products are no numbers.
        NumericalError: No step can be found; says at which pose.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        error = float(chi_squares(graph, graph.poses).sum())
    require(bool(np.isfinite(error)), "error of the graph as given", "finite", error)
    begin = time.perf_counter()
    sets = consistent_sets(graph) if robust == "pcm" else None
    weight = np.ones(len(graph.tail)) if sets is None else sets.keep.astype(np.float64)
    loss = robust if robust in LOSSES else "none"
    guarded = graph.with_weight(graph.weight * weight)
    if backend == "gtsam":
        poses, report = solve_graph(
            guarded, fixed=fixed, initial=initial, robust=loss, max_iterations=max_iterations
        )
        poses = _put_back(poses, graph, fixed)
        for down in report.downweighted:
            weight[down.rows] = down.weight
        seconds = time.perf_counter() - begin
        outcome = Outcome(poses, weight, (report.iterations,), report.converged, 0, seconds, report.doubt)
    else:
        config = TwoLevelConfig() if backend == "two_level" else DistributedConfig(threshold=threshold)
        poses, told, left = _by_robots(guarded, fixed, loss, config)
        doubt = "" if told.converged else "the robots' rounds or steps were used up before they settled"
        seconds = time.perf_counter() - begin
        settled = (told.rounds, told.converged, told.bytes_sent)
        outcome = Outcome(poses, weight * left, *settled, seconds, doubt)
    return outcome if sets is None else outcome._replace(unproven=sets.unproven)


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


def figures(reading: Reading, outcome: Outcome, *, backend: str, robust: str) -> dict[str, object]:
    """What the table shows, by name; the errors are of the measurements as they were given."""
    graph = reading.graph
    part, edges = components(graph), links(graph)
    kept = graph.with_weight(graph.weight * outcome.weight)
    return {
        "backend": backend,
        "robust": robust,
        "robots": len(graph.robots),
        "poses": len(graph.poses),
        "edges": len(graph.tail),
        "edges between robots": int(graph.between_robots.sum()),
        "components": int(part.max()) + 1,
        "poses outside the largest": len(part) - int(np.bincount(part).max()),
        "error before": 0.5 * float(chi_squares(graph, graph.poses).sum()),
        "error after": 0.5 * float(chi_squares(graph, outcome.poses).sum()),
        "error after, weighed": 0.5 * float(chi_squares(kept, outcome.poses).sum()),
        "chordal cost before": chordal_cost(matrices(graph.poses), edges),
        "chordal cost after": chordal_cost(matrices(outcome.poses), edges),
        **_moved(outcome.poses, graph),
        "edges weighed down": int((outcome.weight < FULL_WEIGHT).sum()),
        STEPS[backend]: sum(outcome.steps),
        "bytes sent": outcome.bytes_sent,
        "converged": outcome.converged,
        "PCM not proven largest": outcome.unproven or {},
        "seconds": outcome.seconds,
        "poses known by FIX": len(reading.fixed),
        "first poses": "from the measurements, the files have none" if reading.guessed else "of the files",
        "lines of landmarks, kept as they are": len(reading.landmarks),
        "files of no robot": ", ".join(reading.left_out) or "none",
        "lines skipped": reading.skipped,
    }


def _moved(poses: Float[np.ndarray, "poses dims"], graph: PoseGraph) -> dict[str, object]:
    """How far poses moved from those of the graph, all of them aligned as one rigid body."""
    fitted = aligned(poses, graph.poses)
    return {
        "moved in shape, RMS m": float(rmse_trans(fitted, graph.poses)[0]),
        "moved in shape, RMS deg": float(np.rad2deg(rmse_rot(fitted, graph.poses)[0])),
    }


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
        robust: What guards against outliers, for all measurements but odometry.
        out: Folder for the results.
        threshold: Movement at which the robots stop, m and rad together.
        initial: Where gtsam's search starts: the file's poses, chordal ones, along the odometry, with
            robots' frames aligned by the loops that agree most, or the best.
        max_iterations: Of gtsam's search.
        robots: Cut the trajectory of a lone robot into those of so many, each as long.
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
        job = partial(
            optimise,
            reading.graph,
            fixed=reading.fixed,
            backend=backend,
            robust=robust,
            threshold=threshold,
            initial=initial,
            max_iterations=max_iterations,
        )
        outcome = _stoppable(job, long=backend == "gtsam" and len(reading.graph.tail) > FEW_EDGES)
        table = figures(reading, outcome, backend=backend, robust=robust)
        results.publish(reading, outcome.poses, outcome.weight, table, single=not path.is_dir())
        print_table(table, title=printable(path.resolve().name))
        say(f"results: {out}")
        results.draw(reading.graph, outcome.poses, outcome.weight)
    if not outcome.converged:
        raise DoubtfulError(f"not converged, the poses are there but no optimum: {outcome.doubt}")


def _stoppable(job: Callable[[], Outcome], *, long: bool) -> Outcome:
    """Do the job so that Ctrl-C ends it at once: gtsam's loops, once in them, do not hear it."""
    return in_a_process(job) if long else job()


def main(args: Sequence[str] | None = None) -> int:
    """Run from the command line; the exit code is that of `wifipgo.command.command_line`."""
    return exit_code(lambda: tyro.cli(documented(run), prog="wifipgo optimise", args=args))


if __name__ == "__main__":
    sys.exit(main())
