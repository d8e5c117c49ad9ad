"""Accuracy of the angle-of-arrival estimators: paths, Rician K factor, rooms, and the Cramer-Rao bound.

Run: ``wifipgo bench aoa_accuracy [--trials N] [--json OUT] [--picture PNG]``. A robot with
the paper's antenna pair makes a quarter turn; every trial has a new world.

- *Random paths*: the direct path and echoes of equal power, K above their sum, every
  azimuth and phase uniform, echoes up to 100 ns later; 20 dB SNR of the direct path.
- *Rooms*: traced paths up to one reflection between random places of an empty room, 12 m by 6 m.
- *Shadow*: the same with a box of 0.2 m thick sides in the way of every direct path.
- *One path*: error against SNR, beside the bound.
"""

import os

for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import cycle
from pathlib import Path
from typing import Annotated, NamedTuple

from wifipgo.command.figures import Axes, Figure, drawing

import matplotlib as mpl
import numpy as np
import tyro
from jaxtyping import Float
from rich.console import Console
from rich.progress import track
from rich.table import Table

from wifipgo.command.command_line import exit_code
from wifipgo.command.palette import BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILION
from wifipgo.command.terminal import Terminal
from wifipgo.files.atomic_files import write_json
from wifipgo.radio import aoa
from wifipgo.radio.aoa import cramer_rao
from wifipgo.radio.channel import csi
from wifipgo.radio.propagation.materials import Slab
from wifipgo.radio.propagation.paths import Paths, surfaces_of, trace_paths
from wifipgo.se2 import wrap_angle

RADIO, TURN = csi.RadioConfig(), aoa.AoaConfig()
ESTIMATORS = tuple(sorted(aoa.ESTIMATORS))
K_FACTORS_DB = (10.0, 6.0, 3.0, 0.0)
MATERIALS = ("brick", "concrete", "glass", "metal")
SHADOWS = ("plasterboard", "brick", "concrete")
ROOM_M = (12.0, 6.0)
SNRS_DB = (-5.0, 0.0, 5.0, 10.0, 15.0, 20.0, 25.0, 30.0)
BLOCK = 500  # worlds in memory at once
SNR_DB, MAX_DELAY_S, GROSS_DEG = 20.0, 100e-9, 20.0
# Okabe and Ito's palette, which colour-blind readers tell apart; further estimators begin it again.
_PALETTE = (GREEN, BLUE, VERMILION, PURPLE, ORANGE, SKY)
COLOURS = dict(zip(ESTIMATORS, cycle(_PALETTE), strict=False))
MARKERS = dict(zip(ESTIMATORS, cycle("^soDvP"), strict=False))


@dataclass(frozen=True, slots=True, kw_only=True)
class AccuracyConfig:
    """How many worlds, and where to write."""

    trials: Annotated[int, tyro.conf.arg(help="Worlds of each row.")] = 2000
    json: Annotated[Path | None, tyro.conf.arg(help="Also write the rows to this file.")] = None
    picture: Annotated[Path | None, tyro.conf.arg(help="Also draw them into this file.")] = None


class Row(NamedTuple):
    """Errors of one estimator in one kind of world."""

    world: str
    k_db: float | None
    snr_db: float
    estimator: str
    median_deg: float
    rms_deg: float
    p95_deg: float
    gross_share: float  # beyond 20 degrees
    bound_deg: float | None = None  # root of the Cramer-Rao bound for an amplitude that is fixed
    product_bound_deg: float | None = None  # the same with noise times noise


def random_paths(n: int, n_paths: int, k_db: float, rng: np.random.Generator) -> Paths:
    """Direct path of power 1 and echoes of equal power, ``k_db`` below it together."""
    azimuth_rad = rng.uniform(-np.pi, np.pi, (n, n_paths))
    delay_s = rng.uniform(0.0, MAX_DELAY_S, (n, n_paths))
    gain = np.exp(2j * np.pi * rng.random((n, n_paths)))
    gain[:, 1:] *= np.sqrt(10.0 ** (-k_db / 10.0) / max(1, n_paths - 1))
    delay_s[:, 0] = 0.0
    order = np.tile(np.arange(n_paths) > 0, (n, 1)).astype(np.int64)
    return Paths(gain, delay_s, azimuth_rad, np.zeros((n, n_paths)), order)


