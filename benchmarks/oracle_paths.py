"""Our propagation paths beside those of an independent ray tracer, file by file.

Run: ``wifipgo bench oracle_paths [--data DIR] [--json FILE] [--picture FILE]``. Every fixture
in DIR (formats: `benchmarks.reference_files`) is traced and compared path by path. Without
DIR these are the folders ``sionna`` and ``sionna_diffraction`` of ``$WIFIPGO_DATA``, else of
``shared/data`` beside the checkout, those that are there. The picture lies beside the JSON
file unless told otherwise.
"""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from wifipgo.command.figures import Axes, Figure, drawing

import matplotlib as mpl
import numpy as np
import tyro
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from benchmarks.reference_files import Reference, read_references
from benchmarks.reference_paths import Agreement, compare, joined, traced
from wifipgo.command.command_line import exit_code
from wifipgo.command.palette import SERIES
from wifipgo.command.terminal import Terminal
from wifipgo.data import public_data
from wifipgo.errors import BadInputError
from wifipgo.files.atomic_files import write_json
from wifipgo.radio.propagation.paths import DIFFRACTED

# What is asked of the largest deviation; the reference's own float32 allows 0.1 deg at the
# transmitter. Phase: of 95 % of the paths.
TOLERANCES = {
    "azimuth_rx_deg": 0.01,
    "azimuth_tx_deg": 0.1,
    "delay_ns": 0.01,
    "gain_db": 0.1,
    "phase_deg": 0.1,
}
LABELS = ("azimuth at receiver", "azimuth at transmitter", "delay", "gain", "phase")
UNITS = ("deg", "deg", "ns", "dB", "deg")
MIN_SHARE_KNOWN = 0.99
MOST_TOTAL = 1e-3  # of the free-space field
FOLDERS = ("sionna", "sionna_diffraction")
WIDTH_CHARACTERS = 118  # where the output is not a terminal


@dataclass(frozen=True, slots=True, kw_only=True)
class OracleConfig:
    """What to compare with, and where to write."""

    data: Annotated[Path | None, tyro.conf.arg(help="Folder of fixtures.")] = None
    json: Annotated[Path | None, tyro.conf.arg(help="Also write the figures to this file.")] = None
    picture: Annotated[Path | None, tyro.conf.arg(help="Where to save the picture.")] = None


def fixture_folders(given: Path | None) -> list[Path]:
    """The folder asked for, or those of the default that are there.

    Raises:
        ValueError: If it is not there, or none is.
    """
    data = public_data()
    wanted = [data / name for name in FOLDERS] if given is None else [given]
    there = [folder for folder in wanted if folder.is_dir()]
    if not there:
        raise BadInputError(f"{wanted[0]} is no folder; name one with --data or set WIFIPGO_DATA")
    return there


def read_fixtures(folders: Sequence[Path]) -> dict[str, list[Reference]]:
    """Scenes of every fixture in some folders, by name of the file.

    Raises:
        ValueError: If there is none, or one is malformed.
    """
    paths = [path for folder in folders for path in sorted(folder.glob("*.json"))]
    fixtures = {path.stem: read_references(path) for path in paths}
    if not fixtures:
        raise BadInputError(f"{folders[0]} holds no fixture (*.json)")
    return fixtures


def compared(name: str, references: list[Reference]) -> Agreement:
    """A comparison whose refusals name the file."""
    try:
        return compare(references)
    except ValueError as error:
        raise BadInputError(f"{name}.json: {error}") from error


def figures(agreement: Agreement) -> dict[str, Any]:
    """Counts and deviations of a comparison, and whether they are what is asked for."""
    known, ours = agreement.known.tolist(), agreement.ours.tolist()
    size = np.abs(agreement.deviations)
    largest = size.max(axis=0, initial=0.0).tolist()
    phase_p95 = float(np.percentile(size[:, 4], 95.0)) if len(size) else 0.0
    share = agreement.matched / sum(ours) if sum(ours) else 1.0
    asked = [*largest[:4], phase_p95]
    near = all(got <= limit for got, limit in zip(asked, TOLERANCES.values(), strict=True))
    near = near and agreement.total <= MOST_TOTAL
    return {
        "links": agreement.n_links,
        "known_by_order": known,
        "ours_by_order": ours,
        "matched": agreement.matched,
        "missed": agreement.missed,
        "extra": agreement.extra,
        "share_of_ours_known": share,
        "max_abs": dict(zip(TOLERANCES, largest, strict=True)),
        "p95_abs_phase_deg": phase_p95,
        "max_total_of_free_space": agreement.total,
        "reached": near and agreement.missed == 0 and share >= MIN_SHARE_KNOWN,
    }


