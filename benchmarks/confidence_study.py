"""Which profile and which confidence: a study of aperture bearings on simulated rooms.

Run: ``python -m benchmarks.confidence_study [--links N] [--json OUT] [--picture PNG]``. Half of
the links are blocked by a box of wood, chipboard, plasterboard, brick, concrete or metal
(`benchmarks.simulated_rooms`). Compared are three profiles (two-way product, its root, the
geometric mean of both) and confidences of the mean's top peak: mean |error| beyond sight after
the least confident tenth of all links is left out, and the area under the curve of error against
rejection. Nothing here has seen a recording; `wifipgo.radio.aoa.confidence` is what came out.
"""

import os

for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, NamedTuple

from wifipgo.command.figures import Figure, drawing

import numpy as np
import tyro
from rich.console import Console
from rich.progress import track
from rich.table import Table

from benchmarks.simulated_rooms import WAVELENGTH_M, draw_link, two_way_product
from wifipgo.command.command_line import exit_code
from wifipgo.command.palette import BLUE, GREEN, GREY, VERMILION
from wifipgo.command.terminal import Terminal
from wifipgo.errors import require
from wifipgo.files.atomic_files import write_json
from wifipgo.radio.aoa import azimuth_grid, find_peaks
from wifipgo.radio.aoa.moving_aperture import aperture_profiles

POWERS = (1, 2, 4, 6, 8, 12, 16)
DRAWN = {"share of power": GREEN, "side lobe": GREY, "expected error, power 6": BLUE}
ORACLE = "an oracle"


class Studied(NamedTuple):
    """What is kept of a link."""

    blocked: bool
    errors_deg: dict[str, float]  # of each profile's top peak
    confidence: dict[str, float]  # of the mean's top peak; more is better


def study(seed: Sequence[int], *, blocked: bool) -> Studied:
    """One link: error of each profile, and every confidence of their mean."""
    rng = np.random.default_rng(seed)
    room, channel = draw_link(rng, blocked=blocked)
    product = two_way_product(channel, rng)
    position_m = np.pad(room.position_m, ((0, 0), (0, 1)))
    two_way, one_way = aperture_profiles(product, position_m, wavelength_m=WAVELENGTH_M)
    mean = np.sqrt(two_way * one_way)
    stacked = np.stack([two_way, one_way, mean])
    top_rad = find_peaks(stacked, n_peaks=1).azimuth_rad[:, 0]
    errors = dict(zip(("two-way", "one-way", "mean"), _apart_deg(top_rad, room.truth_rad), strict=True))
    agreement = -float(_apart_deg(top_rad[0], top_rad[1]))
    return Studied(blocked, errors, confidences_of(mean) | {"agreement": agreement})


def confidences_of(profile: np.ndarray) -> dict[str, float]:
    """Everything tried; more is better."""
    peaks = find_peaks(profile[None], n_peaks=2)
    first, second = peaks.height[0].tolist()
    away_deg = _apart_deg(azimuth_grid(len(profile)), peaks.azimuth_rad[0, 0])
    share = profile / profile.max()
    found = {
        "share of power": first,
        "side lobe": 1.0 - second / first,
        "height over mean": first / float(profile.mean()),
        "variance": -float(np.sum(share * away_deg**2) / share.sum()),
        "narrowness": -float(np.mean(share > 0.5)),
    }
    for power in POWERS:
        weight = share**power
        found[f"expected error, power {power}"] = -float(np.sum(weight * away_deg) / weight.sum())
    return found


def _apart_deg(a_rad: Any, b_rad: Any) -> Any:
    """Distance of angles, degrees."""
    return np.rad2deg(np.abs(np.remainder(a_rad - b_rad + np.pi, 2.0 * np.pi) - np.pi))


def rejection_curve(order: np.ndarray, errors: np.ndarray) -> np.ndarray:
    """Mean error of the n links that come first in an order of increasing key, n = 1 to all."""
    return np.cumsum(errors[np.argsort(order, kind="stable")]) / np.arange(1, len(errors) + 1)


def keys(links: Sequence[Studied]) -> dict[str, np.ndarray]:
    """For each confidence, what puts the surest link first; and the order of who knows the truth."""
    names = list(links[0].confidence)
    found = {name: np.array([-link.confidence[name] for link in links]) for name in names}
    return found | {ORACLE: np.array([link.errors_deg["mean"] for link in links])}


