"""One profile to look at: over azimuth and elevation, and over azimuth from above (paper Fig. 2).

Run: ``wifipgo bench aoa_profile [--picture PNG] [--json OUT]``. A robot makes a quarter turn
on the spot. The direct path comes from 60 degrees to the left and 25 degrees above, two echoes
from elsewhere in the plane, 6 dB below it together; 20 dB SNR.
"""

import os

for _variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_variable, "1")

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from wifipgo.command.figures import Figure, drawing

import matplotlib as mpl
import numpy as np
import tyro
from jaxtyping import Complex, Float

from wifipgo.command.command_line import exit_code
from wifipgo.command.palette import BLUE, VERMILION
from wifipgo.command.terminal import Terminal
from wifipgo.files.atomic_files import write_json
from wifipgo.radio import aoa
from wifipgo.radio.aoa.confidence import confidence
from wifipgo.radio.channel import csi

RADIO, TURN = csi.RadioConfig(), aoa.AoaConfig()
AZIMUTH_RAD = np.deg2rad([60.0, -100.0, 165.0])
ELEVATION_RAD = np.deg2rad([25.0, 0.0, 0.0])
AMPLITUDE = np.array([1.0, 0.4, 0.3j])  # echoes 6 dB below the direct path, together
DELAY_S = np.array([0.0, 40e-9, 75e-9])
ELEVATIONS_RAD = np.deg2rad(np.arange(0.0, 90.0))
SNR = 100.0


@dataclass(frozen=True, slots=True, kw_only=True)
class ProfileConfig:
    """Where to write."""

    picture: Annotated[Path, tyro.conf.arg(help="Picture file.")] = Path("results/aoa_profile.png")
    json: Annotated[Path | None, tyro.conf.arg(help="Also write the peaks to this file.")] = None


def received() -> Complex[np.ndarray, "1 2 positions subcarriers"]:
    """CSI of the turn: the simulator's world is a plane, so these paths are put together here."""
    half = aoa.turning_pair(
        aoa.turn_headings(TURN), antenna_gap_m=0.5 * TURN.antenna_gap_m, wavelength_m=RADIO.wavelength_m
    )
    waves = [
        half.steering(AZIMUTH_RAD[k : k + 1], elevation_rad=float(ELEVATION_RAD[k]))[:, 0]
        for k in range(len(AZIMUTH_RAD))
    ]
    ahead = np.array(waves).T * AMPLITUDE
    behind = np.array(waves).conj().T * AMPLITUDE
    channel = np.stack([ahead, behind])[None] @ csi.subcarrier_phasors(DELAY_S[None])[0]
    return csi.received_csi(channel.astype(np.complex64), snr_scale=SNR, rng=np.random.default_rng(0))


def profile_of_turn() -> Float[np.ndarray, "1 elevations azimuths"]:
    """The default estimator over azimuth and elevation."""
    pair = aoa.turning_pair(
        aoa.turn_headings(TURN), antenna_gap_m=TURN.antenna_gap_m, wavelength_m=RADIO.wavelength_m
    )
    grid = aoa.azimuth_grid(TURN.n_azimuths)
    return aoa.profiles(
        aoa.product_signal(received()), pair, azimuths_rad=grid, elevations_rad=ELEVATIONS_RAD
    )


def draw(path: Path, profile: np.ndarray, found: aoa.Directions) -> None:
    """The map, and what is seen from above: elevation 0 beside the highest over elevation."""
    azimuths_rad = aoa.azimuth_grid(profile.shape[2])
    with mpl.rc_context({"font.size": 9}):
        figure = Figure(figsize=(9.0, 3.9), dpi=100, layout="constrained")
        left, right = figure.add_subplot(1, 2, 1), figure.add_subplot(1, 2, 2, projection="polar")
        image = left.imshow(
            profile[0], origin="lower", aspect="auto", extent=(-180.0, 180.0, 0.0, 90.0), cmap="cividis"
        )
        left.plot(
            *np.rad2deg([AZIMUTH_RAD[:1], ELEVATION_RAD[:1]]), "r+", ms=14, mew=1.5, label="direct path"
        )
        left.plot(
            *np.rad2deg([found.azimuth_rad[0, :1], found.elevation_rad[0, :1]]),
            "ko",
            mfc="none",
            ms=9,
            label="top peak",
        )
        left.set(xlabel="azimuth (°)", ylabel="elevation (°)", xticks=range(-180, 181, 60))
        figure.colorbar(image, ax=left, label="share of power")
        right.plot(azimuths_rad, profile[0].max(axis=0), color=BLUE, label="highest over elevation")
        right.plot(azimuths_rad, profile[0, 0], color=VERMILION, lw=1.0, label="elevation 0")
        right.vlines(AZIMUTH_RAD[:1], 0.0, 1.0, color="r", ls=":", label="direct path")
        right.set_yticks([0.5, 1.0])
        right.set(rlabel_position=np.rad2deg(AZIMUTH_RAD[0]) + 180.0)  # where the profile is low
        right.tick_params(labelsize=8)
        style: Any = {"ncols": 3, "fontsize": 8, "frameon": False}
        figure.legend(*left.get_legend_handles_labels(), loc="outside lower left", **style)
        figure.legend(*right.get_legend_handles_labels(), loc="outside lower right", **style)
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path)


def main(config: ProfileConfig) -> None:
    """Make the profile, say what is in it, draw."""
    profile, console = profile_of_turn(), Terminal()
    found = aoa.find_directions(profile, ELEVATIONS_RAD, n_peaks=2)
    flat = aoa.find_peaks(profile[:, 0], n_peaks=1)
    trust = confidence(profile.max(axis=1))
    content = {
        "true_deg": np.rad2deg([AZIMUTH_RAD[0], ELEVATION_RAD[0]]).tolist(),
        "top_peak_deg": np.rad2deg([found.azimuth_rad[0, 0], found.elevation_rad[0, 0]]).tolist(),
        "top_peak_at_elevation_0_deg": float(np.rad2deg(flat.azimuth_rad[0, 0])),
        "width_deg": float(np.rad2deg(trust.width_rad[0])),
        "sidelobe_ratio": float(trust.sidelobe_ratio[0]),
        "variance": float(trust.variance[0]),
    }
    for name, value in content.items():
        console.print(f"{name:28s} {np.round(value, 3)}")
    with drawing(config.picture, asked_for=True):
        draw(config.picture, profile, found)
    if config.json is not None:
        write_json(config.json, content, allow_nan=True)


if __name__ == "__main__":
    sys.exit(exit_code(lambda: main(tyro.cli(ProfileConfig, description=__doc__))))
