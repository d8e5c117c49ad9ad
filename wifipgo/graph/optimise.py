"""Optimise a pose graph of several robots from its files, on the command line.

::

    python -m wifipgo.graph.optimise DIR_OR_FILE [--backend distributed] [--robust gnc] [--out DIR]
"""

import re
import sys
import time
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Literal, NamedTuple

import numpy as np
import tyro
from jaxtyping import Float, Int

from wifipgo.command_line import exit_code, printable, say
from wifipgo.errors import DoubtfulError, NumericalError, require
from wifipgo.folder_lock import held
from wifipgo.graph.chordal import chordal_cost, links, matrices
from wifipgo.graph.distributed import Channel, DistributedConfig, solve_distributed
from wifipgo.graph.files import Reading, read_g2o
from wifipgo.graph.keyed import PoseGraph
from wifipgo.graph.parts import components
from wifipgo.graph.pcm import consistent_edges
from wifipgo.graph.residuals import chi_squares
from wifipgo.graph.reweighted import solve_reweighted
from wifipgo.graph.solvers.spatial import FULL_WEIGHT, at_minimum, solve_graph
from wifipgo.processes import in_a_process

Backend = Literal["gtsam", "distributed"]
Robust = Literal["none", "huber", "gnc", "pcm"]
FEW_EDGES = 300  # a search of so many is over before somebody could stop it
STEPS: Mapping[str, str] = MappingProxyType({"gtsam": "iterations", "distributed": "rounds"})


class Outcome(NamedTuple):
    """What an optimisation did. Errors are half the chi-square, as gtsam counts, costs are chordal.

    Attributes:
        poses: Optimised rows.
        weight: What the robust method left of each measurement's information.
        steps: Iterations of the search, or rounds of each stage.
        converged: Whether it ended because there was nothing to gain.
        bytes_sent: Between robots; none with one computer.
        seconds: Without reading and writing.
    """

    poses: Float[np.ndarray, "poses dims"]
    weight: Float[np.ndarray, " edges"]
    steps: tuple[int, ...]
    converged: bool
    bytes_sent: int
    seconds: float


