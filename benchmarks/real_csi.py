"""Bearings from real CSI recordings beside another toolbox's, with and without rejection.

Run: ``wifipgo bench real_csi [--data DIR] [--json OUT] [--picture PNG]``. Reads every
pack (``*.npz``) and every raw run in DIR, also below it; a link that is in both counts once.
The truth is the bearing from the *mean* position of the receiver's aperture. The closest peak
is chosen by the truth, so it is an oracle's score. Rejected are the least confident 10 % of
all links by the expected error of their own profiles. Intervals: 95 %, bootstrap over links.
"""

import os

from wifipgo.command.figures import Axes, Figure, drawing

for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

import math
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
import tyro
from rich.console import Console
from rich.progress import track
from rich.table import Table
from scipy.stats import bootstrap

from benchmarks._named_sets import name_sets
from wifipgo.command.command_line import exit_code
from wifipgo.command.palette import BLUE, FRAME, GREY, VERMILION
from wifipgo.command.terminal import Terminal
from wifipgo.data import public_data
from wifipgo.errors import BadInputError
from wifipgo.files.atomic_files import write_json
from wifipgo.radio.aoa.confidence import confidences, least_confident
from wifipgo.radio.recordings.recorded_link import Link, bearing
from wifipgo.radio.recordings.wsr_dataset import read_links

DATA = public_data() / "wsr"
MAX_IN_SIGHT, MAX_BEYOND, MAX_CONFIDENT = 0.9, 1.0, 0.5  # ratios of mean |error|, `targets`
OURS, TOOLBOX, REJECTED = BLUE, GREY, VERMILION


class Row(NamedTuple):
    """One link; errors are absolute, degrees, nan where there is no answer."""

    set_name: str
    place: str
    stamp: str
    transmitter: str
    packets: int
    bearing_deg: float
    truth_deg: float
    error_deg: float
    closest_error_deg: float
    toolbox_error_deg: float
    toolbox_closest_error_deg: float
    expected_error_deg: float
    confidence: float

    @property
    def sight(self) -> str:
        """Group of the link, from the name of its set."""
        name = self.set_name.upper()
        return "beyond sight" if "NLOS" in name else "line of sight" if "LOS" in name else ""


def all_links(data: Path) -> list[Link]:
    """Links of every pack and raw run, each once; packs first, as they carry the toolbox's answers."""
    if not data.exists():
        raise BadInputError(f"{data}: no such file or folder")
    runs = sorted({log.parent for log in data.rglob("csi_rx_*.dat")})
    parts = [data] if data.is_file() else [*sorted(data.rglob("*.npz")), *runs]
    if not parts:
        raise BadInputError(f"{data}: no .npz pack and no csi_rx_*.dat log in this folder")
    found: dict[tuple[str, str], Link] = {}
    for part in parts:
        for link in read_links(part):
            found.setdefault((link.stamp, link.transmitter), link)
    return list(found.values())


def row_of(link: Link) -> Row:
    """Find the bearing of a link and hold it against the truth."""
    found = bearing(link)
    seen_rad = found.peaks.azimuth_rad[0][found.peaks.height[0] > 0.0]
    toolbox = [_away_deg(azimuth_rad, link) for azimuth_rad in link.toolbox_rad] or [math.nan]
    return Row(
        link.set_name,
        link.place,
        link.stamp,
        link.transmitter,
        len(link.forward),
        math.degrees(found.azimuth_rad),
        math.degrees(link.truth_rad),
        _away_deg(found.azimuth_rad, link),
        min((_away_deg(azimuth_rad, link) for azimuth_rad in seen_rad), default=math.nan),
        toolbox[0],
        min(toolbox),
        math.degrees(found.expected_error_rad),
        float(confidences(np.array([found.expected_error_rad]))[0]),
    )


def _away_deg(azimuth_rad: float, link: Link) -> float:
    """Distance from the truth, degrees."""
    return abs(math.degrees(math.remainder(azimuth_rad - link.truth_rad, math.tau)))


def summary(rows: Sequence[Row], out: np.ndarray) -> list[dict[str, Any]]:
    """Figures of each set and group, of all links and of those that are not rejected."""
    names = [*(row.set_name for row in rows), *(row.sight for row in rows if row.sight), "all"]
    content = []
    for name in dict.fromkeys(names):
        of_group = np.array([name in {row.set_name, row.sight, "all"} for row in rows])
        for confident, chosen in ((False, of_group), (True, of_group & ~out)):
            kept = [row for row, keep in zip(rows, chosen, strict=True) if keep]
            content.append({"group": name, "confident_only": confident, **figures(kept)})
    return content


