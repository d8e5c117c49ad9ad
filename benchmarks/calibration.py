"""Whether bearings of a scenario are as wrong as those of real recordings, in and beyond sight.

Run: ``wifipgo bench calibration [--scenarios NAME ...] [--rooms N] [--out DIR]``. Robots stand in rooms of
the scenario, and each turns to every other, in several runs: between runs they are put back to a few
centimetres, and the receiver's noise is another. Quantiles of the absolute error are held against those of
the recordings: a scenario is calibrated where each is within 25 %. Behind each quantile is its standard
error over rooms, by bootstrap: bearings of one room share its boxes. Within a place: standard deviation over
its runs, median of places. Between places: standard deviation of their means, errors beyond 20 degrees left
out. DIR has ``calibration.parquet``, a row for each bearing, and ``calibration.png``.
"""

import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
import pandas as pd
import tyro
from jaxtyping import Float
from rich.console import Console
from rich.table import Table

from benchmarks._calibration_picture import save_picture
from benchmarks.bearing_errors import GROSS_DEG, bearings
from benchmarks.real_csi import DATA, all_links
from wifipgo.command.command_line import exit_code
from wifipgo.command.terminal import Terminal
from wifipgo.errors import BadInputError, require
from wifipgo.files.atomic_files import appearing
from wifipgo.loop.first_tick import start
from wifipgo.radio.recordings.recorded_link import Link, bearing
from wifipgo.scenarios import Scenario, scenario_named
from wifipgo.streams import Streams

REAL = ("radio-real-2", "radio-real-2-obstacles", "radio-real-10")
N_ROBOTS, N_RUNS, PUT_BACK_M, ROOMS_AT_ONCE = 5, 4, 0.02, 32
QUANTILES, WITHIN = (50, 75, 90), 0.25
RECORDED, SIGHTS = "recordings", ("in sight", "beyond sight")
LEAST_ROOMS, N_RESAMPLES = 10, 200
_DESCRIBED = "docs/howto/data.md says what the recordings are and where they come from"


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrationConfig:
    """What is compared with which recordings."""

    scenarios: Annotated[tuple[str, ...], tyro.conf.arg(help="Scenarios, by name or file.")] = REAL
    rooms: Annotated[int, tyro.conf.arg(help="Rooms of each, at least 10.")] = 192
    seed: Annotated[int, tyro.conf.arg(help="Root of all rooms.")] = 0
    data: Annotated[Path, tyro.conf.arg(help="Folder of recordings, or a pack.")] = DATA
    out: Annotated[Path | None, tyro.conf.arg(help="Write table and picture to this folder.")] = None

    def __post_init__(self) -> None:
        """Refuse what no verdict can be built on."""
        require(self.rooms >= LEAST_ROOMS, "rooms", f">= {LEAST_ROOMS}, fewer decide nothing", self.rooms)


class Spread(NamedTuple):
    """Errors of one scenario, or of the recordings, in or beyond sight; degrees.

    Attributes:
        links: Bearings.
        quantiles_deg: Of the absolute error, at `QUANTILES`.
        stderr_deg: Of the quantiles, over rooms drawn again; of recordings over places.
        gross: Share beyond 20 degrees.
        within_deg: Spread over runs of one place; nan where there is one run of each.
        between_deg: Spread of the means of places.
    """

    links: int
    quantiles_deg: Float[np.ndarray, " quantiles"]
    stderr_deg: Float[np.ndarray, " quantiles"]
    gross: float
    within_deg: float
    between_deg: float


def spread_of(rows: pd.DataFrame) -> Spread:
    """Figures of bearings: those of one ``place`` are its runs, and those of one ``room`` depend."""
    error_deg = rows["error_deg"].to_numpy(float)
    usual = rows[np.abs(error_deg) <= GROSS_DEG].groupby("place")["error_deg"]
    return Spread(
        len(rows),
        np.percentile(np.abs(error_deg), QUANTILES),
        stderr_of_quantiles(rows),
        float(np.mean(np.abs(error_deg) > GROSS_DEG)),
        float(usual.std().median()),
        float(usual.mean().std()),
    )


def stderr_of_quantiles(rows: pd.DataFrame) -> Float[np.ndarray, " quantiles"]:
    """Standard deviation of the quantiles over whole rooms drawn with replacement."""
    by_room = [np.abs(room.to_numpy(float)) for _, room in rows.groupby("room", sort=False)["error_deg"]]
    rng = np.random.default_rng(0)
    drawn = rng.integers(len(by_room), size=(N_RESAMPLES, len(by_room)))
    quantiles = [np.percentile(np.concatenate([by_room[k] for k in again]), QUANTILES) for again in drawn]
    return np.std(quantiles, axis=0)


def recorded_rows(data: Path) -> pd.DataFrame:
    """Bearings of all recordings, each place being a position of both ends.

    Raises:
        ValueError: There are none; says where they are described.
    """
    try:
        links = all_links(data)
    except (BadInputError, FileNotFoundError) as absent:
        raise BadInputError(f"{absent}; {_DESCRIBED}") from absent
    rows = pd.DataFrame([_recorded_row(link) for link in links])
    missing = [sight for sight in SIGHTS if not (rows["sight"] == sight).any()]
    require(not missing, f"recordings in {data}", f"of both {' and '.join(SIGHTS)}", f"none {missing}")
    return rows


