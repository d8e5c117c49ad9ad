"""Robots that solve by themselves: gap to the optimum, rounds, bytes, airtime, by method and data set.

Run: ``wifipgo bench distributed_solvers [--sets NAME ...] [--methods NAME ...] [--out DIR]``. Sets are
folders of ``g2o``, files of ``g2o_single`` cut into 5 and 10 robots, and ``tunnels``, in $WIFIPGO_DATA or
../shared/data. The gap is of the chi-square to that of one computer (`solve_graph`, the best of its starts),
under the weights that it ended with: those of truncated squares in the tunnels. Airtime is of messages one
after another, at the 802.11n rate of each pair where it comes closest, in free space at 15 dBm. All begin
alike, but two stages, which begin chordal and minimise the chordal cost.
"""

import os

for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, NamedTuple

from wifipgo.command.figures import Figure, drawing

import numpy as np
import tyro
from rich.progress import track
from rich.table import Table
from scipy.spatial.distance import cdist

from wifipgo.command.command_line import exit_code
from wifipgo.command.palette import SERIES
from wifipgo.command.terminal import Terminal
from wifipgo.data import public_data
from wifipgo.errors import pick, require
from wifipgo.files.atomic_files import write_json
from wifipgo.graph.distributed import (
    Channel,
    DistributedConfig,
    TwoLevelConfig,
    solve_distributed,
    solve_two_level,
)
from wifipgo.graph.distributed.asynchronous import AsynchronousConfig, solve_asynchronously
from wifipgo.graph.files.graph_files import cut, read_graph
from wifipgo.graph.posegraph import PoseGraph
from wifipgo.graph.residuals import chi_squares
from wifipgo.graph.solvers.spatial import solve_graph
from wifipgo.graph.solvers.starts import of_robots
from wifipgo.radio.channel.csi import RadioConfig
from wifipgo.radio.channel.rates import rate_and_esnr

DATA = public_data()
CUTS = (5, 10)
RADIO = RadioConfig(tx_power_dbm=15.0)
NEAREST_M, LEAST_MBIT_S, SUBCARRIERS = 1.0, 1.0, 56  # below: relayed, at the lowest rate
Rate = Callable[[int, int], float]


class Case(NamedTuple):
    """A team's graph, where its robots begin, its least chi-square, and how well pairs hear each other."""

    name: str
    graph: PoseGraph
    start: np.ndarray
    least: float
    rate: Rate


class Found(NamedTuple):
    """Poses, and rounds (steps of all robots together without a clock in common)."""

    rows: np.ndarray
    rounds: int


class Row(NamedTuple):
    """A row of the table."""

    name: str
    method: str
    gap: float
    rounds: int
    megabytes: float
    airtime_s: float
    cpu_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Config:
    """What to compare."""

    data: Annotated[Path, tyro.conf.arg(help="Folder of the data sets.")] = DATA
    sets: Annotated[tuple[str, ...], tyro.conf.arg(help="Names, as tunnels INTEL-5; all without.")] = ()
    methods: Annotated[tuple[str, ...], tyro.conf.arg(help="Names, as 'two levels'; all without.")] = ()
    out: Annotated[Path, tyro.conf.arg(help="Folder for table and picture.")] = Path(
        "results/distributed_solvers"
    )
    horizon_s: Annotated[float, tyro.conf.arg(help="Of the robots without a common clock.")] = 5.0


def sets_of(data: Path) -> dict[str, Callable[[], PoseGraph]]:
    """Graphs by name."""
    found: dict[str, Callable[[], PoseGraph]] = {}
    for folder in sorted(data.glob("g2o/*/")):
        found[folder.name] = partial(lambda path: read_graph(path).graph, folder)
    for file in sorted(data.glob("g2o_single/*.g2o")):
        for n in CUTS:
            found[f"{file.stem}-{n}"] = partial(lambda path, n: cut(read_graph(path), n).graph, file, n)
    if (data / "tunnels").is_dir():
        found["tunnels"] = lambda: read_graph(data / "tunnels").graph
    return found


def case_of(name: str, graph: PoseGraph) -> Case:
    """A set under the weights of one computer's answer, which robots are not asked to find here."""
    robust = "gnc" if name == "tunnels" else "none"
    best, report = solve_graph(graph, initial="best", robust=robust)
    start = of_robots(graph, graduated=robust == "gnc")
    weighed = graph.with_weight(graph.weight * report.weights(len(graph.tail)))
    return Case(name, weighed, start, float(chi_squares(weighed, best).sum()), rates_of(graph, best))