def figures(rows: Sequence[Row]) -> dict[str, Any]:
    """Median, mean and RMS of each answer, interval of our mean, and the ratio to the toolbox's mean."""
    ours = np.array([row.error_deg for row in rows])
    toolbox = np.array([row.toolbox_error_deg for row in rows])
    closest = np.array([row.closest_error_deg for row in rows])
    theirs = np.array([row.toolbox_closest_error_deg for row in rows])
    compared = np.isfinite(toolbox)
    return {
        "links": len(rows),
        "top": _statistics(ours),
        "top_mean_interval": _interval(np.mean, ours),
        "closest": _statistics(closest),
        "toolbox_top": _statistics(toolbox[compared]),
        "toolbox_closest": _statistics(theirs[compared]),
        "ratio": _ratio(ours[compared], toolbox[compared]) if compared.any() else None,
        "ratio_interval": _interval(_ratio, ours[compared], toolbox[compared]),
    }


def _ratio(ours: np.ndarray, theirs: np.ndarray, axis: int = -1) -> Any:
    """Ratio of means."""
    return np.mean(ours, axis=axis) / np.maximum(np.mean(theirs, axis=axis), np.finfo(float).tiny)


def _statistics(errors_deg: np.ndarray) -> list[float] | None:
    """Median, mean and RMS."""
    known = errors_deg[np.isfinite(errors_deg)]
    if not len(known):
        return None
    return [float(np.median(known)), float(known.mean()), float(np.sqrt(np.mean(known**2)))]


def _interval(statistic: Any, *samples: np.ndarray) -> list[float] | None:
    """95 % percentile bootstrap over links; none for fewer than three."""
    if len(samples[0]) < 3:
        return None
    paired = len(samples) > 1
    found = bootstrap(samples, statistic, paired=paired, method="percentile", n_resamples=4000, rng=0)
    return [float(edge) for edge in found.confidence_interval]


def targets(content: Sequence[dict[str, Any]]) -> list[tuple[str, float, float]]:
    """What has to be reached: its name, the figure, the most that it may be."""
    found = {(entry["group"], entry["confident_only"]): entry for entry in content}
    nothing = {"ratio": None, "top": None}
    in_sight, beyond = (found.get((name, False), nothing) for name in ("line of sight", "beyond sight"))
    sure = found.get(("beyond sight", True), nothing)
    left = sure["top"][1] / beyond["top"][1] if sure["top"] else None
    asked = [
        ("line of sight: mean / toolbox's", in_sight["ratio"], MAX_IN_SIGHT),
        ("beyond sight: mean / toolbox's", beyond["ratio"], MAX_BEYOND),
        ("beyond sight: mean of confident / of every link", left, MAX_CONFIDENT),
    ]
    return [(name, float(value), most) for name, value, most in asked if value is not None]


def show(rows: Sequence[Row], out: np.ndarray, content: Sequence[dict[str, Any]], console: Console) -> None:
    """Print every link, then the figures of each group and the targets."""
    links = Table(title="|error| in degrees; truth at the mean aperture position")
    for name in ("set", "place", "tx", "top", "closest", "toolbox", "its closest", "expected", "confidence"):
        links.add_column(name, justify="left" if name == "set" else "right")
    for row, rejected in zip(rows, out, strict=True):
        angles = ["-" if math.isnan(value) else f"{value:.1f}" for value in row[7:12]]
        mark = f"{'rejected ' * bool(rejected)}{row.confidence:.2f}"
        links.add_row(row.set_name, row.place, row.transmitter, *angles, mark)
    table = Table(title="median / mean / RMS of |error|, degrees", caption="[..]: 95 % intervals")
    for name in (
        "group",
        "links",
        "top",
        "its mean",
        "closest",
        "toolbox",
        "its closest",
        "mean / toolbox's",
    ):
        table.add_column(name, justify="left" if name == "group" else "right", no_wrap=True)
    for entry in content:
        table.add_row(*_cells(entry))
    console.print(links)
    console.print(table)
    for name, value, most in targets(content):
        console.print(f"{name}: {value:.2f}, at most {most}: {'reached' if value <= most else 'missed'}")


