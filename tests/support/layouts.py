"""Whether a figure can be read: its texts lie in it, and none covers another or is covered by a legend."""

from collections.abc import Iterator, Sequence
from io import BytesIO
from itertools import combinations
from typing import Any

import numpy as np
import pytest
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.text import Text
from matplotlib.transforms import Bbox
from PIL import Image

SLACK_PX = 1.5


def shown(artists: Sequence[Artist]) -> Iterator[Text]:
    """Texts that are drawn, at any depth."""
    for artist in artists:
        if artist.get_visible() and not (isinstance(artist, Axes) and not artist.axison):
            if isinstance(artist, Text) and artist.get_text().strip():
                yield artist
            yield from shown(artist.get_children())


def boxes(figure: Figure) -> dict[Text, Bbox]:
    """Where each text lies, px."""
    figure.draw_without_rendering()
    found = {text: text.get_window_extent() for text in shown(figure.get_children())}
    ticks = {text for axes in figure.axes for text in _out_of_range(axes)}
    return {text: box for text, box in found.items() if text not in ticks}


def _out_of_range(axes: Axes) -> Iterator[Text]:
    """Labels of ticks beyond the limits: matplotlib has them, but does not draw them."""
    both: tuple[Any, Any] = axes.xaxis, axes.yaxis
    for axis in both:
        drawn = {id(tick) for tick in axis._update_ticks()}
        for tick in (*axis.majorTicks, *axis.minorTicks):
            if id(tick) not in drawn:
                yield from (tick.label1, tick.label2)


def assert_readable(figure: Figure) -> None:
    """Every text is inside the figure, apart from every other, and no legend lies over a curve."""
    placed, whole = boxes(figure), figure.bbox.padded(SLACK_PX)
    for text, box in placed.items():
        inside = whole.x0 <= box.x0 and box.x1 <= whole.x1 and whole.y0 <= box.y0 and box.y1 <= whole.y1
        assert inside, f"cut: {text.get_text()!r} {box} {whole}"
    for (one, a), (other, b) in combinations(placed.items(), 2):
        both = Bbox.intersection(a, b)
        over = both is not None and min(both.width, both.height) > SLACK_PX
        assert not over, f"{one.get_text()!r} over {other.get_text()!r}"
    for axes in figure.axes:
        for legend in (child for child in axes.get_children() if isinstance(child, Legend)):
            assert not _covered(axes, legend.get_window_extent()), axes.get_title()


def _covered(axes: Axes, box: Bbox) -> bool:
    """Whether a curve of the axes runs through a box."""
    drawn: list[Any] = [line for line in axes.lines if line.get_linestyle() != "None"]
    marked: list[Any] = [line for line in axes.lines if line.get_marker() not in ("None", "", None)]
    for line in marked:
        places = line.get_transform().transform(np.column_stack(line.get_data()).astype(float))
        if any(box.contains(x, y) for x, y in places):
            return True
    paths = [line.get_transform().transform_path(line.get_path()) for line in drawn]
    bands: list[Any] = [each for each in axes.collections if isinstance(each, PolyCollection)]
    paths += [each.get_transform().transform_path(path) for each in bands for path in each.get_paths()]
    return any(
        path.intersects_bbox(box, filled=False) for path in paths if len(np.asarray(path.vertices)) > 1
    )


def saved_figures(monkeypatch: pytest.MonkeyPatch) -> list[Figure]:
    """Take figures, instead of files, from whoever saves some in this test."""
    figures: list[Figure] = []

    def take(self: Figure, target: object, **_: object) -> None:
        figures.append(self)
        if isinstance(target, BytesIO):
            Image.new("RGB", (1, 1)).save(target, format="PNG")

    monkeypatch.setattr(Figure, "savefig", take)
    return figures


def curves(n_trials: int, n_iterations: int, rng: np.random.Generator) -> np.ndarray:
    """Something that rises, a row a trial."""
    return np.cumsum(rng.uniform(0.0, 1.0 / n_iterations, (n_trials, n_iterations)), axis=1)
