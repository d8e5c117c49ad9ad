"""Speed of pose graph optimisation on one core, building of the problem included.

Run: ``wifipgo bench graph_speed [--json FILE] [--seconds S]``. Robots walk at random and measure each
other, and places where they were before, within 2.2 m, with the noise of ``paper-sim-50``. *Cold* starts from
dead reckoning; *warm* from the optimum without ten of the measurements. Times are of this process alone,
median and fastest; the machine's other work still slows what it shares, so look at the fastest beside the
target.
"""

import os

for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

import platform
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
import tyro
from rich.console import Console
from rich.progress import track
from rich.table import Table

from wifipgo import se2
from wifipgo.command.command_line import exit_code
from wifipgo.command.terminal import Terminal
from wifipgo.files.atomic_files import write_json
from wifipgo.graph.edges import Edges, select
from wifipgo.graph.solvers import last_pose_covariances, solve

SIGMA, RANGE_M, STEP_M, N_NEW = (0.1, np.deg2rad(3.0)), 2.2, 2.0, 10
PAIRS = (10, 25, 50)  # poses of each robot
TEAM = (50, 50)  # robots, poses of each
TARGETS_MS = {"pair, 50 poses each, cold": 4.0, "team, 50 x 50 poses, warm": 60.0}


@dataclass(frozen=True, slots=True, kw_only=True)
class GraphSpeedConfig:
    """How long to measure, and where to write."""

    seconds: Annotated[float, tyro.conf.arg(help="Time spent on each row.")] = 2.0
    json: Annotated[Path | None, tyro.conf.arg(help="Also write the rows to this file.")] = None
    seed: Annotated[int, tyro.conf.arg(help="Of the walks and the noise.")] = 0


class Row(NamedTuple):
    """One measurement; the target, where there is one, is for the fastest time."""

    name: str
    edges: int
    iterations: int
    median_ms: float
    fastest_ms: float
    target_ms: float | None


class Walk(NamedTuple):
    """Dead reckoning of some robots, and what they measured."""

    start: np.ndarray
    edges: Edges


def walks(n_robots: int, n_times: int, size_m: float, rng: np.random.Generator) -> np.ndarray:
    """Random walks in a square, robots x times x 3; who would leave turns round."""
    poses = np.zeros((n_robots, n_times, 3))
    poses[:, 0] = rng.uniform(0.0, 1.0, (n_robots, 3)) * [size_m, size_m, 2.0 * np.pi]
    for t in range(1, n_times):
        turn_rad = rng.uniform(-1.0, 1.0, n_robots)
        step = np.stack([STEP_M * np.cos(turn_rad), STEP_M * np.sin(turn_rad), turn_rad], axis=-1)
        poses[:, t] = se2.compose(poses[:, t - 1], step)
        out = ((poses[:, t, :2] < 0.0) | (poses[:, t, :2] > size_m)).any(axis=1)
        poses[out, t] = poses[out, t - 1] + [0.0, 0.0, np.pi / 2.0]
    return poses


def walked(n_robots: int, n_times: int, *, seed: int) -> Walk:
    """Odometry first, then the first place seen again by each pose, then other robots."""
    rng = np.random.default_rng(seed)
    truth = walks(n_robots, n_times, 60.0 if n_robots > 2 else 10.0, rng)
    p_m, t = truth[..., :2], np.arange(n_times)
    robot, index = np.indices((n_robots, n_times - 1)).reshape(2, -1)
    tail, head = [np.stack([robot, index], axis=1)], [np.stack([robot, index + 1], axis=1)]
    apart_m = np.linalg.norm(p_m[:, :, None] - p_m[:, None], axis=-1)
    again = (apart_m < RANGE_M) & (t[:, None] > t + 2)
    robot, index = np.nonzero(again.any(axis=2))
    tail.append(np.stack([robot, index], axis=1))
    head.append(np.stack([robot, again[robot, index].argmax(axis=1)], axis=1))
    apart_m = np.linalg.norm(p_m[:, None] - p_m[None], axis=-1)
    i, j, index = np.nonzero((apart_m < RANGE_M) & (t > 0) & ~np.eye(n_robots, dtype=bool)[..., None])
    tail.append(np.stack([i, index], axis=1))
    head.append(np.stack([j, index], axis=1))
    return _measured(truth, np.concatenate(tail), np.concatenate(head), rng)


