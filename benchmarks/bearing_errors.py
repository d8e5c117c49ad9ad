"""How far off bearings are in simulated rooms, in and beyond sight, beside recordings.

Run: ``wifipgo bench bearing_errors [--rooms N] [--json FILE]``. Twelve robots stand in a room of 14 m with
six boxes, and each turns to every other. A row is a radio and what the room is made of; all rows have
the same rooms, places and noise. The error is that of the highest peak; links that carry nothing are
left out. The line of recordings is what `wifipgo bench real_csi` finds.
"""

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, NamedTuple

import numpy as np
import tyro
from jaxtyping import Bool, Float
from rich.console import Console
from rich.table import Table

from wifipgo.command.command_line import exit_code
from wifipgo.command.terminal import Terminal
from wifipgo.files.atomic_files import write_json
from wifipgo.loop.first_tick import start
from wifipgo.radio.aoa.peaks import find_peaks
from wifipgo.radio.links import probe_links
from wifipgo.radio.turn_profiles import listen
from wifipgo.scenarios import Scenario, scenario_named
from wifipgo.se2 import wrap_angle
from wifipgo.segments import crossings
from wifipgo.state import World
from wifipgo.streams import Streams

ROOM: Mapping[str, Any] = MappingProxyType(
    {"n_robots": 12, "size_m": 14.0, "n_obstacles": 6, "obstacle_max_m": 2.0, "tx_power_dbm": 10.0}
)
ROOMS_AT_ONCE = 16
GROSS_DEG = 20.0


def boxes(material: str, thickness_m: float, **more: Any) -> dict[str, Any]:
    """Boxes of a material, and what else is unlike the default."""
    return {"obstacle_material": material, "obstacle_thickness_m": thickness_m, **more}


EDGES: Mapping[str, Any] = MappingProxyType({"max_order": 2, "diffraction": True})
RADIOS: Mapping[str, Mapping[str, Any]] = MappingProxyType(
    {
        "default: wooden boxes, one reflection": {},
        "wooden boxes, two reflections": {"max_order": 2},
        "wooden boxes, and edges": EDGES,
        "the same, a tenth diffuse": {**EDGES, "diffuse_ratio": 0.1},
        "brick boxes of 5 cm, two reflections": boxes("brick", 0.05, max_order=2),
        "brick boxes of 5 cm, and edges": boxes("brick", 0.05, **EDGES),
        "the same, plasterboard walls": boxes(
            "brick", 0.05, wall_material="plasterboard", wall_thickness_m=0.025, **EDGES
        ),
        "concrete boxes of 20 cm, two reflections": boxes("concrete", 0.2, max_order=2),
        "concrete boxes of 20 cm, and edges": boxes("concrete", 0.2, **EDGES),
        "metal boxes, two reflections": boxes("metal", 0.1, max_order=2),
        "metal boxes, and edges": boxes("metal", 0.1, **EDGES),
    }
)


@dataclass(frozen=True, slots=True, kw_only=True)
class ErrorsConfig:
    """How many rooms, and where to write."""

    rooms: Annotated[int, tyro.conf.arg(help="Rooms, the same for each row.")] = 64
    json: Annotated[Path | None, tyro.conf.arg(help="Also write the figures to this file.")] = None


class Errors(NamedTuple):
    """Errors of all links, heard or not.

    Attributes:
        deg: How far off each bearing is.
        heard: Whether there is one.
        in_sight: Whether no box is in between.
    """

    deg: Float[np.ndarray, " links"]
    heard: Bool[np.ndarray, " links"]
    in_sight: Bool[np.ndarray, " links"]

    def figures(self, *, in_sight: bool) -> dict[str, float]:
        """Links, share that is heard, quantiles and share of gross errors, of those in or beyond sight."""
        kind = self.in_sight == in_sight
        deg = self.deg[kind & self.heard]
        quantiles = np.percentile(deg, [50, 75, 90]).tolist() if len(deg) else [float("nan")] * 3
        gross = float(np.mean(deg > GROSS_DEG)) if len(deg) else float("nan")
        names = ("median_deg", "q75_deg", "q90_deg")
        return {
            "links": int(kind.sum()),
            "heard": len(deg) / max(1, int(kind.sum())),
            **dict(zip(names, quantiles, strict=True)),
            "gross": gross,
        }


