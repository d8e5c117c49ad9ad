"""Outlier methods side by side: reduction of the ground-truth error over a grid of encounters.

Run: ``wifipgo bench outliers [--full] [--trials N] [--jobs N] [--seed S] [--out DIR] [--resume]``.
A cell is a range, a quality of odometry, a kind and number of outliers among 9 relative poses, and whether
starts are known (`baselines.reproduce.encounters`). Every method solves the same encounters, so
comparisons are paired. The reduction is that of Eq. 12 + Eq. 13 against no method at all, which knows
the true covariances; intervals are of 95 %. Bearings are 3 degrees and 7.5 % gross; rows marked *wrong
bearings* solve the same encounters with all bearings of a robot off by one angle of 20 to 180 degrees.
"""

import os

from wifipgo.command.figures import Figure

for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

import json
import multiprocessing
import shutil
import signal
import sys
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Annotated, Any
from zlib import crc32

import matplotlib as mpl
import numpy as np
import pandas as pd
import tyro
from jaxtyping import Float
from rich.console import Console
from rich.progress import track
from rich.table import Table

from baselines.reproduce.encounter_grid import ODOMETRY, encounter, encounter_grid, error_under
from baselines.reproduce.encounters import Encounter, EncounterConfig
from benchmarks._outliers_picture import KINDS, PAPER_CLAIM, WRONG, drawn
from wifipgo.command.command_line import exit_code
from wifipgo.command.terminal import Terminal
from wifipgo.errors import require
from wifipgo.files.atomic_files import appearing, write_json
from wifipgo.files.npz_files import read_npz

METHODS = ("none", "paper", "range_aware", "pcm", "huber", "gnc", "bearing")
HEARING = ("paper", "range_aware", "bearing")  # solved again with wrong bearings
COLUMNS = (*METHODS, "oracle", *(name + WRONG for name in HEARING))


@dataclass(frozen=True, slots=True, kw_only=True)
class OutlierConfig:
    """Which grid, how often, where to."""

    full: Annotated[bool, tyro.conf.arg(help="All 456 cells, 200 trials each: about an hour.")] = False
    trials: Annotated[int, tyro.conf.arg(help="Trials a cell; 0: 40, or 200 with --full.")] = 0
    jobs: Annotated[int, tyro.conf.arg(help="Processes.")] = 2
    seed: Annotated[int, tyro.conf.arg(help="Root of all chance.")] = 0
    out: Annotated[Path, tyro.conf.arg(help="Folder for tables, summary and picture.")] = Path(
        "results/outliers"
    )
    resume: Annotated[bool, tyro.conf.arg(help="Go on where an interrupted run stopped.")] = False

    def __post_init__(self) -> None:
        """Reject values that cannot mean anything."""
        require(self.trials == 0 or self.trials >= 2, "trials", ">= 2, or 0", self.trials)
        require(self.jobs >= 1, "jobs", ">= 1", self.jobs)
        require(self.seed >= 0, "seed", ">= 0", self.seed)

    @property
    def n_trials(self) -> int:
        """Trials of each cell."""
        return self.trials or (200 if self.full else 40)


def grid(*, full: bool) -> list[EncounterConfig]:
    """All cells: 4 ranges, 3 qualities of odometry, 18 outlier settings and none, starts known or not."""
    ranges_m, counts = ((1.0, 2.0, 4.0, 8.0), range(1, 7)) if full else ((1.0, 4.0), (2, 4, 6))
    return encounter_grid(ranges_m=ranges_m, counts=counts)


def errors(cfg: EncounterConfig, seed: int, trial: int) -> list[float]:
    """Ground-truth error, Eq. 12 + Eq. 13, of every column on one encounter; no two cells share one."""

    def seen(of: EncounterConfig) -> Encounter:
        return encounter(of, (seed, crc32(repr(cfg).encode()), trial))

    e, wrong = seen(cfg), seen(replace(cfg, bearings_wrong=True)).bearings
    usual = [error_under(method, e) for method in METHODS]
    removed = error_under("none", e, without_outliers=True)
    return [*usual, removed, *(error_under(method, e, bearings=wrong) for method in HEARING)]


def run_cell(path: Path, cfg: EncounterConfig, seed: int, n_trials: int) -> Path:
    """All trials of a cell, into a file that is there whole or not at all."""
    found = np.array([errors(cfg, seed, trial) for trial in range(n_trials)])
    with appearing(path, by_suffix=True) as unfinished:
        np.savez(unfinished, allow_pickle=False, errors=found)
    return path


def _quiet() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def run_cells(config: OutlierConfig, cells: Sequence[EncounterConfig], partial: Path) -> None:
    """Run what is not done yet, cells over processes."""
    paths = [partial / f"{k:04d}.npz" for k in range(len(cells))]
    todo = [(path, cell) for path, cell in zip(paths, cells, strict=True) if not path.is_file()]
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(config.jobs, spawn, initializer=_quiet) as pool:
        futures = [pool.submit(run_cell, *task, config.seed, config.n_trials) for task in todo]
        try:
            for future in track(as_completed(futures), "cells", total=len(futures)):
                future.result()
        finally:
            pool.shutdown(cancel_futures=True)


