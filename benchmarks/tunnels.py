"""Eight robots in tunnels, most loops wrong: does one answer come from any start, and do robots find it too?

Run: ``wifipgo bench tunnels [--data DIR] [--json FILE]``. DIR has the folder ``tunnels`` in it and is
$WIFIPGO_DATA or ../shared/data if left out. One computer (`solve_graph`, best start, GNC) searches from the
poses as read (odometry), from chordal ones and from all poses at the origin; then the robots by themselves
(`solve_two_level`, GNC). The cost of all is one: squares of odometry, and of each loop its square or, if
lower, the limit of truncation. That is what GNC minimises, whichever loops it keeps. Most of it is a
constant, the limits of wrong loops, so the robots' answer is held too to the squares of those loops alone
that one computer keeps.
"""

import os

for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
import tyro
from rich.console import Console
from rich.progress import track
from rich.table import Table

from wifipgo.command.command_line import exit_code
from wifipgo.command.terminal import Terminal
from wifipgo.data import public_data
from wifipgo.datasets import read_tunnels
from wifipgo.errors import require
from wifipgo.files.atomic_files import write_json
from wifipgo.graph.distributed import Channel, solve_two_level
from wifipgo.graph.losses import LOSSES, truncation_chi2
from wifipgo.graph.posegraph import PoseGraph
from wifipgo.graph.residuals import chi_squares
from wifipgo.graph.solvers.spatial import solve_graph
from wifipgo.graph.solvers.starts import STARTS

DATA = public_data()
KEPT, CHI2, SECONDS, NEAR_M, GAP = 600, 7600.0, 25.0, 1.0, 0.02  # what is asked for
BY_ROBOTS = "by the robots"


class Answer(NamedTuple):
    """Poses, what is left of each measurement, and processor time."""

    rows: np.ndarray
    weight: np.ndarray
    cpu_s: float


class Row(NamedTuple):
    """One answer, and how far it is from the first one."""

    start: str
    kept: int
    chi2: float
    cost: float
    same_loops: float
    furthest_m: float
    cpu_s: float
    rounds: int = 0
    megabytes: float = 0.0


class Demand(NamedTuple):
    """What is asked for, and what was found."""

    what: str
    asked: str
    found: str
    held: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Config:
    """Where the data are."""

    data: Annotated[Path, tyro.conf.arg(help="Folder with the folder tunnels in it.")] = DATA
    json: Annotated[Path | None, tyro.conf.arg(help="Also write the rows to this file.")] = None


def truncated_cost(graph: PoseGraph, rows: np.ndarray) -> float:
    """Squares of odometry, truncated squares of all loops."""
    chi2 = chi_squares(graph, rows)
    loops = LOSSES["gnc"].cost(chi2, truncation_chi2(graph.freedom))
    return float(np.where(graph.odometry, chi2, loops).sum())


def furthest_m(rows: np.ndarray, others: np.ndarray) -> float:
    """Greatest distance between the positions of a pose; the first pose is the same in both."""
    dims = 2 if rows.shape[1] == 3 else 3
    return float(np.linalg.norm(rows[:, :dims] - others[:, :dims], axis=1).max())


def row_of(start: str, graph: PoseGraph, found: Answer, first: Answer) -> Row:
    """An answer in figures; the chi-square is of odometry and of the loops that are kept."""
    kept, chi2 = int((found.weight[~graph.odometry] > 0.5).sum()), chi_squares(graph, found.rows)
    return Row(
        start=start,
        kept=kept,
        chi2=float(found.weight @ chi2),
        cost=truncated_cost(graph, found.rows),
        same_loops=float(first.weight @ chi2),
        furthest_m=furthest_m(found.rows, first.rows),
        cpu_s=found.cpu_s,
    )


def starts_of(graph: PoseGraph) -> dict[str, np.ndarray]:
    """Three starts that have nothing in common but the first pose of each part."""
    origin = np.tile(graph.poses[0], (len(graph.poses), 1))
    return {
        "odometry": graph.poses,
        "chordal": STARTS["chordal"].rows(graph, None),
        "at the origin": origin,
    }


