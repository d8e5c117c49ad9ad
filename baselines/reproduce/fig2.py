"""Fig. 2: a profile over azimuth and elevation and what it says from above, simulated and recorded."""

from pathlib import Path
from typing import NamedTuple

from wifipgo.command.figures import Figure

import numpy as np
import pandas as pd
from jaxtyping import Complex, Float

from baselines.evaluation.intervals import Estimate, median_of
from baselines.reproduce import _draw, _rules
from baselines.reproduce._claims import BESIDE, Claim, Found, Sentence, judged, missing, row
from baselines.reproduce._recordings import ABSENT, recorded, recorded_errors
from baselines.reproduce._runs import TRIALS, Setting
from wifipgo.command.palette import VERMILION
from wifipgo.graph.outliers.aoa_weights import PAPER_GATE_RAD
from wifipgo.radio import aoa
from wifipgo.radio.channel import csi
from wifipgo.radio.recordings.recorded_link import Link, bearing
from wifipgo.se2 import wrap_angle

__all__ = ["SENTENCES", "TITLE", "TRIALS", "claims", "make", "tasks"]

TITLE = "Signal profile over azimuth and elevation"
AZIMUTH = Sentence(
    "fig2.azimuth",
    "The highest peak of the profile captures the direction of arrival (azimuth).",
    "Sec. 4, Fig. 2, Eq. 6",
)
ELEVATION = Sentence(
    "fig2.elevation",
    "The profile captures the direction of arrival in 3D (elevation).",
    "Sec. 4, Fig. 2, Eq. 6",
)
SENTENCES = (AZIMUTH, ELEVATION)
RADIO, TURN = csi.RadioConfig(), aoa.AoaConfig()
ELEVATIONS_RAD = np.deg2rad(np.arange(0.0, 61.0))
SHOWN_RAD = np.deg2rad([60.0, 25.0])  # direct path in the picture
SNR = 100.0
ECHO_AMPLITUDES = (0.4, 0.3)  # 6 dB below the direct path together, in the plane, from anywhere


class Heard(NamedTuple):
    """Profiles of quarter turns."""

    profile: Float[np.ndarray, "links elevations azimuths"]
    azimuth_rad: Float[np.ndarray, " links"]
    elevation_rad: Float[np.ndarray, " links"]
    found: aoa.Directions


def tasks(setting: Setting) -> list[object]:
    """Nothing to run beforehand."""
    return []


def make(setting: Setting, folder: Path) -> list[Claim]:
    """Draw, write the data, judge."""
    links = recorded()
    heard = _turns(setting)
    errors_deg, recorded_deg = _simulated(heard), recorded_errors(links)
    errors_deg.to_parquet(folder / "simulated.parquet", index=False)
    recorded_deg.to_parquet(folder / "recorded.parquet", index=False)
    _draw_profiles(folder / "fig2.png", heard, links)
    return [_azimuths(errors_deg, recorded_deg), _elevations(errors_deg)]


def claims(setting: Setting) -> list[Claim]:
    """Judge only."""
    errors_deg = _simulated(_turns(setting))
    return [_azimuths(errors_deg, recorded_errors(recorded())), _elevations(errors_deg)]


def _turns(setting: Setting) -> Heard:
    """A turn for each seed; the first one is the picture's."""
    rngs = [np.random.default_rng(world.seed) for world in setting.worlds()]
    drawn = np.array([rng.uniform([-np.pi, 0.0], [np.pi, np.deg2rad(40.0)]) for rng in rngs])
    drawn[0] = SHOWN_RAD
    received = np.concatenate(
        [_received(a, e, rng) for (a, e), rng in zip(drawn.tolist(), rngs, strict=True)]
    )
    pair = aoa.turning_pair(
        aoa.turn_headings(TURN), antenna_gap_m=TURN.antenna_gap_m, wavelength_m=RADIO.wavelength_m
    )
    grid = aoa.azimuth_grid(TURN.n_azimuths)
    profile = aoa.profiles(
        aoa.product_signal(received), pair, azimuths_rad=grid, elevations_rad=ELEVATIONS_RAD
    )
    found = aoa.find_directions(profile, ELEVATIONS_RAD, n_peaks=1)
    return Heard(profile, drawn[:, 0], drawn[:, 1], found)


def _received(
    azimuth_rad: float, elevation_rad: float, rng: np.random.Generator
) -> Complex[np.ndarray, "1 2 positions subcarriers"]:
    """CSI of one turn: the simulator's world is a plane, so these paths are put together here."""
    half = aoa.turning_pair(
        aoa.turn_headings(TURN), antenna_gap_m=0.5 * TURN.antenna_gap_m, wavelength_m=RADIO.wavelength_m
    )
    echoes_rad, phases = rng.uniform(-np.pi, np.pi, 2), np.exp(1j * rng.uniform(-np.pi, np.pi, 2))
    directions = [(azimuth_rad, elevation_rad), *((float(echo), 0.0) for echo in echoes_rad)]
    waves = [half.steering(np.array([a]), elevation_rad=e)[:, 0] for a, e in directions]
    amplitude = np.array([1.0, *(ECHO_AMPLITUDES * phases)])
    delay_s = np.array([0.0, *rng.uniform(20e-9, 90e-9, 2)])
    ahead, behind = np.array(waves).T * amplitude, np.array(waves).conj().T * amplitude
    channel = np.stack([ahead, behind])[None] @ csi.subcarrier_phasors(delay_s[None])[0]
    return csi.received_csi(channel.astype(np.complex64), snr_scale=SNR, rng=rng)