def room_paths(n: int, material: str, rng: np.random.Generator, *, shadow: bool = False) -> Paths:
    """Traced paths between random places at least 0.5 m apart, the direct path scaled to power 1.

    With ``shadow`` a box of the material stands in the middle, and in the way of every direct path.
    """
    boxes_m = [np.array([[5.0, 2.0], [7.0, 2.0], [7.0, 4.0], [5.0, 4.0]])] if shadow else []
    corners_m = np.array([[0.0, 0.0], [ROOM_M[0], 0.0], ROOM_M, [0.0, ROOM_M[1]]])
    walls_m = np.stack([corners_m, np.roll(corners_m, -1, axis=0)], axis=1)
    slab = Slab(material)
    scene = surfaces_of(walls_m, boxes_m, carrier_hz=RADIO.carrier_hz, wall=slab, obstacle=slab)
    limits_m = np.array([[[0.3, 0.3], [11.7, 5.7]]] * 2)
    if shadow:  # on both sides of the box, so that the straight line meets it
        limits_m = np.array([[[0.3, 2.3], [4.5, 3.7]], [[7.5, 2.3], [11.7, 3.7]]])
    tx_m, rx_m = (rng.uniform(low_m, high_m, (2 * n, 2)) for low_m, high_m in limits_m)
    apart = np.flatnonzero(np.linalg.norm(tx_m - rx_m, axis=1) > 0.5)[:n]
    paths = trace_paths(tx_m[apart], rx_m[apart], scene, carrier_hz=RADIO.carrier_hz)
    return paths._replace(gain=paths.gain / np.abs(paths.gain[:, :1]))


def errors_deg(
    paths: Paths, *, snr_db: float, n_azimuths: int, rng: np.random.Generator
) -> dict[str, Float[np.ndarray, " trials"]]:
    """Error of the top peak from the direct path, by estimator: all hear the same packets."""
    headings = aoa.turn_headings(TURN)
    gap = {"antenna_gap_m": TURN.antenna_gap_m, "wavelength_m": RADIO.wavelength_m}
    steering = aoa.turn_steering(headings, aoa.azimuth_grid(n_azimuths), **gap)
    found: dict[str, list[np.ndarray]] = {name: [] for name in ESTIMATORS}
    for start in range(0, len(paths.gain), BLOCK):
        some = Paths(*(column[start : start + BLOCK] for column in paths))
        channel = csi.pair_csi(some, np.tile(headings, (len(some.gain), 1)), **gap)
        received = csi.received_csi(channel, snr_scale=10.0 ** (snr_db / 10.0), rng=rng)
        for name in ESTIMATORS:
            profile = aoa.pair_profiles(received, steering, aoa.AoaConfig(aoa_estimator=name))
            found[name].append(aoa.find_peaks(profile, n_peaks=1).azimuth_rad[:, 0])
    truth_rad = paths.azimuth_rx_rad[:, 0]
    return {name: np.rad2deg(np.abs(wrap_angle(np.concatenate(a) - truth_rad))) for name, a in found.items()}


def _row(world: str, k_db: float | None, snr_db: float, name: str, error_deg: np.ndarray) -> Row:
    return Row(
        world,
        k_db,
        snr_db,
        name,
        float(np.median(error_deg)),
        float(np.sqrt(np.mean(error_deg**2))),
        float(np.quantile(error_deg, 0.95)),
        float(np.mean(error_deg > GROSS_DEG)),
    )


def worlds(trials: int) -> Iterator[tuple[str, float | None, Paths]]:
    """Name, K factor and paths of every kind of world."""
    yield "1 path", None, random_paths(trials, 1, 0.0, np.random.default_rng(0))
    for n_paths in (2, 4):
        for k_db in K_FACTORS_DB:
            # One seed: the worlds of a column differ in K only.
            yield (
                f"{n_paths} paths",
                k_db,
                random_paths(trials, n_paths, k_db, np.random.default_rng(n_paths)),
            )
    for material in MATERIALS:
        yield f"{material} room", None, room_paths(trials, material, np.random.default_rng(9))
    for material in SHADOWS:
        paths = room_paths(trials, material, np.random.default_rng(9), shadow=True)
        yield f"{material} shadow", None, paths


def accuracy(trials: int) -> list[Row]:
    """The accuracy table."""
    return [
        _row(world, k_db, SNR_DB, name, error)
        for world, k_db, paths in track(list(worlds(trials)), "worlds")
        for name, error in errors_deg(
            paths, snr_db=SNR_DB, n_azimuths=360, rng=np.random.default_rng(1)
        ).items()
    ]


def against_bound(trials: int) -> list[Row]:
    """One path over SNR, beside the root of the bound's mean over the azimuths drawn."""
    paths = random_paths(trials, 1, 0.0, np.random.default_rng(0))
    pair = aoa.turning_pair(
        aoa.turn_headings(TURN), antenna_gap_m=TURN.antenna_gap_m, wavelength_m=RADIO.wavelength_m
    )
    unit = cramer_rao.azimuth_bound_rad2(pair, paths.azimuth_rx_rad[:, 0], phase_variance_rad2=1.0).mean()
    rows = []
    for snr_db in track(SNRS_DB, "bound"):
        snr, n_subcarriers = 10.0 ** (snr_db / 10.0), len(csi.REPORTED_SUBCARRIERS)
        fixed, product = (
            float(
                np.rad2deg(
                    np.sqrt(
                        unit
                        * cramer_rao.phase_variance_rad2(snr, n_subcarriers=n_subcarriers, random_amplitude=r)
                    )
                )
            )
            for r in (False, True)
        )
        for name, error in errors_deg(
            paths, snr_db=snr_db, n_azimuths=1440, rng=np.random.default_rng(1)
        ).items():
            rows.append(
                _row("1 path", None, snr_db, name, error)._replace(bound_deg=fixed, product_bound_deg=product)
            )
    return rows