def central(graph: PoseGraph, start: np.ndarray) -> Answer:
    """What one computer finds."""
    begin = time.process_time()
    rows, report = solve_graph(graph, start, initial="best", robust="gnc")
    cpu_s = time.process_time() - begin
    return Answer(rows, report.weights(len(graph.tail)), cpu_s)


def by_robots(graph: PoseGraph, first: Answer) -> Row:
    """The robots' own answer, from where they begin by themselves."""
    channel, begin = Channel(), time.process_time()
    rows, report, weight = solve_two_level(graph, loss="gnc", channel=channel)
    found = Answer(rows, weight, time.process_time() - begin)
    row = row_of(BY_ROBOTS, graph, found, first)
    return row._replace(rounds=sum(report.rounds), megabytes=channel.bytes_sent / 1e6)


def demands_of(rows: list[Row]) -> list[Demand]:
    """What is asked of one computer from every start, and of the robots beside its first answer."""
    alone = [row for row in rows if row.start != BY_ROBOTS]
    (team,) = (row for row in rows if row.start == BY_ROBOTS)
    gap, apart_m = team.cost / alone[0].cost - 1.0, max(row.furthest_m for row in alone)
    same = team.same_loops / alone[0].same_loops - 1.0
    kept, chi2 = min(row.kept for row in alone), max(row.chi2 for row in alone)
    cpu_s = max(row.cpu_s for row in alone)
    return [
        Demand("loops kept", f">= {KEPT}", f"{kept}", kept >= KEPT),
        Demand("chi-square", f"<= {CHI2:g}", f"{chi2:.1f}", chi2 <= CHI2),
        Demand("seconds on one core", f"<= {SECONDS:g}", f"{cpu_s:.1f}", cpu_s <= SECONDS),
        Demand("poses from other starts, m", f"<= {NEAR_M:g}", f"{apart_m:.3f}", apart_m <= NEAR_M),
        Demand("cost of the robots' answer", f"<= {GAP:+.1%}", f"{gap:+.3%}", gap <= GAP),
        Demand("squares of the same loops", f"<= {GAP:+.1%}", f"{same:+.3%}", same <= GAP),
        Demand("poses of it, m", f"<= {NEAR_M:g}", f"{team.furthest_m:.3f}", team.furthest_m <= NEAR_M),
    ]


def answers(graph: PoseGraph, console: Console) -> list[Row]:
    """From every start by one computer, and by the robots."""
    starts = starts_of(graph)
    found = [central(graph, starts[name]) for name in track(starts, "starts", console=console)]
    rows = [row_of(name, graph, one, found[0]) for name, one in zip(starts, found, strict=True)]
    return [*rows, by_robots(graph, found[0])]


def tables_of(rows: list[Row]) -> list[Table]:
    """Answers, and whether they are what is asked for."""
    found = Table("start", title="eight robots in tunnels", pad_edge=False)
    for column in ("kept", "chi-square", "cost", "off, m", "processor s", "rounds", "MB"):
        found.add_column(column, justify="right")
    for row in rows:
        figures = (f"{row.kept}", f"{row.chi2:.1f}", f"{row.cost:.1f}", f"{row.furthest_m:.3f}")
        found.add_row(row.start, *figures, f"{row.cpu_s:.1f}", f"{row.rounds}", f"{row.megabytes:.1f}")
    asked = Table("what", "asked", "found", "held", pad_edge=False)
    for demand in demands_of(rows):
        asked.add_row(*demand[:3], "yes" if demand.held else "no")
    return [found, asked]


def main(config: Config) -> None:
    """Search, compare, show."""
    folder, rule = config.data / "tunnels", "a folder with the folder tunnels in it, see docs/howto/data.md"
    require(folder.is_dir(), "data", rule, str(config.data))
    console, graph = Terminal(width=None if sys.stdout.isatty() else 110), read_tunnels(folder)
    rows = answers(graph, console)
    for table in tables_of(rows):
        console.print(table)
    if config.json:
        write_json(config.json, [row._asdict() for row in rows], allow_nan=True)


if __name__ == "__main__":
    sys.exit(exit_code(lambda: main(tyro.cli(Config, description=__doc__))))