def _simulated(heard: Heard) -> pd.DataFrame:
    """Truth and answer of every turn, degrees."""
    found = heard.found
    return pd.DataFrame(
        {
            "azimuth_deg": np.rad2deg(heard.azimuth_rad),
            "elevation_deg": np.rad2deg(heard.elevation_rad),
            "azimuth_error_deg": np.rad2deg(wrap_angle(found.azimuth_rad[:, 0] - heard.azimuth_rad)),
            "elevation_error_deg": np.rad2deg(found.elevation_rad[:, 0] - heard.elevation_rad),
        }
    )


def _draw_profiles(path: Path, heard: Heard, links: list[Link]) -> None:
    """The map, the same from above, and the first real link from above, each scaled to its highest peak."""
    with _draw.page(path, (10.4, 3.7)) as figure:
        widths = [1.5, 1.0, 1.0] if links else [1.5, 1.0]
        grid = figure.add_gridspec(1, len(widths), width_ratios=widths)
        _draw_map(figure, grid[0], heard)
        top = heard.profile[0].max(axis=0)
        _draw_polar(figure, grid[1], top, SHOWN_RAD[0], "simulated, from above")
        if links:
            title = f"recorded ({links[0].set_name}), from above"
            _draw_polar(figure, grid[2], bearing(links[0]).profile, links[0].truth_rad, title)
        _draw.key(figure)


def _draw_map(figure: Figure, place: object, heard: Heard) -> None:
    """Profile over azimuth and elevation, truth and top peak marked."""
    axes = figure.add_subplot(place)  # type: ignore[call-overload]
    top = float(np.rad2deg(ELEVATIONS_RAD[-1]))
    image = axes.imshow(
        heard.profile[0], origin="lower", aspect="auto", extent=(-180.0, 180.0, 0.0, top), cmap="cividis"
    )
    peak = np.rad2deg([heard.found.azimuth_rad[0, 0], heard.found.elevation_rad[0, 0]])
    axes.plot(*np.rad2deg(SHOWN_RAD), "+", color=VERMILION, ms=13, mew=1.8, label="direct path (map)")
    axes.plot(*peak, "o", mfc="none", mec="black", ms=9, mew=1.2, label="highest peak, Eq. 6 (map)")
    axes.set(xlabel="azimuth (deg)", ylabel="elevation (deg)", xticks=range(-180, 181, 60), ylim=(0, top))
    axes.set_title("simulated quarter turn, 20 dB, two echoes", loc="left", fontsize=9)
    figure.colorbar(image, ax=axes, label="profile: share of power")


def _draw_polar(figure: Figure, place: object, profile: np.ndarray, truth_rad: float, title: str) -> None:
    """Profile over azimuth and the true direction."""
    axes = figure.add_subplot(place, projection="polar")  # type: ignore[call-overload]
    highest = float(profile.max())
    closed, share = np.append(aoa.azimuth_grid(len(profile)), np.pi), np.append(profile, profile[0]) / highest
    axes.plot(closed, share, color=_draw.LOOKS["active"][0], label="profile (from above)")
    axes.plot([truth_rad, truth_rad], [0.0, 1.0], ":", color=VERMILION, lw=1.8, label="truth (from above)")
    axes.set_title(title, fontsize=9)
    axes.set_xlabel(f"radius: share of the peak,\nwhich is {highest:.2g} of the power", fontsize=8)
    axes.set_rticks([0.5, 1.0])
    axes.set_rlabel_position(np.rad2deg(truth_rad) + 180.0)  # where the profile is low
    axes.set_xticks(np.deg2rad(range(0, 360, 90)), ["0°", "90°", "180°", "-90°"])
    axes.tick_params(labelsize=7)


def _median(errors_deg: pd.Series) -> Estimate:
    """Median distance from the truth, degrees."""
    return median_of(np.abs(errors_deg.to_numpy(float)))


def _azimuths(simulated: pd.DataFrame, real: pd.DataFrame) -> Claim:
    return judged(
        AZIMUTH,
        quantity="median distance of the highest peak from the true azimuth",
        unit=" deg",
        rule=_rules.at_most(round(_GATE_DEG, 1), " deg"),
        found=[
            row(
                "simulated quarter turn, two echoes 6 dB below, 20 dB SNR",
                _median,
                simulated.azimuth_error_deg,
                note=f"median |error|; {_within(simulated)}",
            ),
            _on_recordings(real),
        ],
    )


def _on_recordings(real: pd.DataFrame) -> Found:
    """The same of real links, if they are there."""
    conditions = "real recordings, moving antenna, motion-capture truth"
    if real.empty:
        return missing(conditions, ABSENT)
    return row(conditions, _median, real.azimuth_error_deg, note=f"links, not seeds; {_within(real)}")


def _within(errors: pd.DataFrame) -> str:
    share = 100 * float((errors.azimuth_error_deg.abs() <= _GATE_DEG).mean())
    return f"{share:.0f} % of the peaks within {_GATE_DEG:.1f} deg"


_GATE_DEG = float(np.rad2deg(PAPER_GATE_RAD))


def _elevations(simulated: pd.DataFrame) -> Claim:
    steep = simulated[simulated.elevation_deg >= 15.0]
    return judged(
        ELEVATION,
        quantity="median distance of the highest peak from the true elevation",
        unit=" deg",
        rule=_rules.at_most(round(_GATE_DEG, 1), " deg"),
        found=[
            row(
                "simulated quarter turn, elevations of 0 to 40 deg",
                _median,
                simulated.elevation_error_deg,
                note="a turn in the plane cannot tell up from down; elevations are taken as upward",
            ),
            row("of these, elevations of 15 deg and more", _median, steep.elevation_error_deg, role=BESIDE),
        ],
    )
