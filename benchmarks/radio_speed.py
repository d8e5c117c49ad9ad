"""Speed of the radio wing on one core, beside the machine's own limit and a plain loop.

Run: ``wifipgo bench radio_speed [--json OUT] [--seconds S]``. The limit of the profiles is
the complex64 matrix product of their shape, timed in turn with them: the product alone,
without the squares and the scaling that make a profile of it. The loop does one link
and one direction after the other, as the formula is written. Goals are held against the
fastest call, which is what the machine can do when nothing else runs on it; the median
beside it says how busy the machine was. Rows of batches are for one world of it.
"""

import os

for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

import itertools
import platform
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
import tyro
from rich.console import Console
from rich.table import Table

from wifipgo.command.command_line import exit_code
from wifipgo.command.terminal import Terminal
from wifipgo.files.atomic_files import write_json
from wifipgo.radio import aoa
from wifipgo.radio.channel import csi
from wifipgo.radio.links import Links, probe_links
from wifipgo.radio.propagation.materials import Slab
from wifipgo.radio.propagation.paths import Paths, Surfaces, surfaces_of, trace_paths
from wifipgo.radio.propagation.scenes import Scenes
from wifipgo.radio.turn_profiles import listen
from wifipgo.rows import Rows
from wifipgo.world.layout import room_walls

