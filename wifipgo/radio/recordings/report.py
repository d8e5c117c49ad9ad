"""Tables of bearings from recordings."""

import math
from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float
from rich.table import Table

from wifipgo.command.terminal import Terminal
from wifipgo.radio.aoa import closest_peak
from wifipgo.radio.aoa.confidence import confidences, least_confident
from wifipgo.radio.aoa.moving_aperture import Bearing
from wifipgo.radio.recordings.recorded_link import Link

WIDTH_CHARACTERS = 118  # where the output is not a terminal
COLUMNS = ("set", "place", "tx", "packets", "bearing", "closest", "truth", "error", "height", "confidence")
LEFT_OUT_COLUMN = ("left out",)
TOOLBOX_COLUMNS = ("toolbox", "its error")


def error_deg(azimuth_rad: float, link: Link) -> float:
    """Estimate minus truth, degrees in [-180, 180]."""
    return math.degrees(math.remainder(azimuth_rad - link.truth_rad, math.tau))


def closest_rad(link: Link, found: Bearing) -> float:
    """The peak nearest to the truth, rad: what an oracle would choose; nan where the truth is not known."""
    if not link.surveyed:
        return math.nan
    return float(closest_peak(found.peaks, np.array([link.truth_rad]))[0])


def rejected(bearings: Sequence[Bearing]) -> Bool[np.ndarray, " links"]:
    """The least confident of these bearings."""
    return least_confident(np.array([found.expected_error_rad for found in bearings]))


def print_report(links: Sequence[Link], bearings: Sequence[Bearing], *, title: str) -> None:
    """Print a line for each link and a summary for each set."""
    console = Terminal()
    if not console.is_terminal:
        console.width = WIDTH_CHARACTERS
    console.print(link_table(links, bearings, title=title))
    if any(link.surveyed for link in links):
        console.print(summary_table(links, bearings))


def link_table(links: Sequence[Link], bearings: Sequence[Bearing], *, title: str) -> Table:
    """One line a link, angles in degrees; packets left out only where there are some."""
    toolbox, lossy = any(link.toolbox_rad for link in links), any(link.n_left_out for link in links)
    table = Table(title=f"Bearings, {title}", caption=_CAPTION + lossy * _LEFT_OUT, caption_justify="left")
    for name in COLUMNS + LEFT_OUT_COLUMN * lossy + TOOLBOX_COLUMNS * toolbox:
        table.add_column(name, justify="left" if name in {"set", "tx"} else "right", no_wrap=True)
    out = rejected(bearings)
    for k, (link, found) in enumerate(zip(links, bearings, strict=True)):
        last_of_set = links[k + 1 :] != [] and links[min(k + 1, len(links) - 1)].set_name != link.set_name
        cells = _cells(link, found, out=bool(out[k])) + [str(link.n_left_out)] * lossy
        table.add_row(*cells, *_toolbox_cells(link) * toolbox, end_section=last_of_set)
    return table


_CAPTION = (
    "Degrees in the map frame. bearing: top peak. closest: of the highest peaks the nearest to truth, "
    "an oracle's choice. truth: from the mean aperture position. error: bearing - truth. height: share "
    "of the signal's power that the top peak explains. confidence: 1 if certain, 0 if a guess; "
    "out: one of the least confident 10 %."
)
_LEFT_OUT = " left out: packets of the motion that antenna A did not hear at both ends."


def _cells(link: Link, found: Bearing, *, out: bool) -> list[str]:
    """Texts of one line of the link table."""
    angles = np.rad2deg([found.azimuth_rad, closest_rad(link, found), link.truth_rad])
    cells = [link.set_name, link.place, link.transmitter, str(len(link.forward))]
    cells += ["-" if np.isnan(angle) else f"{angle:.1f}" for angle in angles]
    confidence = float(confidences(np.array([found.expected_error_rad]))[0])
    cells += [_error(found.azimuth_rad, link), f"{found.height:.2f}"]
    return [*cells, f"{'out ' * out}{confidence:.2f}"]


def _toolbox_cells(link: Link) -> list[str]:
    """What the toolbox answered, and its error; nothing where it did not."""
    if not link.toolbox_rad:
        return ["", ""]
    return [f"{np.rad2deg(link.toolbox_rad[0]):.1f}", _error(link.toolbox_rad[0], link)]


def _error(azimuth_rad: float, link: Link) -> str:
    """Its error in degrees; a dash where the truth is not known."""
    return f"{error_deg(azimuth_rad, link):+.1f}" if link.surveyed else "-"


def summary_table(links: Sequence[Link], bearings: Sequence[Bearing]) -> Table:
    """Median and mean |error| per set: top peak, of confident links, closest peak, the toolbox's top peak.

    Links whose truth is not known do not count.
    """
    known = [k for k, link in enumerate(links) if link.surveyed]
    out = rejected(bearings)[known]
    links, bearings = [links[k] for k in known], [bearings[k] for k in known]
    top = np.array([error_deg(found.azimuth_rad, link) for link, found in zip(links, bearings, strict=True)])
    errors = {
        "top peak": top,
        "confident": np.where(out, np.inf, top),
        "closest peak": [
            error_deg(closest_rad(link, b), link) for link, b in zip(links, bearings, strict=True)
        ],
        "toolbox": [error_deg(link.toolbox_rad[0], link) if link.toolbox_rad else np.nan for link in links],
    }
    table = Table(
        title="|error| in degrees, median / mean",
        caption="confident: without the least confident 10 % of all. closest peak: chosen by the truth",
    )
    for name in ("set", "links", *errors):
        table.add_column(name, justify="left" if name == "set" else "right")
    names = list(dict.fromkeys(link.set_name for link in links))
    for name in names + ["all"] * (len(names) > 1):
        rows = np.array([name in {"all", link.set_name} for link in links])
        texts = [_median_mean(np.abs(np.array(column)[rows])) for column in errors.values()]
        table.add_row(name, str(rows.sum()), *texts)
    return table


def _median_mean(values: Float[np.ndarray, " links"]) -> str:
    """Median and mean as text, without rejected links (inf); a dash where a value is missing."""
    values = values[values < np.inf] if np.isinf(values).any() else values
    if len(values) == 0:
        return "-"
    return "-" if np.isnan(values).any() else f"{np.median(values):.2f} / {values.mean():.2f}"
