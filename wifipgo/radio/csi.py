"""Channel state information of two antennas on a turning robot, from propagation paths.

Every packet gives one complex number per antenna and subcarrier: the sum over paths,
plus receiver noise, times a phase that is random from packet to packet but common to
both antennas, which share an oscillator. The paths stay as they are during a turn, so
AOA errors come out of the geometry and repeat at the same poses.
"""

import functools
from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Complex64, Float, Float32

from wifipgo.errors import require
from wifipgo.radio.materials import SPEED_OF_LIGHT_M_S
from wifipgo.radio.paths import Paths

THERMAL_NOISE_DBM_PER_HZ = -174.0
SUBCARRIER_SPACING_HZ = 312.5e3
# The 30 subcarriers that the Intel 5300 reports of a 20 MHz channel (802.11n-2009, Ng = 2).
REPORTED_SUBCARRIERS = np.concatenate([np.arange(-28, 0, 2), [-1], np.arange(1, 28, 2), [28]])
# More than the largest block that one link takes; offsets into it make blocks differ.
_NOISE_TABLE_SIZE = 1 << 20


@dataclass(frozen=True, slots=True, kw_only=True)
class RadioConfig:
    """Transmitter and receiver. 5 GHz band and Intel 5300: paper Sec. 7.2.1; powers are ours."""

    carrier_hz: float = 5.0e9
    tx_power_dbm: float = -8.0
    noise_figure_db: float = 6.0
    max_order: int = 1
    penetration: bool = True

    def __post_init__(self) -> None:
        """Reject values that cannot mean anything."""
        require(1e9 <= self.carrier_hz <= 10e9, "RadioConfig.carrier_hz", "in 1e9..10e9", self.carrier_hz)
        require(
            -60.0 <= self.tx_power_dbm <= 30.0, "RadioConfig.tx_power_dbm", "in -60..30", self.tx_power_dbm
        )
        require(
            0.0 <= self.noise_figure_db <= 30.0,
            "RadioConfig.noise_figure_db",
            "in 0..30",
            self.noise_figure_db,
        )
        require(self.max_order in {0, 1, 2}, "RadioConfig.max_order", "0, 1 or 2", self.max_order)

    @property
    def wavelength_m(self) -> float:
        """Carrier wavelength."""
        return SPEED_OF_LIGHT_M_S / self.carrier_hz

    @property
    def snr_scale(self) -> float:
        """Linear SNR of a subcarrier whose channel gain is one.

        Power and noise are spread over the same 20 MHz, so the ratio is that of the totals.
        """
        bandwidth_hz = 64 * SUBCARRIER_SPACING_HZ
        noise_dbm = THERMAL_NOISE_DBM_PER_HZ + 10.0 * np.log10(bandwidth_hz) + self.noise_figure_db
        return float(10.0 ** ((self.tx_power_dbm - noise_dbm) / 10.0))


def _phasors(angle_rad: Float32[np.ndarray, "*shape"]) -> Complex64[np.ndarray, "*shape"]:
    """exp(j angle) in single precision, ten times faster than the complex exponential."""
    out = np.empty(angle_rad.shape, dtype=np.complex64)
    out.real, out.imag = np.cos(angle_rad), np.sin(angle_rad)
    return out


def subcarrier_phasors(
    delay_s: Float[np.ndarray, "links paths"],
) -> Complex[np.ndarray, "links paths subcarriers"]:
    """Phase that each path's delay adds at each reported subcarrier, relative to the carrier."""
    # One exponential per path: powers by doubling cost a multiplication each.
    powers = np.empty((*delay_s.shape, 32), dtype=np.complex64)
    powers[..., 0] = np.exp(-2j * np.pi * SUBCARRIER_SPACING_HZ * delay_s)
    for done in (1, 2, 4, 8, 16):
        np.multiply(powers[..., :done], powers[..., done - 1, None], out=powers[..., done : 2 * done])
    phasors = powers.take(np.abs(REPORTED_SUBCARRIERS) - 1, axis=-1)
    below = phasors[..., : np.count_nonzero(REPORTED_SUBCARRIERS < 0)]
    np.conjugate(below, out=below)
    return phasors