def _measured(truth: np.ndarray, tail: np.ndarray, head: np.ndarray, rng: np.random.Generator) -> Walk:
    """Noisy measurements along edges, odometry first, and dead reckoning."""
    T_world_head = truth[tuple(head.T)]
    z = se2.between(truth[tuple(tail.T)], T_world_head)
    z = z + rng.normal(size=z.shape) * [SIGMA[0], SIGMA[0], SIGMA[1]]
    n_robots, n_times, _ = truth.shape
    start = se2.chained(truth[:, 0], z[: n_robots * (n_times - 1)].reshape(n_robots, -1, 3))
    return Walk(start, Edges.measured(tail=tail, head=head, z=z, sigma=SIGMA, reported_pose=T_world_head))


def timed(call: Callable[[], object], seconds: float) -> tuple[float, float]:
    """Median and fastest processor time of a call over ``seconds`` of calls, ms."""
    call()
    times: list[float] = []
    end = time.perf_counter() + seconds
    while time.perf_counter() < end or len(times) < 5:
        begin = time.process_time()
        call()
        times.append(time.process_time() - begin)
    return 1e3 * float(np.median(times)), 1e3 * min(times)


def cases(n_robots: int, n_times: int, seed: int) -> Iterator[tuple[str, int, int, Callable[[], object]]]:
    """Name, edges, iterations and call of what is timed on one graph."""
    walk, robots = walked(n_robots, n_times, seed=seed), range(n_robots)
    met = np.flatnonzero(walk.edges.between_robots)
    old = np.setdiff1d(np.arange(len(walk.edges)), met[:: max(1, len(met) // N_NEW)][:N_NEW])
    warm, _ = solve(walk.start, select(walk.edges, old), robots=robots)
    shape = f"{n_robots} x {n_times} poses" if n_robots > 2 else f"{n_times} poses each"
    name = f"{'team' if n_robots > 2 else 'pair'}, {shape}"
    starts = {"cold": (walk.start, "none"), "warm": (warm, "none"), "warm, Huber": (warm, "huber")}
    for kind, (poses, loss) in starts.items():
        _, report = solve(poses, walk.edges, robots=robots, loss=loss, initial="near")
        call = _solving(poses, walk.edges, n_robots, loss)
        yield f"{name}, {kind}", len(walk.edges), report.iterations, call
    yield (
        f"{name}, end covariances",
        len(walk.edges),
        0,
        lambda: last_pose_covariances(warm, walk.edges, robots=robots),
    )


def _solving(poses: np.ndarray, edges: Edges, n_robots: int, loss: str) -> Callable[[], object]:
    return lambda: solve(poses, edges, robots=range(n_robots), loss=loss, initial="near")


def measure(config: GraphSpeedConfig, console: Console) -> list[Row]:
    """All rows, with a progress bar."""
    shapes = [*((2, n_times) for n_times in PAIRS), TEAM]
    return [
        Row(name, edges, iterations, *timed(call, config.seconds), TARGETS_MS.get(name))
        for shape in track(shapes, "graphs", console=console)
        for name, edges, iterations, call in cases(*shape, config.seed)
    ]


def show(rows: list[Row], seed: int, console: Console) -> None:
    """Print the table."""
    title = f"one core, {platform.machine()}, Python {platform.python_version()}, seed {seed}"
    table = Table(title=title)
    table.add_column("solve", no_wrap=True)
    for column in ("edges", "iterations", "median ms", "fastest ms", "target ms"):
        table.add_column(column, justify="right")
    for row in rows:
        target = f"{row.target_ms:g}" if row.target_ms else ""
        counts = (str(row.edges), str(row.iterations or ""))
        table.add_row(row.name, *counts, f"{row.median_ms:.2f}", f"{row.fastest_ms:.2f}", target)
    console.print(table)


def main(config: GraphSpeedConfig) -> None:
    """Measure, show, write."""
    console = Terminal(width=None if sys.stdout.isatty() else 120)
    rows = measure(config, console)
    show(rows, config.seed, console)
    if config.json is not None:
        content = {"seed": config.seed, "rows": [row._asdict() for row in rows]}
        write_json(config.json, content, allow_nan=True)


if __name__ == "__main__":
    sys.exit(exit_code(lambda: main(tyro.cli(GraphSpeedConfig, description=__doc__))))
