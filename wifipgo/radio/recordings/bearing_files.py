"""Bearings of recordings as CSV and JSON, for other programs."""

import csv
import io
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from wifipgo.files.atomic_files import write_json, write_text
from wifipgo.radio.aoa.confidence import confidences
from wifipgo.radio.aoa.moving_aperture import Bearing
from wifipgo.radio.recordings.recorded_link import Link
from wifipgo.radio.recordings.report import error_deg, rejected

Value = str | int | float | bool | None


def bearing_rows(links: Sequence[Link], bearings: Sequence[Bearing]) -> list[dict[str, Value]]:
    """A row a link, angles in degrees in the map frame; nothing where no survey says what is true."""
    out = rejected(bearings)
    sure = confidences(np.array([found.expected_error_rad for found in bearings]))
    return [
        {
            "set": link.set_name,
            "place": link.place,
            "stamp": link.stamp,
            "transmitter": link.transmitter,
            "packets": len(link.forward),
            "left_out": link.n_left_out,
            "bearing_deg": math.degrees(found.azimuth_rad),
            "confidence": float(sure[k]),
            "expected_error_deg": math.degrees(found.expected_error_rad),
            "least_confident": bool(out[k]),
            "height": found.height,
            "truth_deg": math.degrees(link.truth_rad) if link.surveyed else None,
            "error_deg": error_deg(found.azimuth_rad, link) if link.surveyed else None,
        }
        for k, (link, found) in enumerate(zip(links, bearings, strict=True))
    ]


def write_bearings(links: Sequence[Link], bearings: Sequence[Bearing], stem: Path) -> list[Path]:
    """Write ``stem.csv``, a line a link, and ``stem.json``, with all peaks and their heights too.

    Returns:
        The two files.
    """
    rows = bearing_rows(links, bearings)
    files = [stem.with_name(f"{stem.name}.csv"), stem.with_name(f"{stem.name}.json")]
    write_text(files[0], as_csv(rows))
    write_json(
        files[1],
        [row | {"peaks": _peaks(found)} for row, found in zip(rows, bearings, strict=True)],
    )
    return files


def as_csv(rows: Sequence[dict[str, Value]]) -> str:
    """Rows under the names of their columns; what is not there is empty."""
    text = io.StringIO()
    table = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    table.writeheader()
    table.writerows(rows)
    return text.getvalue()


def _peaks(found: Bearing) -> list[dict[str, float]]:
    """Peaks of the profile, highest first."""
    azimuths, heights = found.peaks.azimuth_rad[0], found.peaks.height[0]
    return [
        {"azimuth_deg": math.degrees(azimuth), "height": float(height)}
        for azimuth, height in zip(azimuths, heights, strict=True)
        if height > 0.0
    ]