def rates_of(graph: PoseGraph, rows: np.ndarray) -> Rate:
    """Rate of each pair of robots where their trajectories come closest, Mb/s."""
    dims = 2 if graph.freedom == 3 else 3
    p_m = {robot: rows[graph.robot == robot, :dims] for robot in graph.robots.tolist()}
    pairs = [(a, b) for a in p_m for b in p_m if a != b]
    away_m = np.array([max(cdist(p_m[a], p_m[b]).min(), NEAREST_M) for a, b in pairs])
    snr = RADIO.snr_scale * (RADIO.wavelength_m / (4.0 * np.pi * away_m)) ** 2
    mbit_s, _ = rate_and_esnr(np.tile(snr[:, None], SUBCARRIERS))
    table = dict(zip(pairs, np.maximum(mbit_s, LEAST_MBIT_S).tolist(), strict=True))
    return lambda sender, receiver: table[sender, receiver]


def _two_stages(case: Case, channel: Channel, config: Config) -> Found:
    rows, report = solve_distributed(case.graph, config=DistributedConfig(threshold=0.1), channel=channel)
    return Found(rows, sum(report.rounds))


def _levels(stretches: int, case: Case, channel: Channel, config: Config) -> Found:
    settings = TwoLevelConfig(stretches=stretches)
    rows, report, _ = solve_two_level(case.graph, case.start, config=settings, channel=channel)
    return Found(rows, sum(report.rounds))


def _asynchronous(case: Case, channel: Channel, config: Config) -> Found:
    settings = AsynchronousConfig(horizon_s=config.horizon_s)
    rows, report = solve_asynchronously(
        case.graph, case.start, rate_mbit_s=case.rate, config=settings, channel=channel
    )
    return Found(rows, report.steps)


METHODS: Mapping[str, Callable[[Case, Channel, Config], Found]] = MappingProxyType(
    {
        "two stages": _two_stages,
        "blocks, CG": partial(_levels, 0),
        "two levels": partial(_levels, 4),
        "asynchronous": _asynchronous,
    }
)


def row_of(case: Case, method: str, config: Config) -> Row:
    """One method on one set."""
    channel, begin = Channel(rate_mbit_s=case.rate), time.process_time()
    found = METHODS[method](case, channel, config)
    cpu_s = time.process_time() - begin
    gap = float(chi_squares(case.graph, found.rows).sum()) / case.least - 1.0
    sent = channel.bytes_sent / 1e6
    return Row(case.name, method, gap, found.rounds, sent, channel.airtime_s, cpu_s)


def table_of(rows: list[Row]) -> Table:
    """The table."""
    table = Table("set", "method", title="robots by themselves", pad_edge=False)
    for column in ("gap %", "rounds", "MB", "airtime s", "processor s"):
        table.add_column(column, justify="right")
    for row in rows:
        figures = (f"{100.0 * row.gap:.3f}", f"{row.rounds}", f"{row.megabytes:.2f}")
        table.add_row(row.name, row.method, *figures, f"{row.airtime_s:.2f}", f"{row.cpu_s:.1f}")
    return table


def drawn(rows: list[Row]) -> Figure:
    """Gap over megabytes: low and left is better."""
    figure = Figure(figsize=(7.0, 5.0), layout="constrained")
    axes = figure.subplots()
    for method, colour in zip(METHODS, SERIES, strict=False):
        own = [row for row in rows if row.method == method]
        gaps = [max(100.0 * row.gap, 1e-4) for row in own]
        axes.scatter([row.megabytes for row in own], gaps, color=colour, label=method, s=22)
    axes.axhline(2.0, color="0.6", lw=0.8)
    axes.set(xscale="log", yscale="log", xlabel="sent, MB", ylabel="chi-square above the optimum, %")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter("{x:g}")
        axis.set_minor_formatter("")
    axes.legend(frameon=False)
    return figure


def main(config: Config) -> None:
    """Compare, show, write."""
    console, known = Terminal(width=None if sys.stdout.isatty() else 110), sets_of(config.data)
    rule = "a folder with g2o, g2o_single or tunnels, see docs/howto/data.md"
    require(bool(known), "data", rule, str(config.data))
    names = config.sets or tuple(known)
    for name in names:
        require(name in known, "sets", f"among {', '.join(known)}", name)
    methods = tuple(config.methods or METHODS)
    for name in methods:
        pick(METHODS, name, "method")
    rows: list[Row] = []
    for name in track(names, "sets", console=console):
        case = case_of(name, known[name]())
        rows += [row_of(case, method, config) for method in methods]
    console.print(table_of(rows))
    config.out.mkdir(parents=True, exist_ok=True)
    write_json(config.out / "table.json", [row._asdict() for row in rows], allow_nan=True)
    with drawing(config.out / "gap.png"):
        drawn(rows).savefig(config.out / "gap.png", dpi=120)


if __name__ == "__main__":
    sys.exit(exit_code(lambda: main(tyro.cli(Config, description=__doc__))))