def optimise(
    graph: PoseGraph,
    *,
    fixed: Int[np.ndarray, " fixed"] | None = None,
    backend: Backend = "gtsam",
    robust: Robust = "none",
    threshold: float = 0.01,
) -> Outcome:
    """Optimise a graph.

    Args:
        graph: Poses and measurements.
        fixed: Rows of poses that are known; the first of each part without any stays besides.
        backend: One computer by gtsam, or the robots by themselves.
        robust: What guards against outliers.
        threshold: At which movement the robots stop, see `DistributedConfig`.

    Raises:
        ValueError: Coordinates or information are so large that their products are no numbers.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        error = float(chi_squares(graph, graph.poses).sum())
    require(bool(np.isfinite(error)), "error of the graph as given", "finite", error)
    begin = time.perf_counter()
    weight = np.ones(len(graph.tail))
    if robust == "pcm":
        weight = consistent_edges(graph).astype(np.float64)
    loss = robust if robust in {"huber", "gnc"} else "none"
    guarded = graph.with_weight(graph.weight * weight)
    if backend == "gtsam":
        try:
            poses, report = solve_graph(guarded, fixed=fixed, robust=loss)
        except NumericalError:
            raise
        except RuntimeError as failure:  # gtsam's
            raise NumericalError(_broken_down(failure, graph)) from failure
        poses = _put_back(poses, graph, fixed)
        for down in report.weighed_down:
            weight[down.rows] = down.weight
        done = at_minimum(graph.with_weight(graph.weight * weight), poses, fixed)
        return Outcome(poses, weight, (report.iterations,), done, 0, time.perf_counter() - begin)
    channel, config = Channel(), DistributedConfig(threshold=threshold)
    if loss == "none":
        poses, told = solve_distributed(guarded, fixed=fixed, config=config, channel=channel)
    else:
        poses, told, weight = solve_reweighted(
            guarded, robust=loss, fixed=fixed, config=config, channel=channel
        )
    seconds = time.perf_counter() - begin
    return Outcome(poses, weight, told.rounds, told.converged, channel.bytes_sent, seconds)


def _broken_down(failure: RuntimeError, graph: PoseGraph) -> str:
    """What gtsam says, with the pose where it stopped and the surest measurement of that."""
    text = " ".join(str(failure).split())
    near = re.search(r"near variable (\d+)", text)
    row = int(near[1]) if near else -1
    touching = np.flatnonzero((graph.tail == row) | (graph.head == row))
    if len(touching) == 0:
        return f"the search broke down: {text[:200]}"
    surest = touching[np.argmax(np.abs(graph.information[touching]).max(axis=(1, 2)))]
    at, tail, head = (
        f"pose {graph.index[k]} of robot {graph.robot[k]}"
        for k in (row, graph.tail[surest], graph.head[surest])
    )
    return f"the search broke down near {at}, whose surest measurement is from {tail} to {head}"


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
    part = components(graph)
    edges = links(graph)
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
        "edges weighed down": int((outcome.weight < FULL_WEIGHT).sum()),
        STEPS[backend]: sum(outcome.steps),
        "bytes sent": outcome.bytes_sent,
        "converged": outcome.converged,
        "seconds": outcome.seconds,
        "poses known by FIX": len(reading.fixed),
        "first poses": "from the measurements, the files have none" if reading.guessed else "of the files",
        "lines of landmarks, kept as they are": len(reading.landmarks),
        "files of no robot": ", ".join(reading.left_out) or "none",
        "lines skipped": reading.skipped,
    }


def run(
    path: Annotated[tyro.conf.Positional[Path], tyro.conf.arg(metavar="DIR_OR_FILE")],
    *,
    backend: Backend = "gtsam",
    robust: Robust = "none",
    out: Path = Path("results/optimise"),
    threshold: float = 0.01,
    lenient: bool = False,
    overwrite: bool = False,
) -> None:
    """Optimise a multi-robot pose graph in g2o files, in the plane or in space.

    Prints a table and writes the optimised g2o, TUM and KITTI files of all robots, a
    report.json with the table and the measurements that were weighed down, and a picture of
    before and after. The folder appears whole or not at all, the picture after it. Exit code 1 if the search
    did not converge, 2 if the graph cannot be read or the folder not be written, 3 if the search broke down.

    Args:
        path: A g2o file, or a folder with one file a robot: 0.g2o, 1.g2o, ...
        backend: One computer by gtsam, or the robots by themselves (two-stage Gauss-Seidel).
        robust: Guard against outliers, for all measurements but odometry.
        out: Folder for the results.
        threshold: Movement at which the robots stop, m and rad together.
        lenient: Skip lines with unknown tags, and list them.
        overwrite: Replace results that are in the folder.
    """
    from wifipgo.graph._optimise_report import Results, print_table  # noqa: PLC0415

    require(0.0 < threshold < np.inf, "threshold", "positive and finite", threshold)
    with held(out):
        results = Results.claim(out, overwrite=overwrite)
        reading = read_g2o(path, lenient=lenient)
        outcome = _optimised(reading, backend=backend, robust=robust, threshold=threshold)
        table = figures(reading, outcome, backend=backend, robust=robust)
        results.publish(reading, outcome.poses, outcome.weight, table, single=not path.is_dir())
        print_table(table, title=printable(path.resolve().name))
        say(f"results: {out}")
        results.draw(reading.graph, outcome.poses, outcome.weight)
    if not outcome.converged:
        raise DoubtfulError("not converged: the poses are there, but they are no optimum")


def _optimised(reading: Reading, *, backend: Backend, robust: Robust, threshold: float) -> Outcome:
    """`optimise`, where Ctrl-C ends it at once: gtsam's loops, once in them, do not hear it."""
    job = partial(
        optimise, reading.graph, fixed=reading.fixed, backend=backend, robust=robust, threshold=threshold
    )
    long = backend == "gtsam" and len(reading.graph.tail) > FEW_EDGES
    return in_a_process(job) if long else job()


def main(args: Sequence[str] | None = None) -> int:
    """Run from the command line; the exit code is that of `wifipgo.command_line`."""
    return exit_code(lambda: tyro.cli(run, prog="python -m wifipgo.graph.optimise", args=args))


if __name__ == "__main__":
    sys.exit(main())