def _empty_table() -> Table:
    """Columns and what is asked for."""
    limits = ", ".join(
        f"{label} {limit:g} {unit}"
        for label, limit, unit in zip(LABELS, TOLERANCES.values(), UNITS, strict=True)
    )
    table = Table(
        title="paths beside an independent ray tracer",
        caption="rx, tx: azimuth at receiver and transmitter. Largest deviations; phase also at 95 %; "
        "total: of the sum of all paths, over free space. "
        f"Asked for: none missed, at most 1 % extra, {limits} (at 95 %), total {MOST_TOTAL:g}.",
        caption_justify="left",
        box=SIMPLE_HEAD,
        pad_edge=False,
        collapse_padding=True,
    )
    table.add_column("file", overflow="fold")
    for column in ("links", "order 0/\n1/2/edge", "match", "miss/\nextra"):
        table.add_column(column, justify="right", no_wrap=True)
    for column in ("rx\ndeg", "tx\ndeg", "delay\nns", "gain\ndB", "phase\ndeg", "95 %\ndeg", "total", ""):
        table.add_column(column, justify="right", no_wrap=True)
    return table


def show(report: Mapping[str, Mapping[str, Any]], console: Console) -> None:
    """Print a line per file and the total."""
    if not console.is_terminal:
        console.width = WIDTH_CHARACTERS
    table = _empty_table()
    for name, row in report.items():
        if name == "total":
            table.add_section()
        by_order = "/".join(map(str, row["known_by_order"]))
        deviations = [*row["max_abs"].values(), row["p95_abs_phase_deg"], row["max_total_of_free_space"]]
        table.add_row(
            name,
            str(row["links"]),
            by_order,
            str(row["matched"]),
            f"{row['missed']}/{row['extra']}",
            *(f"{value:.2g}" for value in deviations),
            "ok" if row["reached"] else "off",
        )
    console.print(table)


def draw(path: Path, fixtures: Mapping[str, list[Reference]], total: Agreement) -> None:
    """Save a room with the paths of one link beside the deviations of all paths."""
    style: dict[Any, Any] = {"axes.spines.top": False, "axes.spines.right": False, "legend.frameon": False}
    with mpl.rc_context(style):
        figure = Figure(figsize=(11.0, 5.0), dpi=150, layout="constrained")
        left, right = figure.subplots(1, 2)
        name = max(fixtures, key=lambda name: len(fixtures[name][0].surfaces.ends_m))
        draw_link(left, fixtures[name][0])
        left.set_title(name, fontsize=10)
        draw_deviations(right, total)
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path)


def draw_link(axes: Axes, reference: Reference) -> None:
    """The link with most paths, lines coloured by the number of reflections."""
    paths, surfaces = traced(reference), reference.surfaces
    for edge_m in surfaces.ends_m:
        axes.plot(*edge_m.T, color="0.25", lw=1.6, solid_capstyle="round")
    link = int(np.argmax((paths.order >= 0).sum(axis=1)))
    tx_m, rx_m = reference.tx_m[link], reference.rx_m[link]
    for column in np.argsort(-paths.order[link], kind="stable"):
        order = int(paths.order[link, column])
        if order < 0:
            continue
        leaves, arrives = paths.azimuth_tx_rad[link, column], paths.azimuth_rx_rad[link, column]
        first_m, last_m = (
            first_hit(tx_m, leaves, surfaces.ends_m),
            first_hit(rx_m, arrives, surfaces.ends_m),
        )
        bends_m = [meeting(tx_m, leaves, rx_m, arrives)] if order == DIFFRACTED else [first_m, last_m][:order]
        corners_m, kind = np.stack([tx_m, *bends_m, rx_m]), min(order, 3)
        axes.plot(*corners_m.T, color=SERIES[kind], lw=(1.8, 1.2, 0.7, 0.5)[kind], zorder=2 - 0.1 * kind)
    for order, label in enumerate(("line of sight", "one reflection", "two reflections", "over an edge")):
        axes.plot([], [], color=SERIES[order], label=label)
    axes.plot(*tx_m, "o", color="k", label="transmitter")
    axes.plot(*rx_m, "s", color="k", label="receiver")
    axes.set(aspect="equal", xlabel="x (m)", ylabel="y (m)")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=3, fontsize=8)