def show(table_rows: list[Row], bound_rows: list[Row], console: Console) -> None:
    """Both tables."""
    table = Table(
        title=f"top peak, {SNR_DB:g} dB SNR: median deg / % beyond {GROSS_DEG:g} deg / 95th percentile deg"
    )
    for column in ("world", "K dB", *ESTIMATORS):
        table.add_column(column, justify="left" if column == "world" else "right", no_wrap=True)
    for start in range(0, len(table_rows), len(ESTIMATORS)):
        some = table_rows[start : start + len(ESTIMATORS)]
        cells = (f"{r.median_deg:.2f} / {100 * r.gross_share:.1f} / {r.p95_deg:.1f}" for r in some)
        table.add_row(some[0].world, "" if some[0].k_db is None else f"{some[0].k_db:g}", *cells)
    console.print(table)
    table = Table(title="one path: variance over the bound (over that with noise x noise)")
    for column in ("SNR dB", "bound deg", *ESTIMATORS):
        table.add_column(column, justify="right", no_wrap=True)
    for start in range(0, len(bound_rows), len(ESTIMATORS)):
        some = bound_rows[start : start + len(ESTIMATORS)]
        cells = (f"{_over(r, r.bound_deg):.2f} ({_over(r, r.product_bound_deg):.2f})" for r in some)
        table.add_row(f"{some[0].snr_db:g}", f"{some[0].bound_deg:.4f}", *cells)
    console.print(table)


def _over(row: Row, bound_deg: float | None) -> float:
    return (row.rms_deg / bound_deg) ** 2 if bound_deg else float("nan")


def draw(path: Path, table_rows: list[Row], bound_rows: list[Row]) -> None:
    """Gross errors over K, and errors of one path over SNR."""
    with mpl.rc_context({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False}):
        figure = Figure(figsize=(9.0, 3.6), dpi=110, layout="constrained")
        left, right = figure.subplots(1, 2)
        _draw_gross(left, table_rows)
        _draw_bound(right, bound_rows)
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path)


def _draw_gross(axes: Axes, rows: list[Row]) -> None:
    for name in ESTIMATORS:
        for world, dashes in (("4 paths", "-"), ("2 paths", ":")):
            some = [row for row in rows if row.world == world and row.estimator == name]
            k_db, share = [row.k_db or 0.0 for row in some], [100.0 * row.gross_share for row in some]
            axes.plot(
                k_db, share, dashes, marker=MARKERS[name], color=COLOURS[name], label=f"{name}, {world}"
            )
    axes.set(xlabel="Rician K (dB)", ylabel=f"beyond {GROSS_DEG:g}° (%)", title="Direct path and echoes")
    axes.legend(frameon=False, fontsize=8)


def _draw_bound(axes: Axes, rows: list[Row]) -> None:
    for name in ESTIMATORS:
        some = [row for row in rows if row.estimator == name]
        axes.semilogy(
            [r.snr_db for r in some],
            [r.rms_deg for r in some],
            MARKERS[name],
            color=COLOURS[name],
            label=name,
        )
    some = rows[:: len(ESTIMATORS)]
    snr_db = [row.snr_db for row in some]
    axes.semilogy(snr_db, [r.bound_deg or np.nan for r in some], "k-", lw=1.0, label="Cramér-Rao bound")
    axes.semilogy(
        snr_db, [r.product_bound_deg or np.nan for r in some], "k--", lw=1.0, label="with noise x noise"
    )
    axes.set(xlabel="SNR of a subcarrier (dB)", ylabel="RMS error (°)", title="One path")
    axes.legend(frameon=False, fontsize=8)


def main(config: AccuracyConfig) -> None:
    """Measure, show, write."""
    table_rows, bound_rows = accuracy(config.trials), against_bound(config.trials)
    show(table_rows, bound_rows, Terminal(width=None if sys.stdout.isatty() else 100))
    if config.json is not None:
        tables = {"table": table_rows, "bound": bound_rows}
        content = {name: [row._asdict() for row in rows] for name, rows in tables.items()}
        write_json(config.json, content, allow_nan=True)
    if config.picture is not None:
        with drawing(config.picture, asked_for=True):
            draw(config.picture, table_rows, bound_rows)


if __name__ == "__main__":
    sys.exit(exit_code(lambda: main(tyro.cli(AccuracyConfig, description=__doc__))))
