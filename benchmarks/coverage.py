"""How often 95 % intervals hold the truth, by resampling the pool of a reproduction.

Run: ``wifipgo bench coverage [--run results/reproduce] [--samples 400] [--json OUT]``. The worlds of `fig7`
in the run are taken for all that there are, so their figures are the truth; samples of 20, 60 and 480 of them
are drawn with replacement. Beside the interval that the claims have stands the bootstrap that they had (BCa).
"""

import sys
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import tyro
from rich.table import Table
from scipy import stats

from baselines.evaluation import intervals
from baselines.evaluation.intervals import Estimate
from wifipgo.command.command_line import exit_code
from wifipgo.command.terminal import Terminal
from wifipgo.errors import require
from wifipgo.files.atomic_files import write_json
from wifipgo.files.parquet_files import read_parquet

SIZES, ROOMS = (20, 60, 480), ("without obstacles", "four obstacles", "heterogeneous noise")
_BCA: dict[str, Any] = {"vectorized": True, "n_resamples": 999, "method": "BCa", "paired": True}
Pool = tuple[np.ndarray, ...]  # columns of trials


class Figure(NamedTuple):
    """A figure of the claims, and two intervals of it."""

    name: str
    ours: Callable[..., Estimate]
    statistic: Callable[..., Any]


def _ratio(one: np.ndarray, other: np.ndarray, axis: int = -1) -> np.ndarray:
    return np.asarray(one.mean(axis) / other.mean(axis))


def _reduction(one: np.ndarray, other: np.ndarray, axis: int = -1) -> np.ndarray:
    return 100.0 * (1.0 - _ratio(one, other, axis))


RATIO = Figure("Err, random over active", intervals.ratio, _ratio)
REDUCTION = Figure("ground truth, reduction", intervals.reduction, _reduction)
LEVEL = Figure("Err of active, mean", intervals.mean_of, np.mean)
COUNT = Figure("rendezvous of random, mean", intervals.mean_of, np.mean)


def pools(run: Path) -> Iterator[tuple[str, Figure, Pool]]:
    """Every figure of every room, with its columns.

    Raises:
        BadInputError: The run has no ``fig7``.
    """
    path = run / "fig7" / "episodes.parquet"
    rule = "there: wifipgo reproduce fig7 --out RUN makes it"
    require(path.is_file(), str(path), rule, "nothing")
    episodes = read_parquet(path)
    episodes["truth"] = episodes.ate_trans + episodes.ate_rot
    for room in ROOMS:
        active, random = (episodes[episodes.run == f"{room}, {policy}"] for policy in ("active", "random"))
        columns = {
            RATIO: (random.err_last10, active.err_last10),
            REDUCTION: (active.truth, random.truth),
            LEVEL: (active.err_last10,),
            COUNT: (random.rendezvous,),
        }
        for figure, of in columns.items():
            yield room, figure, tuple(column.to_numpy(float) for column in of)


def coverage(
    figure: Figure, pool: Pool, n: int, samples: int, rng: np.random.Generator
) -> tuple[float, float]:
    """Share of samples whose interval holds the figure of the pool: ours, and by BCa."""
    truth, drawn = float(figure.statistic(*pool)), rng.integers(0, len(pool[0]), (samples, n))
    held = np.array([_held(figure, tuple(column[at] for column in pool), truth) for at in drawn])
    ours, bca = held.mean(axis=0)
    return float(ours), float(bca)


def _held(figure: Figure, sample: Pool, truth: float) -> tuple[bool, bool]:
    """Whether the two intervals of one sample hold the truth."""
    found = figure.ours(*sample)
    ours = found.low is not None and found.high is not None and found.low <= truth <= found.high
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # samples in which nothing varies
        bca = stats.bootstrap(sample, figure.statistic, rng=0, **_BCA).confidence_interval
    return ours, bool(bca.low <= truth <= bca.high)


def measure(run: Path = Path("results/reproduce"), samples: int = 400, json: Path | None = None) -> None:
    """Print a table of coverages.

    Args:
        run: Folder of a reproduction with `fig7`, best of many roots.
        samples: Of each size; the coverage is known to 1 % with 400.
        json: Also write the table here.
    """
    table, rows = Table(title="share of 95 % intervals that hold the truth", title_justify="left"), []
    for header in ("figure", "room", "pool", "worlds", "ours", "BCa"):
        table.add_column(header)
    for room, figure, pool in pools(run):
        for n in SIZES:
            ours, bca = coverage(figure, pool, n, samples, np.random.default_rng(n))
            rows.append({"figure": figure.name, "room": room, "worlds": n, "ours": ours, "bca": bca})
            table.add_row(figure.name, room, str(len(pool[0])), str(n), f"{ours:.3f}", f"{bca:.3f}")
    Terminal().print(table)
    if json is not None:
        write_json(json, rows)


if __name__ == "__main__":
    sys.exit(exit_code(lambda: tyro.cli(measure, prog="wifipgo bench coverage")))