def meeting(a_m: np.ndarray, a_rad: float, b_m: np.ndarray, b_rad: float) -> np.ndarray:
    """Where two rays that are not parallel meet, m."""
    ways = np.array([[np.cos(a_rad), -np.cos(b_rad)], [np.sin(a_rad), -np.sin(b_rad)]])
    met_m: np.ndarray = a_m + np.linalg.solve(ways, b_m - a_m)[0] * ways[:, 0]
    return met_m


def first_hit(start_m: np.ndarray, azimuth_rad: float, faces_m: np.ndarray) -> np.ndarray:
    """Where a ray first meets a face, m; its start if it meets none."""
    ray = np.array([np.cos(azimuth_rad), np.sin(azimuth_rad)])
    edge_m, gap_m = faces_m[:, 1] - faces_m[:, 0], faces_m[:, 0] - start_m
    with np.errstate(divide="ignore", invalid="ignore"):
        across = ray[0] * edge_m[:, 1] - ray[1] * edge_m[:, 0]
        away_m = (gap_m[:, 0] * edge_m[:, 1] - gap_m[:, 1] * edge_m[:, 0]) / across
        along = (gap_m[:, 0] * ray[1] - gap_m[:, 1] * ray[0]) / across
    away_m = away_m[(away_m > 1e-9) & (along >= 0.0) & (along <= 1.0)]
    return start_m + min(away_m, default=0.0) * ray


def draw_deviations(axes: Axes, total: Agreement) -> None:
    """Share of the paths within each deviation, in units of the tolerance."""
    limits = np.array([*TOLERANCES.values()])
    share = np.arange(1, total.matched + 1) / max(total.matched, 1)
    size = np.sort(np.maximum(np.abs(total.deviations) / limits, 1e-5), axis=0)
    for k, (label, limit, unit) in enumerate(zip(LABELS, limits, UNITS, strict=True)):
        axes.step(
            size[:, k], 100.0 * share, color=SERIES[k], label=f"{label}, {limit:g} {unit}", where="post"
        )
    axes.axvline(1.0, color="0.3", lw=1.0, ls="--")
    axes.set(xscale="log", xlabel="deviation / tolerance", ylabel="paths within it (%)", ylim=(0.0, 101.0))
    axes.set_title(f"{total.matched} paths, {total.missed} missed, {total.extra} extra", fontsize=10)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), ncols=2, fontsize=8)


def main(config: OracleConfig) -> None:
    """Compare, show, write."""
    fixtures = read_fixtures(fixture_folders(config.data))
    parts = {name: compared(name, references) for name, references in fixtures.items()}
    total = joined(list(parts.values()))
    report = {name: figures(part) for name, part in (parts | {"total": total}).items()}
    show(report, Terminal())
    if config.json is not None:
        files = {name: row for name, row in report.items() if name != "total"}
        content = {"tolerances": TOLERANCES, "files": files, "total": report["total"]}
        write_json(config.json, content, allow_nan=True)
    picture = config.picture or (config.json.with_suffix(".png") if config.json else None)
    if picture is not None:
        with drawing(picture, asked_for=True):
            draw(picture, fixtures, total)


if __name__ == "__main__":
    sys.exit(exit_code(lambda: main(tyro.cli(OracleConfig, description=__doc__))))