def ranking(links: Sequence[Studied]) -> list[dict[str, Any]]:
    """Scores of each confidence."""
    errors = np.array([link.errors_deg["mean"] for link in links])
    blocked, content = np.array([link.blocked for link in links]), []
    for name, key in keys(links).items():
        kept = np.zeros(len(links), dtype=bool)
        kept[np.argsort(key, kind="stable")[: len(links) - len(links) // 10]] = True
        left, whole = float(errors[blocked & kept].mean()), float(errors[blocked].mean())
        area = float(rejection_curve(key[blocked], errors[blocked]).mean())
        in_sight = float(errors[~blocked & kept].mean())
        content.append(
            {"confidence": name, "beyond": left, "ratio": left / whole, "in_sight": in_sight, "area": area}
        )
    return sorted(content, key=lambda entry: float(entry["area"]))


def accuracy(links: Sequence[Studied]) -> list[dict[str, Any]]:
    """Median, mean and share beyond 20 degrees of each profile, in and beyond sight."""
    content = []
    for name in links[0].errors_deg:
        for blocked in (False, True):
            errors = np.array([link.errors_deg[name] for link in links if link.blocked == blocked])
            figures = {"median": np.median(errors), "mean": errors.mean(), "gross": np.mean(errors > 20.0)}
            numbers = {key: float(value) for key, value in figures.items()}
            content.append({"profile": name, "blocked": blocked, **numbers})
    return content


def show(links: Sequence[Studied], console: Console) -> None:
    """Print both tables."""
    table = Table(title="|error| of the top peak, degrees")
    for column in ("profile", "link", "median", "mean", "beyond 20 deg"):
        table.add_column(column)
    for row in accuracy(links):
        sight = "beyond sight" if row["blocked"] else "in sight"
        figures = f"{row['median']:.2f}", f"{row['mean']:.2f}", f"{100.0 * row['gross']:.0f} %"
        table.add_row(row["profile"], sight, *figures)
    console.print(table)
    table = Table(title="mean |error|, degrees, without the least confident 10 % of all links")
    for column in ("confidence", "beyond sight", "over that of all", "in sight", "area under curve"):
        table.add_column(column, no_wrap=True)
    for row in ranking(links):
        texts = f"{row['beyond']:.2f}", f"{row['ratio']:.2f}", f"{row['in_sight']:.2f}", f"{row['area']:.2f}"
        table.add_row(row["confidence"], *texts)
    console.print(table)


def save_picture(links: Sequence[Studied], path: Path) -> None:
    """Mean error beyond sight against the share rejected."""
    blocked = np.array([link.blocked for link in links])
    errors = np.array([link.errors_deg["mean"] for link in links])[blocked]
    figure = Figure(figsize=(6.0, 4.2), layout="constrained")
    axes = figure.subplots()
    for name, colour in (DRAWN | {ORACLE: VERMILION}).items():
        curve = rejection_curve(keys(links)[name][blocked], errors)[::-1]
        axes.plot(np.arange(len(curve)) / len(curve), curve, color=colour, label=name)
    axes.set(xlabel="share rejected", ylabel="mean |error| of the rest, degrees", xlim=(0.0, 1.0))
    axes.set_title("simulated links beyond sight")
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(frameon=False)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=100)


def main(
    links: Annotated[int, tyro.conf.arg(help="Simulated links, half of them blocked.")] = 400,
    seed: int = 0,
    json: Annotated[Path | None, tyro.conf.arg(help="Also write the tables to this file.")] = None,
    picture: Annotated[Path | None, tyro.conf.arg(help="Also draw to this file.")] = None,
) -> None:
    """Simulate, compare, write."""
    require(links >= 20, "links", ">= 20", links)
    bar = track(range(links), "links", console=Console(stderr=True))
    studied = [study((seed, number), blocked=number % 2 == 1) for number in bar]
    show(studied, Terminal())
    if json is not None:
        content = {"links": links, "accuracy": accuracy(studied), "ranking": ranking(studied)}
        write_json(json, content, allow_nan=True)
    if picture is not None:
        with drawing(picture, asked_for=True):
            save_picture(studied, picture)


if __name__ == "__main__":
    prog = "python -m benchmarks.confidence_study"
    sys.exit(exit_code(lambda: tyro.cli(main, description=__doc__, prog=prog)))
