"""One link of a recording: what both ends measured while the receiver moved, and where the other end is."""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Complex, Float

from wifipgo.errors import BadInputError
from wifipgo.radio.aoa.moving_aperture import ApertureConfig, Bearing, aperture_bearing
from wifipgo.radio.propagation.materials import SPEED_OF_LIGHT_M_S


@dataclass(frozen=True, slots=True, kw_only=True)
class Link:
    """The packets that a fixed transmitter and a moving receiver exchanged."""

    set_name: str
    place: str
    stamp: str
    transmitter: str
    forward: Complex[np.ndarray, "packets subcarriers"]  # at the receiver, antenna A
    reverse: Complex[np.ndarray, "packets subcarriers"]  # at the transmitter, antenna A
    displacement_m: Float[np.ndarray, "packets 3"]  # of the receiver since its first move, map frame
    wavelength_m: float
    truth_rad: float  # azimuth in the map frame, from the mean aperture position; nan without a survey
    toolbox_rad: tuple[float, ...] = ()  # the toolbox's released peaks, its top one first
    n_left_out: int = 0  # packets during the motion that antenna A did not hear at both ends

    @property
    def surveyed(self) -> bool:
        """Whether it is known where the transmitter is."""
        return not math.isnan(self.truth_rad)


def bearing(link: Link, cfg: ApertureConfig | None = None) -> Bearing:
    """Bearing of a link's transmitter in the map frame, with its profile and peaks."""
    return aperture_bearing(
        link.forward * link.reverse, link.displacement_m, wavelength_m=link.wavelength_m, cfg=cfg
    )


def wavelength_m(channel: int) -> float:
    """Wavelength of a 5 GHz Wi-Fi channel, m."""
    return SPEED_OF_LIGHT_M_S / (5.0e9 + 5.0e6 * channel)


def check_enough(
    kept: Bool[np.ndarray, " packets"], moving: Bool[np.ndarray, " packets"], field: str
) -> None:
    """Refuse what says nothing about a direction."""
    n_kept, n_moving = np.count_nonzero(kept), np.count_nonzero(moving)
    if n_kept < 2:
        rule = "must hear two packets or more while the receiver moves"
        raise BadInputError(f"{field} {rule}, got {n_kept} of {n_moving}")