def centre_channel(paths: Paths) -> Complex[np.ndarray, "links subcarriers"]:
    """Noise-free channel at the receiver's centre, gain per subcarrier."""
    gain = paths.gain.astype(np.complex64)
    return np.matmul(gain[:, None, :], subcarrier_phasors(paths.delay_s))[:, 0]


def pair_csi(
    paths: Paths,
    heading_rad: Float[np.ndarray, "links positions"],
    *,
    antenna_gap_m: float,
    wavelength_m: float,
) -> Complex[np.ndarray, "links 2 positions subcarriers"]:
    """Noise-free CSI of two antennas at ``+-gap/2`` along the heading of the receiver.

    A plane wave from azimuth ``a`` reaches an antenna at offset ``d`` with phase
    ``+2 pi / lambda u(a).d`` relative to the centre.

    Args:
        paths: One row per link; azimuths in the same frame as the headings.
        heading_rad: Direction of the antenna axis at each packet.
        antenna_gap_m: Distance between the antennas.
        wavelength_m: Carrier wavelength.

    Returns:
        Channel gains, complex64, antenna 0 ahead and antenna 1 behind.
    """
    half_turns = np.pi * antenna_gap_m / wavelength_m
    away_rad = (paths.azimuth_rx_rad[:, None, :] - heading_rad[:, :, None]).astype(np.float32)
    ahead = _phasors(np.float32(half_turns) * np.cos(away_rad))
    per_path = paths.gain.astype(np.complex64)[:, None, :]
    antennas = np.concatenate([ahead * per_path, ahead.conj() * per_path], axis=1)
    channel = np.matmul(antennas, subcarrier_phasors(paths.delay_s))
    return channel.reshape(len(heading_rad), 2, heading_rad.shape[1], len(REPORTED_SUBCARRIERS))


@functools.cache
def _noise_table() -> Complex[np.ndarray, " samples"]:
    """Circular complex normal samples of unit power, drawn once and the same everywhere."""
    draw = np.random.default_rng(np.random.SeedSequence(0x5EED)).standard_normal(
        2 * _NOISE_TABLE_SIZE, dtype=np.float32
    )
    return (draw * np.float32(np.sqrt(0.5))).view(np.complex64)


def unit_noise(shape: tuple[int, ...], *, rng: np.random.Generator) -> Complex[np.ndarray, "..."]:
    """Complex white noise of unit power: one block per first index, cut from a table at a random offset.

    Drawing every sample afresh would cost more than the rest of a step. The offsets are
    what ``rng`` decides; within a block the samples are independent.

    Raises:
        ValueError: If a block is larger than the table.
    """
    size = int(np.prod(shape[1:]))
    require(size <= _NOISE_TABLE_SIZE, "size of a noise block", f"<= {_NOISE_TABLE_SIZE}", size)
    windows = np.lib.stride_tricks.sliding_window_view(_noise_table(), size)
    return windows[rng.integers(len(windows), size=shape[0])].reshape(shape)


def received_csi(
    channel: Complex[np.ndarray, "links 2 positions subcarriers"],
    *,
    snr_scale: float,
    rng: np.random.Generator,
) -> Complex[np.ndarray, "links 2 positions subcarriers"]:
    """CSI as the receiver reports it: with noise and a random phase common to the antennas of a packet.

    Args:
        channel: Noise-free gains.
        snr_scale: Linear SNR at unit gain, `RadioConfig.snr_scale`.
        rng: The channel's stream.

    Returns:
        Noisy CSI in units of channel gain, complex64.
    """
    n_links, _, n_positions, _ = channel.shape
    noise = unit_noise(channel.shape, rng=rng)
    noise *= np.float32(1.0 / np.sqrt(snr_scale))
    noise += channel
    phase = rng.random((n_links, n_positions), dtype=np.float32) * np.float32(2.0 * np.pi)
    noise *= _phasors(phase)[:, None, :, None]
    return noise
