"""Picture of bearings from recordings: one polar profile a link. The only room of the radio that draws."""

from collections.abc import Sequence
from pathlib import Path

from wifipgo.command.figures import Axes, Figure

import matplotlib as mpl
import numpy as np

from wifipgo.command.palette import BLUE, FRAME, GREY, GRID, SKY, VERMILION
from wifipgo.radio.aoa import azimuth_grid
from wifipgo.radio.aoa.moving_aperture import Bearing
from wifipgo.radio.recordings.recorded_link import Link
from wifipgo.radio.recordings.report import error_deg

OURS, TRUTH, TOOLBOX, OTHER = BLUE, VERMILION, GREY, SKY


def save_picture(links: Sequence[Link], bearings: Sequence[Bearing], path: Path, *, title: str) -> None:
    """Save one polar profile a link: truth, top peak, other peaks and the toolbox's answer."""
    n_columns = min(len(links), 5 if len(links) > 6 else 3)
    n_rows = -(-len(links) // n_columns)
    size = (2.7 * n_columns + 0.4, 3.05 * n_rows + 1.3)
    with mpl.rc_context({"font.size": 9, "axes.titlesize": 10.5, "axes.edgecolor": FRAME}):
        figure = Figure(figsize=size, layout="constrained")
        grid = figure.subplots(n_rows, n_columns, squeeze=False, subplot_kw={"projection": "polar"})
        for axes, link, found in zip(grid.flat, links, bearings, strict=False):
            _draw_link(axes, link, found)
        for axes in grid.flat[len(links) :]:
            axes.set_visible(False)
        figure.suptitle(f"{title}: bearing profiles; in the titles, bearing minus truth", fontsize=13)
        handles, labels = grid.flat[0].get_legend_handles_labels()
        figure.legend(
            handles,
            labels,
            loc="outside lower center",
            ncols=3,
            frameon=False,
            fontsize=10.5,
            markerscale=1.2,
        )
        figure.savefig(path, dpi=110)


def _draw_link(axes: Axes, link: Link, found: Bearing) -> None:
    """Profile of one link over the circle, scaled to its top peak."""
    scale = max(found.height, float(np.finfo(float).tiny))
    share = np.append(found.profile, found.profile[0]) / scale
    azimuth_rad = np.append(azimuth_grid(len(found.profile)), np.pi)
    seen = found.peaks.height[0] > 0.0
    others_rad, heights = found.peaks.azimuth_rad[0, seen][1:], found.peaks.height[0, seen][1:]
    axes.plot(
        [link.truth_rad] * 2, [0.0, 1.3], color=TRUTH, linewidth=2.2, label="truth (from the mean position)"
    )
    axes.fill(azimuth_rad, share, color=OURS, alpha=0.18, linewidth=0)
    axes.plot(azimuth_rad, share, color=OURS, linewidth=0.9, label="profile, share of power")
    axes.plot(found.azimuth_rad, 1.0, "o", color=OURS, markersize=7, label="top peak: the bearing")
    axes.plot(others_rad, heights / scale, "o", color=OTHER, markersize=4, label="other peaks")
    if link.toolbox_rad:
        axes.plot(
            link.toolbox_rad[0],
            1.18,
            "x",
            color=TOOLBOX,
            markersize=6,
            markeredgewidth=1.8,
            label="toolbox's answer",
        )
    axes.set_ylim(0.0, 1.3)
    axes.set_yticks([0.5, 1.0], labels=[])
    axes.set_xticks(np.deg2rad([0, 90, 180, 270]), labels=["0°", "90°", "180°", "-90°"], color=GREY)
    axes.tick_params(pad=-3)
    axes.grid(color=GRID)
    place = f"place {link.place}, {link.transmitter}: {error_deg(found.azimuth_rad, link):+.1f}°"
    axes.set_title(f"{link.set_name}\n{place}")