def _cells(entry: dict[str, Any]) -> list[str]:
    """Texts of one line of the table of groups."""
    ratio = "-" if entry["ratio"] is None else f"{entry['ratio']:.2f} {_text(entry['ratio_interval'])}"
    numbers = [
        "-" if entry[key] is None else " / ".join(f"{value:.2f}" for value in entry[key])
        for key in ("top", "closest", "toolbox_top", "toolbox_closest")
    ]
    name = f"  {entry['group']}, confident" if entry["confident_only"] else entry["group"]
    return [name, str(entry["links"]), numbers[0], _text(entry["top_mean_interval"]), *numbers[1:], ratio]


def _text(interval: list[float] | None) -> str:
    return "" if interval is None else f"\\[{interval[0]:.2f} {interval[1]:.2f}]"


def save_picture(rows: Sequence[Row], out: np.ndarray, path: Path) -> None:
    """Errors per link, ours against the toolbox's, and mean error against the share rejected."""
    figure = Figure(figsize=(10.5, 5.2), layout="constrained")
    left, right = figure.subplots(1, 2)
    place = np.arange(len(rows))
    ours, toolbox = np.maximum([[row.error_deg, row.toolbox_error_deg] for row in rows], 0.1).T
    left.vlines(place, ours, toolbox, color=FRAME, linewidth=1.2)
    left.plot(place, toolbox, "x", color=TOOLBOX, label="toolbox")
    left.plot(place[~out], ours[~out], "o", color=OURS, label="ours")
    left.plot(place[out], ours[out], "o", markerfacecolor="white", color=REJECTED, label="ours, rejected")
    name_sets(left, [row.set_name for row in rows])
    left.set(yscale="log", ylabel="|error| of the bearing (deg), at least 0.1", title="every link")
    left.legend(**_BELOW, ncols=3)
    for group, color in (("line of sight", OURS), ("beyond sight", REJECTED)):
        _draw_rejection(right, [row for row in rows if row.sight == group], group, color)
    right.set(xlabel="share of links rejected, the least confident first", title="error and rejection")
    right.set_ylabel("mean |error| of the other links (deg)")
    right.set_ylim(bottom=0.0)
    right.legend(**_BELOW, ncols=2)
    for axes in (left, right):
        axes.spines[["top", "right"]].set_visible(False)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=100)


_BELOW: Any = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.19), "frameon": False, "fontsize": 9}


def _draw_rejection(axes: Axes, rows: Sequence[Row], group: str, color: str) -> None:
    """Mean error of the links that stay when the least confident of a group go, and an oracle's."""
    if not rows:
        return
    errors = np.array([row.error_deg for row in rows])
    share, n_left = np.arange(len(rows)) / len(rows), np.arange(len(rows), 0, -1)
    expected = np.array([row.expected_error_deg for row in rows])
    for key, style, name in ((expected, "-", group), (errors, ":", f"{group}, an oracle's order")):
        surest_first = errors[np.argsort(key, kind="stable")]
        axes.plot(share, (np.cumsum(surest_first)[::-1]) / n_left, style, color=color, label=name)


def write(rows: Sequence[Row], out: np.ndarray, content: Sequence[dict[str, Any]], path: Path) -> None:
    """Write everything as JSON; the file appears whole or not at all."""
    links = [
        {key: None if str(value) == "nan" else value for key, value in row._asdict().items()}
        | {"rejected": bool(rejected)}
        for row, rejected in zip(rows, out, strict=True)
    ]
    reached = [
        {"name": name, "value": value, "most": most, "reached": value <= most}
        for name, value, most in targets(content)
    ]
    whole = {"truth": "mean aperture position", "targets": reached, "groups": content, "links": links}
    write_json(path, whole, allow_nan=True)


def main(
    data: Annotated[Path, tyro.conf.arg(help="Folder with packs and raw runs, or a pack.")] = DATA,
    json: Annotated[Path | None, tyro.conf.arg(help="Also write everything to this file.")] = None,
    picture: Annotated[Path | None, tyro.conf.arg(help="Also draw to this file.")] = None,
) -> None:
    """Read, find, compare, write."""
    links = all_links(data)
    rows = [row_of(link) for link in track(links, "links", console=Console(stderr=True))]
    out = least_confident(np.array([row.expected_error_deg for row in rows]))
    content = summary(rows, out)
    console = Terminal()
    console.width = max(console.width, 178)
    show(rows, out, content, console)
    if json is not None:
        write(rows, out, content, json)
    if picture is not None:
        with drawing(picture, asked_for=True):
            save_picture(rows, out, picture)


if __name__ == "__main__":
    sys.exit(exit_code(lambda: tyro.cli(main, description=__doc__)))
