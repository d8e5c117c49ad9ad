"""Real links of the packed recordings, and how wrong their bearings are; none where there are no data."""

from functools import cache

import numpy as np
import pandas as pd

from wifipgo.data import public_data
from wifipgo.radio.recordings.recorded_link import Link, bearing
from wifipgo.radio.recordings.wsr_dataset import read_links
from wifipgo.se2 import wrap_angle

RECORDINGS = "wsr_slim_dev.npz"
ABSENT = f"wsr/{RECORDINGS} is not in the folder of data (WIFIPGO_DATA)"


def recorded() -> list[Link]:
    """Real links, if the data is there."""
    pack = public_data() / "wsr" / RECORDINGS
    return read_links(pack) if pack.is_file() else []


def recorded_errors(links: list[Link]) -> pd.DataFrame:
    """Error of the top peak of every real link, degrees."""
    errors_rad = np.array([bearing(link).azimuth_rad - link.truth_rad for link in links], dtype=float)
    return pd.DataFrame(
        {
            "set": [link.set_name for link in links],
            "transmitter": [link.transmitter for link in links],
            "azimuth_error_deg": np.rad2deg(wrap_angle(errors_rad)),
        }
    )


@cache
def errors_by_sight() -> tuple[np.ndarray, np.ndarray] | None:
    """Errors of real bearings in sight and beyond it, rad; none without recordings of both.

    Links that were recorded in one place are wrong alike; drawn one by one they are kinder than one place is.
    """
    found = recorded_errors(recorded())
    beyond = found["set"].str.upper().str.contains("NLOS").to_numpy(bool)
    errors_rad = np.deg2rad(found["azimuth_error_deg"].to_numpy(float))
    parts = errors_rad[~beyond], errors_rad[beyond]
    return parts if all(map(len, parts)) else None
