"""Agent-steps a second of many worlds at once, beside an older checkout of this project.

Run: ``python -m benchmarks.many_worlds [--before CHECKOUT] [--rows PATTERN] [--rounds N]``. Each row is
played by a process of its own on one core, whole episodes with their policy; rounds of before and after
alternate, so that the ratio does not depend on how fast the machine is just then. Time is that of the
processor; medians over the rounds are shown.
"""

import fnmatch
import json
import os
import subprocess
import sys
from dataclasses import asdict, dataclass, field
from pathlib import Path
from statistics import median
from typing import Annotated, Any

import tyro
from rich.progress import track
from rich.table import Table

from wifipgo.command.command_line import exit_code
from wifipgo.command.terminal import Terminal
from wifipgo.files.atomic_files import write_json

_PROGRAM = Path(__file__).with_name("_world_program.py")
_HERE = Path(__file__).parents[1]
_THREADS = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """What is played; with ``most_steps`` only the first steps of an episode."""

    name: str
    scenario: str
    n_worlds: int = 1
    fields: dict[str, Any] = field(default_factory=dict)
    policy: str = "active"
    most_steps: int = 0
    seconds: float = 3.0


_LARGE = {"n_slots": 3, "n_positions": 32, "tx_power_dbm": -4.0, "sigma_t_m": 0.1, "sigma_r_rad": 0.0523599}
ROWS = (
    Row(name="paper-sim-2, 64 worlds", scenario="paper-sim-2", n_worlds=64),
    Row(name="paper-hw-2-obstacles, 64 worlds", scenario="paper-hw-2-obstacles", n_worlds=64),
    Row(
        name="paper-sim-2, every_step, 64 worlds",
        scenario="paper-sim-2",
        n_worlds=64,
        fields={"estimator": "every_step"},
    ),
    Row(name="paper-sim-50, 8 worlds", scenario="paper-sim-50", n_worlds=8),
    Row(name="paper-hw-2, alone", scenario="paper-hw-2"),
    Row(name="paper-sim-50, alone", scenario="paper-sim-50"),
    Row(name="paper-sim-2, 8 worlds", scenario="paper-sim-2", n_worlds=8),
    Row(name="paper-sim-2, 256 worlds", scenario="paper-sim-2", n_worlds=256),
    Row(
        name="400 robots",
        scenario="paper-hw-2",
        fields={"n_robots": 400, "size_m": 170.0, **_LARGE},
        most_steps=12,
    ),
    Row(
        name="1000 robots",
        scenario="paper-hw-2",
        fields={"n_robots": 1000, "size_m": 268.0, **_LARGE},
        most_steps=6,
    ),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class WorldsConfig:
    """What to measure."""

    before: Annotated[Path | None, tyro.conf.arg(help="Checkout of the state to compare with.")] = None
    rows: Annotated[str, tyro.conf.arg(help="Names of the rows to play, with * and ?.")] = "*"
    rounds: Annotated[int, tyro.conf.arg(help="Rounds; before and after alternate in each.")] = 3
    json: Annotated[Path | None, tyro.conf.arg(help="Also write the figures to this file.")] = None


def played(row: Row, checkout: Path) -> dict[str, float]:
    """Figures of a row by the code of a checkout."""
    asked = json.dumps(asdict(row))
    path = {"PYTHONPATH": str(checkout)}
    done = subprocess.run(
        [sys.executable, str(_PROGRAM), asked],
        capture_output=True,
        text=True,
        check=True,
        cwd=checkout,
        env=os.environ | _THREADS | path,
    )
    figures: dict[str, float] = json.loads(done.stdout)
    return figures


def main(config: WorldsConfig) -> None:
    """Measure and show."""
    console = Terminal(width=None if sys.stdout.isatty() else 110)
    rows = [row for row in ROWS if fnmatch.fnmatch(row.name, config.rows)]
    checkouts = {"after": _HERE} | ({"before": config.before.resolve()} if config.before else {})
    found: dict[str, dict[str, list[dict[str, float]]]] = {
        row.name: {state: [] for state in checkouts} for row in rows
    }
    turns = [(row, state) for _ in range(config.rounds) for row in rows for state in checkouts]
    for row, state in track(turns, "playing", console=console):
        found[row.name][state].append(played(row, checkouts[state]))
    console.print(table_of(found))
    if config.json:
        write_json(config.json, found)


def table_of(found: dict[str, dict[str, list[dict[str, float]]]]) -> Table:
    """Medians over the rounds."""
    table = Table("row", "before", "after", "agent-steps/s", "ratio", "ms a step", "MB")
    table.columns[3].header = "best"
    for name, states in found.items():
        after = [one["agent_steps_s"] for one in states["after"]]
        before = [one["agent_steps_s"] for one in states.get("before", [])]
        ratios = [b / a for a, b in zip(before, after, strict=False)]
        table.add_row(
            name,
            f"{median(before):,.0f}" if before else "-",
            f"{median(after):,.0f}",
            f"{max(after):,.0f}",
            f"{median(ratios):.2f}" if ratios else "-",
            f"{median(one['ms_a_step'] for one in states['after']):.2f}",
            f"{median(one['peak_mb'] for one in states['after']):,.0f}",
        )
    return table


if __name__ == "__main__":
    sys.exit(exit_code(lambda: main(tyro.cli(WorldsConfig, description=__doc__))))
