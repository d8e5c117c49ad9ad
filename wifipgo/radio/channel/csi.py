"""Channel state information of one to three antennas on a moving robot, from propagation paths.

Every packet gives one complex number per antenna and subcarrier: the sum over paths. The
paths stay as they are while the robot turns or moves a little, so AOA errors come out of the
geometry and repeat at the same poses. What the receiver does to it: `wifipgo.radio.channel.receiver`.
"""

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Complex, Complex64, Float

from wifipgo.arithmetic import harmless_underflow
from wifipgo.errors import require, require_within
from wifipgo.radio.channel.bands import BANDS, SUBCARRIER_SPACING_HZ
from wifipgo.radio.channel.receiver import received_csi, white_noise
from wifipgo.radio.channel.subcarriers import (
    centre_channel,
    subcarrier_phasors,
    within_a_turn,
)
from wifipgo.radio.propagation.materials import SPEED_OF_LIGHT_M_S
from wifipgo.radio.propagation.paths import Paths

__all__ = [
    "REPORTED_SUBCARRIERS",
    "SUBCARRIER_SPACING_HZ",
    "RadioConfig",
    "antenna_offsets",
    "array_csi",
    "centre_channel",
    "pair_csi",
    "received_csi",
    "subcarrier_phasors",
    "white_noise",
]

THERMAL_NOISE_DBM_PER_HZ = -174.0
# Those of a 20 MHz channel; others in `wifipgo.radio.channel.bands`.
REPORTED_SUBCARRIERS = BANDS[20e6].subcarriers
# Paths that products add up at a time: of so many, or a multiple, zeros behind change no bit of a sum.
_PATHS_AT_ONCE = 8
_MAX_ANTENNAS = 3  # as many as an Intel 5300 has
# No robot comes near; beyond, phases lose their digits and directions between antennas their meaning.
FARTHEST_ANTENNA_M, CLOSEST_ANTENNAS_M = 10.0, 1e-4


@dataclass(frozen=True, slots=True, kw_only=True)
class RadioConfig:
    """Transmitter and receiver. 5 GHz band and Intel 5300: paper Sec. 7.2.1; powers are ours.

    Attributes:
        carrier_hz: Middle of the channel.
        bandwidth_hz: Width of the channel, 20 or 40 MHz.
        tx_power_dbm: Power sent, over the whole channel.
        noise_figure_db: Of the receiver.
        max_order: Most reflections of a path.
        penetration: Whether paths go on through obstacles.
        diffraction: Whether paths bend, once, at edges of obstacles.
        antennas_m: One to three receive antennas (x ahead, y left) in the body frame; none for
            the pair of `wifipgo.radio.aoa.AoaConfig` along the heading.
        front_to_back_db: How much less an antenna hears from behind the body than from its own side.
        antenna_coupling: Share, in amplitude, of what the other antennas hear that is heard along; 0.04 by
            Friis for half-wave dipoles 22 cm apart at 5 GHz.
    """

    carrier_hz: float = 5.0e9
    bandwidth_hz: float = 20e6
    tx_power_dbm: float = -8.0
    noise_figure_db: float = 6.0
    max_order: int = 1
    penetration: bool = True
    diffraction: bool = False
    antennas_m: tuple[Sequence[float], ...] = ()
    front_to_back_db: float = 0.0
    antenna_coupling: float = 0.0

    def __post_init__(self) -> None:
        """Reject values that cannot mean anything."""
        limits = {"carrier_hz": (1e9, 10e9), "tx_power_dbm": (-60.0, 30.0), "noise_figure_db": (0.0, 30.0)}
        limits |= {"front_to_back_db": (0.0, 40.0), "antenna_coupling": (0.0, 0.5)}
        require_within(self, limits)
        require(self.max_order in {0, 1, 2}, "RadioConfig.max_order", "0, 1 or 2", self.max_order)
        require(self.bandwidth_hz in BANDS, "RadioConfig.bandwidth_hz", "20e6 or 40e6", self.bandwidth_hz)
        object.__setattr__(self, "antennas_m", _antenna_places(self.antennas_m))

    @property
    def wavelength_m(self) -> float:
        """Carrier wavelength."""
        return SPEED_OF_LIGHT_M_S / self.carrier_hz

    def scaled(self, scale: float) -> "RadioConfig":
        """The same with antennas further apart, or closer, by a factor.

        Raises:
            ValueError: If they are then too far from the body, or too close to each other.
        """
        return replace(self, antennas_m=tuple((scale * x, scale * y) for x, y in self.antennas_m))

    @property
    def snr_scale(self) -> float:
        """Linear SNR of a subcarrier whose channel gain is one.

        Power and noise are spread over the same channel, so the ratio is that of the totals.
        """
        noise_dbm = THERMAL_NOISE_DBM_PER_HZ + 10.0 * np.log10(self.bandwidth_hz) + self.noise_figure_db
        return float(10.0 ** ((self.tx_power_dbm - noise_dbm) / 10.0))