def errors(scenario: Scenario, n_rooms: int) -> Errors:
    """Bearings of every robot to every other, from where they start."""
    rooms = range(n_rooms)
    parts = [
        _of_rooms(
            scenario, Streams.for_episodes([(0, room) for room in rooms[first : first + ROOMS_AT_ONCE]])
        )
        for first in range(0, n_rooms, ROOMS_AT_ONCE)
    ]
    return Errors(*map(np.concatenate, zip(*parts, strict=True)))


def _of_rooms(scenario: Scenario, streams: Streams) -> Errors:
    world, tick = start(scenario, streams)
    signed = bearings(tick.truth.poses[:, 0], world, scenario, streams)
    return signed._replace(deg=np.abs(signed.deg))


def bearings(
    poses: Float[np.ndarray, "rows 3"], world: World, scenario: Scenario, streams: Streams
) -> Errors:
    """Errors, with their signs, of every robot's bearing to every other of its room."""
    rows, n = world.rows, world.rows.n_robots
    receiver, peer = np.nonzero(rows.peer(np.arange(len(rows)))[:, None] != np.arange(n))
    sender = receiver // n * n + peer
    links = probe_links(poses[:, :2], world.scene.surfaces, scenario.radio, world.standing, rows=rows)
    profiles = listen(
        links,
        receiver,
        sender,
        poses[:, 2],
        radio=scenario.radio,
        turn=scenario.turn,
        rng=streams.channel,
        standing=world.standing,
    )
    peaks = find_peaks(profiles, n_peaks=1)
    away_m = poses[sender, :2] - poses[receiver, :2]
    truth_rad = np.arctan2(away_m[:, 1], away_m[:, 0]) - poses[receiver, 2]
    between = crossings(poses[receiver, :2], poses[sender, :2], world.scene.faces_m[rows.world(receiver)])
    clear = ~np.asarray(between.any(axis=1))
    off_rad = wrap_angle(peaks.azimuth_rad[:, 0] - truth_rad)
    return Errors(np.rad2deg(off_rad), peaks.height[:, 0] > 0.0, clear)


def show(report: Mapping[str, Mapping[str, Mapping[str, float]]], console: Console) -> None:
    """Print a line a radio."""
    table = Table(title="errors of bearings (degrees)")
    table.add_column("radio and room", no_wrap=True)
    for kind in ("in sight", "beyond sight"):
        for column in (f"{kind}\nheard", "50 %", "75 %", "90 %", f"> {GROSS_DEG:g}"):
            table.add_column(column, justify="right", no_wrap=True)
    table.add_row("recordings", "", "0.7", "", "", "", "", "4.1", "", "", "13 %")
    for name, kinds in report.items():
        cells = []
        for found in kinds.values():
            cells += [f"{100 * found['heard']:.0f} %"]
            cells += [f"{found[key]:.2f}" for key in ("median_deg", "q75_deg", "q90_deg")]
            cells += [f"{100 * found['gross']:.1f} %"]
        table.add_row(name, *cells)
    console.print(table)


def main(config: ErrorsConfig) -> None:
    """Measure, show, write."""
    report = {}
    for name, changes in RADIOS.items():
        found = errors(scenario_named("paper-hw-2", **{**ROOM, **changes}), config.rooms)
        kinds = {"in_sight": True, "beyond_sight": False}
        report[name] = {kind: found.figures(in_sight=seen) for kind, seen in kinds.items()}
    show(report, Terminal(width=None if sys.stdout.isatty() else 140))
    if config.json is not None:
        write_json(config.json, report, allow_nan=True)


if __name__ == "__main__":
    sys.exit(exit_code(lambda: main(tyro.cli(ErrorsConfig, description=__doc__))))
