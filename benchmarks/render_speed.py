"""Speed of the pictures on one core, in processor time.

Run: ``wifipgo bench render_speed [--json FILE] [--repeats N]``. Every tick of an episode of the
active policy is drawn in order, as a film draws it, from tick to array; each repeat draws the
episode anew, floor and trajectories included. Processor time does not count waiting for others, but a
busy machine has slower memory: the row "copying" is what moving the same pixels costs at that moment.
"""

import os

for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
import tyro
from rich.console import Console
from rich.progress import track
from rich.table import Table

from baselines.evaluate import run_episode
from envs.render.config import RenderConfig
from envs.render.viewer import Viewer
from wifipgo.command.command_line import exit_code
from wifipgo.command.terminal import Terminal
from wifipgo.files.atomic_files import write_json
from wifipgo.scenarios import SCENARIOS
from wifipgo.state import Tick, World

TARGET_FPS = {"paper-sim-50": 200.0}
_SCENARIOS = ("paper-hw-2", "paper-hw-2-obstacles", "paper-sim-50")


@dataclass(frozen=True, slots=True, kw_only=True)
class RenderSpeedConfig:
    """How often to draw, and where to write."""

    repeats: Annotated[int, tyro.conf.arg(help="Times each episode is drawn.")] = 15
    height_px: Annotated[int, tyro.conf.arg(help="Height of the pictures; the arena is a square of it.")] = (
        608
    )
    json: Annotated[Path | None, tyro.conf.arg(help="Also write the rows to this file.")] = None


class Row(NamedTuple):
    """One measurement: mean over the frames of an episode, over repeats of it."""

    name: str
    robots: int
    size_px: tuple[int, int]
    median_ms: float
    fastest_ms: float


def spent_ms(call: Callable[[], object]) -> float:
    """Processor time of a call."""
    begin = time.process_time()
    call()
    return 1e3 * (time.process_time() - begin)


def drawn(scenario: str, config: RenderSpeedConfig) -> Row:
    """Draw an episode from its start to its end."""
    sc = SCENARIOS[scenario]
    ticks: list[tuple[Tick, World]] = []
    run_episode(sc, "active", 0, on_tick=lambda tick, world: ticks.append((tick, world)))
    render = RenderConfig(height_px=config.height_px)

    def draw() -> None:
        viewer = Viewer(render)
        for tick, world in ticks:
            viewer.frame(tick, world, sc)

    times = [spent_ms(draw) / len(ticks) for _ in range(config.repeats + 1)][1:]
    return Row(scenario, sc.n_robots, render.size_px, float(np.median(times)), min(times))


def copied(config: RenderSpeedConfig) -> Row:
    """Move the pixels of a picture at its drawn size once, channel by channel: a lower bound."""
    width, height = RenderConfig(height_px=config.height_px).size_px
    source = np.zeros((height, width, 4), dtype=np.uint8)

    def copy() -> None:
        frame = np.empty((height, width, 3), dtype=np.uint8)
        for channel in range(3):
            frame[..., channel] = source[..., channel]

    times = [spent_ms(copy) for _ in range(20 * config.repeats)]
    return Row("copying", 0, (width, height), float(np.median(times)), min(times))


def show(rows: list[Row], console: Console) -> None:
    """Print the table, targets beside what they ask for."""
    table = Table(title="one core, processor time of a frame")
    for column in ("scenario", "robots", "px", "median ms", "fastest ms", "frames/s", "target"):
        table.add_column(column, justify="left" if column == "scenario" else "right", no_wrap=True)
    for row in rows:
        size = f"{row.size_px[0]} x {row.size_px[1]}"
        times = [f"{row.median_ms:.2f}", f"{row.fastest_ms:.2f}", f"{1e3 / row.median_ms:,.0f}"]
        target = f"{TARGET_FPS[row.name]:g}" if row.name in TARGET_FPS else ""
        table.add_row(row.name, str(row.robots or ""), size, *times, target)
    console.print(table)


def main(config: RenderSpeedConfig) -> None:
    """Measure, show, write."""
    rows = [drawn(scenario, config) for scenario in track(_SCENARIOS, "drawing")] + [copied(config)]
    show(rows, Terminal(width=None if sys.stdout.isatty() else 100))
    if config.json is not None:
        content = [row._asdict() | {"frames_s": 1e3 / row.median_ms} for row in rows]
        write_json(config.json, content, allow_nan=True)


if __name__ == "__main__":
    sys.exit(exit_code(lambda: main(tyro.cli(RenderSpeedConfig, description=__doc__))))