def _antenna_places(antennas_m: Iterable[Sequence[float]]) -> tuple[tuple[float, ...], ...]:
    """Check antenna positions and make them hashable."""
    field = "RadioConfig.antennas_m"
    places = tuple(tuple(map(float, place)) for place in antennas_m)
    require(len(places) <= _MAX_ANTENNAS, field, f"at most {_MAX_ANTENNAS} positions", antennas_m)
    pairs = all(len(place) == 2 and max(map(abs, place)) <= FARTHEST_ANTENNA_M for place in places)
    require(pairs, field, f"pairs (x_m, y_m) of at most {FARTHEST_ANTENNA_M:g} m", antennas_m)
    apart = all(math.dist(*two) >= CLOSEST_ANTENNAS_M for two in itertools.combinations(places, 2))
    require(apart, field, f"positions at least {CLOSEST_ANTENNAS_M:g} m apart", antennas_m)
    return places


@harmless_underflow
def pair_csi(
    paths: Paths,
    heading_rad: Float[np.ndarray, "links positions"],
    *,
    antenna_gap_m: float,
    wavelength_m: float,
    bandwidth_hz: float = 20e6,
) -> Complex[np.ndarray, "links 2 positions subcarriers"]:
    """Noise-free CSI of two antennas at ``+-gap/2`` along the heading of the receiver.

    A plane wave from azimuth ``a`` reaches an antenna at offset ``d`` with phase
    ``+2 pi / lambda u(a).d`` relative to the centre.

    Args:
        paths: One row per link; azimuths in the same frame as the headings.
        heading_rad: Direction of the antenna axis at each packet.
        antenna_gap_m: Distance between the antennas.
        wavelength_m: Carrier wavelength.
        bandwidth_hz: Width of the channel.

    Returns:
        Channel gains, complex64, antenna 0 ahead and antenna 1 behind.
    """
    half_turns = np.float32(np.pi * antenna_gap_m / wavelength_m)
    n_links, n_paths = paths.gain.shape
    per_path = _subcarriers_by_path(paths, bandwidth_hz)
    away_rad = (paths.azimuth_rx_rad[:, :, None] - heading_rad[:, None]).astype(np.float32)
    angle_rad = np.cos(away_rad, out=away_rad)
    angle_rad *= half_turns
    # exp(+-j angle) = cos +- j sin, so both antennas are real products: of cosines with what arrives on each
    # path, and of sines with that turned by j.
    n_most, n_positions = per_path.shape[1], heading_rad.shape[1]
    waves = np.zeros((n_links, 2, n_most, 2, n_positions), dtype=np.float32)
    cosine, sine = waves[:, 0, :n_paths], waves[:, 1, :n_paths]
    np.cos(angle_rad, out=cosine[:, :, 0])
    np.sin(angle_rad, out=sine[:, :, 0])
    cosine[:, :, 1] = cosine[:, :, 0]
    np.negative(sine[:, :, 0], out=sine[:, :, 1])
    arriving = np.concatenate([per_path, per_path * np.complex64(1j)], axis=1).view(np.float32)
    found = np.matmul(waves.reshape(n_links, 2 * n_most, 2 * n_positions).swapaxes(1, 2), arriving)
    return found.view(np.complex64).reshape(n_links, 2, n_positions, per_path.shape[2])