def _recorded_row(link: Link) -> dict[str, Any]:
    off_rad = math.remainder(bearing(link).azimuth_rad - link.truth_rad, math.tau)
    place = f"{link.set_name}/{link.place}/{link.transmitter}"
    return {
        "scenario": RECORDED,
        "sight": SIGHTS["NLOS" in link.set_name.upper()],
        "place": place,
        "room": place,
        "error_deg": math.degrees(off_rad),
    }


def simulated_rows(scenario: Scenario, n_rooms: int, seed: int) -> pd.DataFrame:
    """Bearings of all robots to all others, in rooms of a scenario with `N_ROBOTS` of them."""
    crowd = scenario.with_overrides(n_robots=N_ROBOTS)
    firsts = range(0, n_rooms, ROOMS_AT_ONCE)
    parts = [_rows_of(crowd, first, min(first + ROOMS_AT_ONCE, n_rooms), seed) for first in firsts]
    return pd.concat(parts, ignore_index=True).assign(scenario=scenario.name)


def _rows_of(scenario: Scenario, first: int, end: int, seed: int) -> pd.DataFrame:
    streams = Streams.for_episodes([(seed, room) for room in range(first, end)])
    world, tick = start(scenario, streams)
    found, rng = [], np.random.default_rng([seed, first])
    for _ in range(N_RUNS):
        poses = tick.truth.poses[:, 0].copy()
        poses[:, :2] += rng.normal(0.0, PUT_BACK_M, (len(poses), 2))
        errors = bearings(poses, world, scenario, streams)
        sight = np.where(errors.in_sight, *SIGHTS)
        place = np.arange(len(sight)) + first * N_ROBOTS * (N_ROBOTS - 1)
        room = (place // (N_ROBOTS * (N_ROBOTS - 1))).astype(str)
        rows = pd.DataFrame(
            {"sight": sight, "place": place.astype(str), "room": room, "error_deg": errors.deg}
        )
        found.append(rows[errors.heard])
    return pd.concat(found, ignore_index=True)


def report(rows: pd.DataFrame) -> dict[tuple[str, str], Spread]:
    """Figures by scenario and sight, the recordings first, of what there is."""
    groups = {key: spread_of(group) for key, group in rows.groupby(["scenario", "sight"], sort=False)}
    return {
        (name, sight): groups[name, sight]
        for sight in SIGHTS
        for name in rows["scenario"].unique()
        if (name, sight) in groups
    }


def off_by(found: Spread, recorded: Spread) -> float:
    """How far the quantile that is furthest off is from the recordings', as a share of theirs."""
    return float(np.abs(found.quantiles_deg / recorded.quantiles_deg - 1.0).max())


def show(spreads: dict[tuple[str, str], Spread], console: Console) -> None:
    """Print a line a scenario and sight."""
    table = Table(title="errors of bearings beside recordings (degrees)")
    for name in ("", "", "links", "50 %", "75 %", "90 %", f"> {GROSS_DEG:g}", "within", "between", "off by"):
        table.add_column(name, no_wrap=True)
    for (name, sight), found in spreads.items():
        off = 0.0 if name == RECORDED else off_by(found, spreads[RECORDED, sight])
        verdict = "" if name == RECORDED else f"{100 * off:.0f} %" + ("" if off <= WITHIN else ", too far")
        figures = zip(found.quantiles_deg, found.stderr_deg, strict=True)
        quantiles = [f"{one:.2f} +- {stderr:.2f}" for one, stderr in figures]
        spread = [f"{one:.2f}" if np.isfinite(one) else "" for one in (found.within_deg, found.between_deg)]
        table.add_row(
            sight, name, str(found.links), *quantiles, f"{100 * found.gross:.1f} %", *spread, verdict
        )
    console.print(table)


def write(rows: pd.DataFrame, out: Path) -> None:
    """Write the table and the picture."""
    out.mkdir(parents=True, exist_ok=True)
    with appearing(out / "calibration.parquet") as part:
        rows.to_parquet(part, index=False)
    save_picture(rows, SIGHTS, RECORDED, out / "calibration.png")


def compared(scenarios: Sequence[str], n_rooms: int, seed: int, data: Path) -> pd.DataFrame:
    """Bearings of the recordings and of all scenarios."""
    known = [scenario_named(name) for name in scenarios]
    real = recorded_rows(data)
    return pd.concat([real, *(simulated_rows(one, n_rooms, seed) for one in known)], ignore_index=True)


def main(config: CalibrationConfig) -> None:
    """Measure, show, write."""
    rows = compared(config.scenarios, config.rooms, config.seed, config.data)
    show(report(rows), Terminal(width=None if sys.stdout.isatty() else 160))
    if config.out is not None:
        write(rows, config.out)


if __name__ == "__main__":
    sys.exit(exit_code(lambda: main(tyro.cli(CalibrationConfig, description=__doc__))))