def claim(config: OutlierConfig, cells: Sequence[EncounterConfig]) -> Path:
    """Folder of unfinished work beside the results; refuses to mix two settings.

    Raises:
        ValueError: There is unfinished work that is not to be resumed, or of other settings.
    """
    partial = config.out.with_name(f"{config.out.name}.partial")
    record = json.dumps([config.seed, config.n_trials, [asdict(cell) for cell in cells]])
    saved = partial / "config.json"
    if partial.exists():
        require(
            config.resume, f"{partial} holds unfinished work: --resume", "given, or the folder removed", False
        )
        require(saved.read_text() == record, f"settings of {partial}", "those of this run", "others")
    partial.mkdir(parents=True, exist_ok=True)
    saved.write_text(record)
    return partial


def reduction(base: Float[np.ndarray, " trials"], error: Float[np.ndarray, " trials"]) -> tuple[float, float]:
    """Paired reduction of the mean error and half its 95 % interval, per cent (delta method on the ratio)."""
    ratio = error.mean() / base.mean()
    spread = (error - ratio * base).std(ddof=1) / np.sqrt(len(base)) / base.mean()
    return 100.0 * (1.0 - ratio), 196.0 * float(spread)


def tabulate(cells: Sequence[EncounterConfig], partial: Path) -> pd.DataFrame:
    """One row for each cell and method."""

    def rows() -> Iterator[dict[str, Any]]:
        for k, cell in enumerate(cells):
            found = read_npz(partial / f"{k:04d}.npz")["errors"]
            keys = {
                "kind": cell.kind if cell.n_outliers else "no",
                "n_outliers": cell.n_outliers,
                "range_m": cell.range_m,
                "odometry": ODOMETRY[cell.odometry_scale],
                "start_known": cell.start_known,
                "trials": len(found),
            }
            for column, error in zip(COLUMNS, found.T, strict=True):
                gain, half = reduction(found[:, 0], error)
                yield keys | {"method": column, "error": error.mean(), "reduction": gain, "half": half}

    return pd.DataFrame(rows())


def overview(frame: pd.DataFrame) -> pd.DataFrame:
    """Mean reduction by method and kind, over cells with outliers, its half interval, and the worst cell."""
    bad = frame[frame.n_outliers > 0]
    by_kind = frame.pivot_table(index="method", columns="kind", values="reduction")
    cells = bad.groupby("method").reduction
    half = bad.groupby("method").half.agg(lambda h: float(np.sqrt((h**2).sum()) / len(h)))
    worst = frame.loc[frame.groupby("method").reduction.idxmin()].set_index("method")
    table = by_kind.assign(all=cells.mean(), half=half, worst=worst.reduction, worst_half=worst.half)
    table["claim"] = 100.0 * cells.agg(lambda r: float((r >= PAPER_CLAIM).mean()))
    return table.loc[[name for name in COLUMNS if name != "none"]]


def show(table: pd.DataFrame, console: Console, title: str) -> None:
    """Print the overview."""
    shown = Table(title=title, caption="Reduction of Eq. 12 + Eq. 13 in per cent, mean over cells; +- 95 %.")
    shown.add_column("method", no_wrap=True)
    for heading in (*KINDS.values(), "all outliers", "worst cell", f"cells >= {PAPER_CLAIM:.0f} %"):
        shown.add_column(heading, justify="right")
    for row in table.itertuples():
        kinds = [f"{getattr(row, kind):.1f}" for kind in KINDS]
        ends = [
            f"{row.all:.1f} +- {row.half:.1f}",
            f"{row.worst:.1f} +- {row.worst_half:.1f}",
            f"{row.claim:.0f} %",
        ]
        shown.add_row(str(row.Index), *kinds, *ends)
    console.print(shown)


def picture(frame: pd.DataFrame, title: str) -> Figure:
    """A summary in numbers, and below it every cell as a colour."""
    return drawn(frame, overview(frame), title)


def save_picture(figure: Figure, path: Path) -> None:
    """Write a PNG."""
    figure.savefig(path, format="png", dpi=96)


def publish(
    frame: pd.DataFrame, table: pd.DataFrame, figure: Figure, record: dict[str, Any], out: Path
) -> None:
    """Write all results; each file is there whole or not at all."""
    out.mkdir(parents=True, exist_ok=True)
    with appearing(out / "cells.parquet") as unfinished:
        frame.to_parquet(unfinished, index=False)
    with appearing(out / "outliers.png") as unfinished:
        save_picture(figure, unfinished)
    write_json(out / "summary.json", record | {"methods": table.to_dict(orient="index")}, allow_nan=True)


def main(config: OutlierConfig) -> None:
    """Run, show, write."""
    mpl.use("Agg")
    cells, console, begin = (
        grid(full=config.full),
        Terminal(width=None if sys.stdout.isatty() else 140),
        time.time(),
    )
    partial = claim(config, cells)
    run_cells(config, cells, partial)
    frame = tabulate(cells, partial)
    table = overview(frame)
    title = f"{len(cells)} cells, {config.n_trials} paired trials each, seed {config.seed}"
    show(table, console, title)
    record = {"cells": len(cells), "trials": config.n_trials, "seed": config.seed, "full": config.full}
    publish(frame, table, picture(frame, f"Outlier methods: {title}"), record, config.out)
    shutil.rmtree(partial)
    console.print(f"{config.out} written, {time.time() - begin:.0f} s")


if __name__ == "__main__":
    kept = "interrupted; finished cells are kept: --resume goes on"
    sys.exit(exit_code(lambda: main(tyro.cli(OutlierConfig, description=__doc__)), interrupted=kept))