def _subcarriers_by_path(
    paths: Paths, bandwidth_hz: float
) -> Complex64[np.ndarray, "links paths subcarriers"]:
    """Gain of every path at every subcarrier, padded to a multiple of `_PATHS_AT_ONCE`.

    A sum over paths then has the same bits however many zeros come after it, so a link has the same CSI in
    any company.
    """
    each = subcarrier_phasors(paths.delay_s, bandwidth_hz=bandwidth_hz)
    each *= paths.gain.astype(np.complex64)[:, :, None]
    n_links, n_paths, n_subcarriers = each.shape
    n_padded = -(-n_paths // _PATHS_AT_ONCE) * _PATHS_AT_ONCE
    if n_paths == n_padded:
        return each
    out = np.zeros((n_links, n_padded, n_subcarriers), dtype=np.complex64)
    out[:, :n_paths] = each
    return out


def antenna_offsets(
    antennas_m: Float[np.ndarray, "antennas 2"],
    heading_rad: Float[np.ndarray, "links positions"],
    displacement_m: Float[np.ndarray, "*links positions axes"] | None = None,
) -> Float[np.ndarray, "links antennas positions 2"]:
    """Where the antennas are at each packet, from the place that the paths were traced to.

    Args:
        antennas_m: Antennas in the body frame.
        heading_rad: Heading at each packet.
        displacement_m: Place of the body at each packet, world axes, one for all links or one for
            each; with or without height, which changes nothing on paths in the plane. None for a
            turn in place.

    Returns:
        Offsets, world axes, m.
    """
    ahead, left = antennas_m.T[:, None, :, None]  # (1, antennas, 1) each
    cos, sin = np.cos(heading_rad)[:, None], np.sin(heading_rad)[:, None]
    offset_m = np.stack([ahead * cos - left * sin, ahead * sin + left * cos], axis=-1)
    if displacement_m is not None:
        require(displacement_m.shape[-1] in {2, 3}, "axes of displacement_m", "2 or 3", displacement_m.shape)
        require(bool(np.isfinite(displacement_m).all()), "displacement_m", "finite", displacement_m)
        offset_m += np.expand_dims(displacement_m[..., :2], -3)
    return offset_m


@harmless_underflow
def array_csi(
    paths: Paths,
    offset_m: Float[np.ndarray, "links antennas positions 2"],
    *,
    wavelength_m: float,
    bandwidth_hz: float = 20e6,
    pattern: Float[np.ndarray, "links paths antennas positions"] | None = None,
) -> Complex[np.ndarray, "links antennas positions subcarriers"]:
    """Noise-free CSI of antennas at any offsets from where the paths arrive.

    Every path is a plane wave there: at offset ``d`` its phase is ``+2 pi / lambda u(a).d`` relative to
    the centre, at all subcarriers. That holds while the offset is small against the
    distance to the last reflection, and against c over the bandwidth (15 m at 20 MHz).

    Args:
        paths: One row per link; azimuths in the world frame.
        offset_m: From `antenna_offsets`.
        wavelength_m: Carrier wavelength.
        bandwidth_hz: Width of the channel.
        pattern: Amplitude with which each antenna hears each path at each packet; 1 without.

    Returns:
        Channel gains, complex64.
    """
    n_links, n_antennas, n_positions, _ = offset_m.shape
    offset = (offset_m / wavelength_m).reshape(n_links, n_antennas * n_positions, 2)
    east, north = offset.transpose(2, 0, 1)[:, :, None]
    azimuth_rad = paths.azimuth_rx_rad[:, :, None]
    turns = np.cos(azimuth_rad) * east
    turns += np.sin(azimuth_rad) * north
    angle_rad = within_a_turn(turns).astype(np.float32)
    angle_rad *= np.float32(2.0 * np.pi)
    per_path = _subcarriers_by_path(paths, bandwidth_hz)
    arriving = np.zeros((n_links, per_path.shape[1], turns.shape[2]), dtype=np.complex64)
    known = arriving[:, : turns.shape[1]]
    np.cos(angle_rad, out=known.real)
    np.sin(angle_rad, out=known.imag)
    if pattern is not None:
        known.real *= pattern.reshape(turns.shape)
        known.imag *= pattern.reshape(turns.shape)
    channel = np.matmul(arriving.swapaxes(1, 2), per_path)
    return channel.reshape(n_links, n_antennas, n_positions, channel.shape[-1])