RADIO, TURN = csi.RadioConfig(), aoa.AoaConfig()
GAP = {"antenna_gap_m": TURN.antenna_gap_m, "wavelength_m": RADIO.wavelength_m}
SIZE_M = 20.0
# Between the rows of boxes, whose faces are at 1.5 and 2.5 m of every 3.5 m.
LANES_M = np.array([0.7, 3.2, 4.3, 6.7, 7.8, 10.2, 11.3, 13.7, 14.8])
# Least share of the matrix product's speed, and most milliseconds.
SHARE_GOAL = 0.8
GOALS_MS = {
    "CSI and profiles, 200 links x 50 packets x 5 paths": 4.0,
    "paths of order 1, 200 links, 84 faces": 4.0,
    "paths of order 2, 200 links, 20 faces": 10.0,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class SpeedConfig:
    """How long to measure, and where to write."""

    seconds: Annotated[float, tyro.conf.arg(help="Time spent on each group of rows.")] = 3.0
    json: Annotated[Path | None, tyro.conf.arg(help="Also write the rows to this file.")] = None


class Row(NamedTuple):
    """One measurement."""

    name: str
    median_ms: float
    fastest_ms: float
    goal: str = ""
    reached: bool | None = None


def timed(calls: Mapping[str, Callable[[], object]], seconds: float) -> dict[str, np.ndarray]:
    """Times of some calls in ms, taken in turn so that a busy machine is busy for all."""
    for call in calls.values():
        call()
    times: dict[str, list[float]] = {name: [] for name in calls}
    end = time.perf_counter() + seconds
    while time.perf_counter() < end or len(times[next(iter(calls))]) < 3:
        for name, call in calls.items():
            begin = time.perf_counter()
            call()
            times[name].append(1e3 * (time.perf_counter() - begin))
    return {name: np.array(spent) for name, spent in times.items()}


def naive_profiles(signal: np.ndarray, headings_rad: np.ndarray, azimuths_rad: np.ndarray) -> np.ndarray:
    """One link and one direction after the other, steering and all."""
    turns = 2.0 * np.pi * TURN.antenna_gap_m / RADIO.wavelength_m
    profile = np.empty((len(signal), len(azimuths_rad)))
    for link, heard in enumerate(signal):
        power = len(heard) * np.vdot(heard, heard).real
        for k, azimuth_rad in enumerate(azimuths_rad):
            expected = np.exp(1j * turns * np.cos(azimuth_rad - headings_rad))
            profile[link, k] = np.abs(np.vdot(heard, expected)) ** 2 / power
    return profile


def profile_rows(seconds: float) -> list[Row]:
    """Profiles of 500 links x 200 packets x 360 azimuths."""
    rng, shape = np.random.default_rng(0), "500 links x 200 packets x 360 azimuths"
    headings, grid = np.linspace(-np.pi / 2.0, 0.0, 200), aoa.azimuth_grid(360)
    steering = aoa.turn_steering(headings, grid, **GAP)
    signal = np.exp(2j * np.pi * rng.random((500, 200))).astype(np.complex64)
    out = np.empty((500, 360), np.complex64)
    times = timed(
        {
            "product": lambda: np.matmul(signal, steering, out=out),
            "profiles": lambda: aoa.bartlett_profiles(signal, steering),
        },
        seconds,
    )
    begin = time.perf_counter()
    slow = naive_profiles(signal[:5], headings, grid)
    naive_ms = 1e5 * (time.perf_counter() - begin)
    if not np.allclose(slow, aoa.bartlett_profiles(signal, steering)[:5], atol=1e-5):
        raise RuntimeError("profiles differ from the plain loop")
    share = times["product"].min() / times["profiles"].min()
    goal = f">= {100 * SHARE_GOAL:.0f} % of the product's speed: {100 * share:.0f} %"
    return [
        Row(f"plain loop, {shape} (5 links x 100)", naive_ms, naive_ms),
        _row(f"complex64 matrix product, {shape}", times["product"]),
        _row(f"profiles, {shape}", times["profiles"])._replace(goal=goal, reached=bool(share >= SHARE_GOAL)),
    ]


def _row(name: str, times_ms: np.ndarray) -> Row:
    """Median and minimum, and the goal if there is one."""
    row = Row(name, float(np.median(times_ms)), float(times_ms.min()))
    goal_ms = GOALS_MS.get(name)
    if goal_ms is None:
        return row
    return row._replace(goal=f"<= {goal_ms:g} ms", reached=row.fastest_ms <= goal_ms)


def csi_rows(seconds: float) -> list[Row]:
    """CSI synthesis, reception and profiles of 200 links, 50 packets, 2 antennas, 5 paths."""
    rng, n = np.random.default_rng(0), 200
    gain = rng.standard_normal((n, 5)) + 1j * rng.standard_normal((n, 5))
    azimuth_rad = rng.uniform(-np.pi, np.pi, (n, 5))
    paths = Paths(gain, rng.uniform(0, 1e-7, (n, 5)), azimuth_rad, azimuth_rad, np.ones((n, 5), np.int64))
    headings = np.linspace(-np.pi / 2.0, 0.0, 50)
    steering, turns = aoa.turn_steering(headings, aoa.azimuth_grid(360), **GAP), np.tile(headings, (n, 1))
    channel = csi.pair_csi(paths, turns, **GAP)
    received = csi.received_csi(channel, snr_scale=100.0, rng=rng)
    music = aoa.AoaConfig(aoa_estimator="music")

    def whole() -> np.ndarray:
        heard = csi.received_csi(csi.pair_csi(paths, turns, **GAP), snr_scale=100.0, rng=rng)
        return aoa.pair_profiles(heard, steering, TURN)

    calls = {
        "CSI and profiles, 200 links x 50 packets x 5 paths": whole,
        "  of these: CSI without noise": lambda: csi.pair_csi(paths, turns, **GAP),
        "  of these: reception": lambda: csi.received_csi(channel, snr_scale=100.0, rng=rng),
        "  of these: profiles": lambda: aoa.pair_profiles(received, steering, TURN),
        "profiles by music instead": lambda: aoa.pair_profiles(received, steering, music),
    }
    # One after the other: in turn, each would pay for memory that the one before gave back.
    alone = (timed({name: call}, 0.5 * seconds) for name, call in calls.items())
    return [_row(name, spent) for one in alone for name, spent in one.items()]


def scene(n_boxes: int) -> Surfaces:
    """A square room with boxes on a grid: four faces each."""
    corners_m = SIZE_M * np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    walls_m = np.stack([corners_m, np.roll(corners_m, -1, axis=0)], axis=1)
    box_m = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
    places_m = [np.array([2.0 + 3.5 * (k % 5), 2.0 + 3.5 * (k // 5)]) for k in range(n_boxes)]
    boxes_m = [place_m + box_m for place_m in places_m]
    return surfaces_of(
        walls_m, boxes_m, carrier_hz=RADIO.carrier_hz, wall=Slab("concrete"), obstacle=Slab("wood", 0.03)
    )


def path_rows(seconds: float) -> list[Row]:
    """Path tracing of 200 links between the boxes."""
    rng = np.random.default_rng(0)
    tx_m, rx_m = (np.stack([rng.uniform(0.3, 19.7, 200), rng.choice(LANES_M, 200)], axis=1) for _ in range(2))
    calls: dict[str, Callable[[], object]] = {}
    for order, n_boxes in ((1, 20), (2, 4)):
        surfaces = scene(n_boxes)

        def trace(surfaces: Surfaces = surfaces, order: int = order) -> Paths:
            return trace_paths(tx_m, rx_m, surfaces, carrier_hz=RADIO.carrier_hz, max_order=order)

        calls[f"paths of order {order}, 200 links, {len(surfaces.ends_m)} faces"] = trace
    return [_row(name, spent) for name, spent in timed(calls, seconds).items()]


class Team(NamedTuple):
    """Robots of several worlds, and what their radios need."""

    p_m: np.ndarray
    yaw_rad: np.ndarray
    surfaces: Surfaces | Scenes
    rows: Rows
    radio: csi.RadioConfig

    @classmethod
    def of(cls, n_worlds: int, n_robots: int, *, n_boxes: int = 0, diffraction: bool = False) -> "Team":
        """At the density of 50 robots in 60 m, or of two in a room with other boxes in each world."""
        rng, rows = np.random.default_rng(n_robots), Rows(n_worlds, n_robots)
        size_m = SIZE_M if n_robots == 2 else 60.0 * (n_robots / 50.0) ** 0.5
        if n_boxes:
            scenes: Surfaces | Scenes = Scenes.of([scene(n_boxes + k % 3) for k in range(n_worlds)])
        else:
            scenes = surfaces_of(room_walls(size_m), carrier_hz=RADIO.carrier_hz, wall=Slab("concrete"))
        p_m = rng.uniform(0.3, size_m - 0.3, (len(rows), 2))
        if n_boxes:
            p_m[:, 1] = rng.choice(LANES_M, len(rows))
        power_dbm = -12.0 if n_robots == 2 else -4.0
        radio = csi.RadioConfig(tx_power_dbm=power_dbm, diffraction=diffraction)
        return cls(p_m, rng.uniform(-3.0, 3.0, len(rows)), scenes, rows, radio)

    def links(self) -> Links:
        """Of all pairs."""
        return probe_links(self.p_m, self.surfaces, self.radio, rows=self.rows)

    def profiles(self) -> np.ndarray:
        """Links, and what every robot hears of the next of its world."""
        receiver = np.arange(len(self.rows))
        peer = (self.rows.peer(receiver) + 1) % self.rows.n_robots
        sender, rng = receiver - self.rows.peer(receiver) + peer, np.random.default_rng(0)
        return listen(self.links(), receiver, sender, self.yaw_rad, radio=self.radio, turn=TURN, rng=rng)


def batch_rows(seconds: float) -> list[Row]:
    """Links, CSI and profiles of two robots a world, for each world of a batch."""
    found = []
    kinds = {"walls": (0, False), "boxes": (4, False), "boxes and edges": (4, True)}
    for (room, (n_boxes, edges)), n_worlds in itertools.product(kinds.items(), (1, 8, 64, 256)):
        team = Team.of(n_worlds, 2, n_boxes=n_boxes, diffraction=edges)
        name = f"two robots, {room}, a world of {n_worlds}: links, CSI, profiles"
        (spent,) = timed({name: team.profiles}, 0.25 * seconds).values()
        found.append(_row(name, spent / n_worlds))
    return found


def team_rows(seconds: float) -> list[Row]:
    """Links of all pairs of large teams."""
    found = []
    for n_robots in (50, 400, 1000):
        team = Team.of(1, n_robots)
        name = f"links of all pairs of {n_robots} robots"
        (spent,) = timed({name: team.links}, 0.25 * seconds).values()
        pair_us = 1e3 * spent.min() / (n_robots * (n_robots - 1) // 2)
        found.append(_row(f"{name}: {pair_us:.2f} us a pair", spent))
    return found


def show(rows: list[Row], console: Console) -> None:
    """Print the table, goals beside what they ask for."""
    table = Table(title=f"one core, {platform.machine()}, numpy {np.__version__}")
    table.add_column("part", no_wrap=True)
    for column in ("median ms", "fastest ms", "goal"):
        table.add_column(column, justify="right", no_wrap=True)
    for row in rows:
        mark = "" if row.reached is None else " [green]yes[/]" if row.reached else " [red]no[/]"
        table.add_row(row.name, f"{row.median_ms:.2f}", f"{row.fastest_ms:.2f}", row.goal + mark)
    console.print(table)


def main(config: SpeedConfig) -> None:
    """Measure, show, write."""
    parts = (profile_rows, csi_rows, path_rows, batch_rows, team_rows)
    rows = [row for part in parts for row in part(config.seconds)]
    show(rows, Terminal(width=None if sys.stdout.isatty() else 140))
    if config.json is not None:
        write_json(config.json, [row._asdict() for row in rows], allow_nan=True)


if __name__ == "__main__":
    sys.exit(exit_code(lambda: main(tyro.cli(SpeedConfig, description=__doc__))))
