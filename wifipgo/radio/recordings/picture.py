"""Picture of bearings from recordings: one polar profile a link. The only room of the radio that draws."""

from collections.abc import Sequence
from pathlib import Path

from wifipgo.command.figures import Axes, Figure

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist

from wifipgo.command.palette import BLUE, FRAME, GREY, GRID, SKY, VERMILION
from wifipgo.radio.aoa import azimuth_grid
from wifipgo.radio.aoa.moving_aperture import Bearing
from wifipgo.radio.recordings.recorded_link import Link
from wifipgo.radio.recordings.report import error_deg, rejected

OURS, OUT, TRUTH, TOOLBOX, OTHER = BLUE, GREY, VERMILION, "black", SKY


def save_picture(links: Sequence[Link], bearings: Sequence[Bearing], path: Path, *, title: str) -> None:
    """Save one polar profile a link: truth, top peak, other peaks and the toolbox's answer."""
    n_columns = min(len(links), 5 if len(links) > 6 else 3)
    n_rows = -(-len(links) // n_columns)
    size = (2.7 * n_columns + 0.4, 3.05 * n_rows + 1.3)
    with mpl.rc_context({"font.size": 9, "axes.titlesize": 10.5, "axes.edgecolor": FRAME}):
        figure = Figure(figsize=size, layout="constrained")
        grid = figure.subplots(n_rows, n_columns, squeeze=False, subplot_kw={"projection": "polar"})
        for axes, link, found, out in zip(grid.flat, links, bearings, rejected(bearings), strict=False):
            _draw_link(axes, link, found, out=bool(out))
        for axes in grid.flat[len(links) :]:
            axes.set_visible(False)
        figure.suptitle(
            f"{title}: bearing profiles; in the titles, bearing minus truth", fontsize=13, wrap=True
        )
        entries: dict[str, Artist] = {}
        for axes in grid.flat[: len(links)]:
            entries |= dict(zip(*axes.get_legend_handles_labels()[::-1], strict=True))
        figure.legend(
            list(entries.values()),
            list(entries),
            loc="outside lower center",
            ncols=3,
            frameon=False,
            fontsize=10.5,
            markerscale=1.2,
        )
        figure.savefig(path, dpi=110)


def _draw_link(axes: Axes, link: Link, found: Bearing, *, out: bool) -> None:
    """Profile of one link over the circle, scaled to its top peak; grey if it is rejected."""
    ours, what = (OUT, "profile of a rejected link") if out else (OURS, "profile")
    scale = max(found.height, float(np.finfo(float).tiny))
    share = np.append(found.profile, found.profile[0]) / scale
    azimuth_rad = np.append(azimuth_grid(len(found.profile)), np.pi)
    seen = found.peaks.height[0] > 0.0
    others_rad, heights = found.peaks.azimuth_rad[0, seen][1:], found.peaks.height[0, seen][1:]
    if link.surveyed:
        label = "truth (from the mean position)"
        axes.plot([link.truth_rad] * 2, [0.0, 1.3], color=TRUTH, linewidth=2.2, label=label)
    axes.fill(azimuth_rad, share, color=ours, alpha=0.18, linewidth=0)
    axes.plot(azimuth_rad, share, color=ours, linewidth=0.9, label=f"{what}, share of its peak")
    fill = "white" if out else ours
    label = "its top peak: least confident 10 %" if out else "top peak: the bearing"
    axes.plot(found.azimuth_rad, 1.0, "o", mfc=fill, mec=ours, mew=1.5, markersize=7, label=label)
    axes.plot(others_rad, heights / scale, "o", color=OTHER, markersize=4, label="other peaks")
    if link.toolbox_rad:
        axes.plot(link.toolbox_rad[0], 1.18, "x", color=TOOLBOX, ms=6, mew=1.8, label="toolbox's answer")
    axes.set_ylim(0.0, 1.3)
    axes.set_yticks([0.5, 1.0], labels=["0.5", "1"], color=GREY, fontsize=7)
    toward_rad = link.truth_rad if link.surveyed else found.azimuth_rad
    axes.set(rlabel_position=np.rad2deg(toward_rad) + 180.0)  # where the profile is low
    axes.set_xticks(np.deg2rad([0, 90, 180, 270]), labels=["0°", "90°", "180°", "-90°"], color=GREY)
    axes.tick_params(pad=-3)
    axes.grid(color=GRID)
    told = f"{error_deg(found.azimuth_rad, link):+.1f}°" if link.surveyed else "not surveyed"
    place = f"place {link.place}, {link.transmitter}: {told}"
    place += " (rejected)" * out
    axes.set_title(f"{link.set_name}\n{place}")
