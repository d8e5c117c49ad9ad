"""Pose graphs as published, from their files: whether `wifipgo optimise` finds the optimum, or says why not.

Run: ``wifipgo bench named_sets [FILE_OR_FOLDER ...] [--json FILE]``. If left out it is ``g2o_single`` in
$WIFIPGO_DATA or ../shared/data. The other answer is gtsam's own from reading on: its reader, its chordal
start in space and ours in the plane, Levenberg-Marquardt by QR. A set is right within 0.1 %, or lower, or
where the command would end with a code other than 0 and a sentence.
"""

import os

for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, NamedTuple

import gtsam
import numpy as np
import tyro
from rich.progress import track
from rich.table import Table

from wifipgo.command.command_line import exit_code
from wifipgo.command.terminal import Terminal
from wifipgo.data import public_data
from wifipgo.errors import BadInputError, NumericalError, require
from wifipgo.files.atomic_files import write_json
from wifipgo.graph.files.graph_files import read_graph
from wifipgo.graph.optimise import optimise
from wifipgo.graph.posegraph import PoseGraph
from wifipgo.graph.residuals import chi_squares
from wifipgo.graph.solvers.starts import STARTS

DATA = public_data() / "g2o_single"
CLOSE = 1e-3
STIFF = 1e-6  # sigma of gtsam's anchor, m and rad
ITERATIONS = 500


class Row(NamedTuple):
    """Errors are gtsam's, half a chi-square; nan where there is none."""

    name: str
    ours: float
    gtsam: float
    code: int
    says: str
    seconds: float

    @property
    def right(self) -> str:
        """Whether the optimum was reached, or the command says that it was not."""
        if self.code == 0 and np.isnan(self.gtsam):
            return "unknown"
        return "yes" if self.code or self.ours <= (1.0 + CLOSE) * self.gtsam + CLOSE**2 else "no"


@dataclass(frozen=True, slots=True, kw_only=True)
class Config:
    """Which files."""

    paths: Annotated[tyro.conf.Positional[tuple[Path, ...]], tyro.conf.arg(help="g2o files, or folders.")] = (
        DATA,
    )
    json: Annotated[Path | None, tyro.conf.arg(help="Also write the rows to this file.")] = None


def by_gtsam(path: Path) -> float:
    """Least error that gtsam finds by itself; nan where it finds none."""
    in_space = "EDGE_SE3" in path.read_text(encoding="utf-8", errors="replace")
    try:
        graph, given = gtsam.readG2o(str(path), in_space)
        key, noise = given.keys()[0], gtsam.noiseModel.Isotropic.Sigma(6 if in_space else 3, STIFF)
        if in_space:
            graph.add(gtsam.PriorFactorPose3(key, gtsam.Pose3(), noise))
            begin = gtsam.InitializePose3.initialize(graph)
        else:
            begin = chordal(path)
            graph.add(gtsam.PriorFactorPose2(key, begin.atPose2(key), noise))
        params = gtsam.LevenbergMarquardtParams()
        params.setLinearSolverType("MULTIFRONTAL_QR")
        params.setMaxIterations(ITERATIONS)
        return float(graph.error(gtsam.LevenbergMarquardtOptimizer(graph, begin, params).optimize()))
    except (RuntimeError, IndexError, ValueError):
        return float("nan")


def chordal(path: Path) -> gtsam.Values:
    """Our chordal start in the plane: gtsam's, LAGO, takes diagonal noise only."""
    reading, begin = read_graph(path), gtsam.Values()
    poses = STARTS["chordal"].rows(reading.graph, None)
    for key, pose in zip(reading.keys.tolist(), poses.tolist(), strict=True):
        begin.insert(key, gtsam.Pose2(*pose))
    return begin


def row_of(path: Path) -> Row:
    """One file by both; the exit code is that of the command."""
    begin = time.process_time()
    try:
        reading = read_graph(path)
        found = optimise(reading.graph, fixed=reading.fixed)
        ours, code, says = found_error(reading.graph, found.poses), int(not found.converged), found.doubt
    except BadInputError as error:
        ours, code, says = float("nan"), 2, str(error)
    except NumericalError as error:
        ours, code, says = float("nan"), 3, str(error)
    return Row(path.name, ours, by_gtsam(path), code, says, time.process_time() - begin)


def found_error(graph: PoseGraph, poses: np.ndarray) -> float:
    """Half the chi-square."""
    return 0.5 * float(chi_squares(graph, poses).sum())


def main(config: Config) -> None:
    """Compare and show."""
    files = [f for path in config.paths for f in (sorted(path.glob("*.g2o")) if path.is_dir() else [path])]
    require(bool(files), "paths", "g2o files, or folders of them", [str(path) for path in config.paths])
    console = Terminal(width=None if sys.stdout.isatty() else 110)
    rows = [row_of(path) for path in track(files, "sets", console=console)]
    table = Table("set", "right", "error", "gtsam, QR", "code", "says", "s", title="sets as published")
    for row in rows:
        figures = (f"{row.ours:.6g}", f"{row.gtsam:.6g}", str(row.code), row.says, f"{row.seconds:.1f}")
        table.add_row(row.name, row.right, *figures)
    console.print(table)
    if config.json:
        write_json(config.json, [row._asdict() for row in rows], allow_nan=True)


if __name__ == "__main__":
    sys.exit(exit_code(lambda: main(tyro.cli(Config, description=__doc__))))
