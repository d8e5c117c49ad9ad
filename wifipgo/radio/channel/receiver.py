"""From channel gains to what a receiver reports, packet by packet.

In the order of the signal: phase offsets of the receive chains, thermal noise, the oscillator
and symbol timing of each packet (common to all antennas, so both cancel between antennas),
packets that never arrive, gain control, 8-bit samples.
"""

import functools
import math
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Complex, Float, Int
from scipy.special import ndtri

from wifipgo.arithmetic import harmless_underflow
from wifipgo.errors import require
from wifipgo.radio.channel.bands import SUBCARRIER_SPACING_HZ, band_of
from wifipgo.radio.channel.impairments import ImpairmentConfig, LinkChance, chance_of
from wifipgo.rows import Chance

# Largest I or Q of a report of signed bytes.
FULL_SCALE = 127
# More than the largest block that one link takes; offsets into it make blocks differ.
_NOISE_TABLE_SIZE = 1 << 20
_OSCILLATOR_TABLE_SIZE = 4096


@functools.lru_cache(maxsize=4)
def _noise_windows(amplitude: float, size: int) -> Complex[np.ndarray, "windows size"]:
    """All stretches of a table of circular complex normal samples, the same everywhere."""
    table = _noise_table() * np.float32(amplitude)
    return np.lib.stride_tricks.sliding_window_view(table, size)


@functools.cache
def _noise_table() -> Complex[np.ndarray, " samples"]:
    """Circular complex normal samples of unit power, drawn once."""
    draw = np.random.default_rng(np.random.SeedSequence(0x5EED)).standard_normal(
        2 * _NOISE_TABLE_SIZE, dtype=np.float32
    )
    return (draw * np.float32(np.sqrt(0.5))).view(np.complex64)


@harmless_underflow
def white_noise(shape: tuple[int, ...], *, amplitude: float = 1.0, rng: Chance) -> Complex[np.ndarray, "..."]:
    """Complex white noise of power ``amplitude^2``, a block per first index, cut from a table at random.

    Drawing every sample afresh would cost more than the rest of a step. The offsets are
    what ``rng`` decides; within a block the samples are independent.

    Raises:
        ValueError: If a block is larger than the table.
    """
    windows = _windows(shape, amplitude)
    return windows[_offsets(len(windows), shape[0], rng)].reshape(shape)


def _offsets(n_windows: int, n_links: int, rng: LinkChance) -> Int[np.ndarray, " links"]:
    """A block for each link; by a draw that costs a tenth of one of whole numbers."""
    return (rng.random(n_links) * n_windows).astype(np.int64)


def _windows(shape: tuple[int, ...], amplitude: float) -> Complex[np.ndarray, "windows size"]:
    """Blocks of noise to choose from, each as large as all but the first axis of this shape."""
    size = math.prod(shape[1:])
    require(size <= _NOISE_TABLE_SIZE, "size of a noise block", f"<= {_NOISE_TABLE_SIZE}", size)
    return _noise_windows(amplitude, size)


@functools.lru_cache(maxsize=8)
def _oscillator_table(
    common_phase: bool, timing_jitter_s: float, bandwidth_hz: float
) -> Complex[np.ndarray, "draws subcarriers"]:
    """Factors that oscillator and timing put on a packet: 4096 of equal probability.

    Quantiles of the uniform phase paired at random with quantiles of the normal timing.
    """
    quantile = (np.arange(_OSCILLATOR_TABLE_SIZE) + 0.5) / _OSCILLATOR_TABLE_SIZE
    shuffled = np.random.default_rng(np.random.SeedSequence(0x71C)).permutation(quantile)
    delay_s = timing_jitter_s * ndtri(quantile)
    slope_hz = SUBCARRIER_SPACING_HZ * band_of(bandwidth_hz).subcarriers
    turns = common_phase * shuffled[:, None] - delay_s[:, None] * slope_hz
    table = np.exp(2j * np.pi * turns).astype(np.complex64)
    table.setflags(write=False)
    return table


@harmless_underflow
def reported(
    csi: Complex[np.ndarray, "links antennas positions subcarriers"], *, agc: bool, int8: bool
) -> Complex[np.ndarray, "links antennas positions subcarriers"]:
    """CSI in units of the converter, largest I or Q at `FULL_SCALE`; rounded if ``int8``.

    One scale for each packet with ``agc``, for each link without: the antennas share it, as the
    report of an Intel 5300 has one for all its bytes. Packets without power stay zero.
    """
    parts = np.ascontiguousarray(csi, dtype=np.complex64).view(np.float32)
    axes = (1, 3) if agc else (1, 2, 3)
    largest = np.abs(parts).max(axis=axes, keepdims=True, initial=0.0)
    scaled = parts * (FULL_SCALE / np.maximum(largest, FULL_SCALE * np.finfo(np.float32).tiny))
    return (np.rint(scaled) if int8 else scaled).astype(np.float32).view(np.complex64)


class Reception(NamedTuple):
    """What chance decides about the reception of some links, a row each; None what is switched off.

    Attributes:
        noise: Which block of noise.
        oscillator: Which factors of oscillator and timing, packet by packet.
        arrives: Which packets arrive.
    """

    noise: Int[np.ndarray, " links"] | None
    oscillator: Int[np.ndarray, "links positions"] | None
    arrives: Bool[np.ndarray, "links positions"] | None

    def of(self, chosen: slice) -> "Reception":
        """Of some of the links."""
        return Reception(*(None if column is None else column[chosen] for column in self))


def draw_reception(
    shape: tuple[int, ...], cfg: ImpairmentConfig, *, rng: LinkChance, skip_common_phase: bool = False
) -> Reception:
    """Draw for CSI of a shape (links, antennas, positions, subcarriers), each cause from its own stream.

    With ``skip_common_phase`` the caller only compares antennas of one packet and subcarrier, so that what
    the oscillator and the timing do to both cancels: it is not drawn where nothing else looks at I and Q.
    """
    noise = oscillator = arrives = None
    if cfg.noise_floor:
        noise = _offsets(len(_windows(shape, 1.0)), shape[0], chance_of("noise", rng))
    turned = cfg.common_phase or cfg.timing_jitter_s > 0.0
    if turned and (not skip_common_phase or cfg.agc or cfg.int8):
        oscillator = chance_of("oscillator", rng).integers(_OSCILLATOR_TABLE_SIZE, size=(shape[0], shape[2]))
    if cfg.packet_loss > 0.0:
        arrives = chance_of("arrival", rng).random((shape[0], shape[2]), dtype=np.float32) >= cfg.packet_loss
    return Reception(noise, oscillator, arrives)


@harmless_underflow
def received_csi(
    channel: Complex[np.ndarray, "links antennas positions subcarriers"],
    *,
    snr_scale: float,
    rng: Chance,
    cfg: ImpairmentConfig | None = None,
    chain_rad: Float[np.ndarray, "links antennas"] | None = None,
    bandwidth_hz: float = 20e6,
) -> Complex[np.ndarray, "links antennas positions subcarriers"]:
    """CSI as the receiver reports it.

    Args:
        channel: Noise-free gains.
        snr_scale: Linear SNR at unit gain, `wifipgo.radio.channel.csi.RadioConfig.snr_scale`.
        rng: The channel's stream.
        cfg: What goes wrong; the defaults of `ImpairmentConfig` without.
        chain_rad: Phase offset of each link's receive chains; none without.
        bandwidth_hz: That of the channel's subcarriers.

    Returns:
        Noisy CSI, complex64, in units of channel gain, or of the converter with ``agc`` or
        ``int8``. A packet that is lost is zero.
    """
    cfg = cfg or ImpairmentConfig()
    drawn = draw_reception(channel.shape, cfg, rng=rng)
    return receive(channel, drawn, cfg, snr_scale=snr_scale, chain_rad=chain_rad, bandwidth_hz=bandwidth_hz)


def receive(
    channel: Complex[np.ndarray, "links antennas positions subcarriers"],
    drawn: Reception,
    cfg: ImpairmentConfig,
    *,
    snr_scale: float,
    chain_rad: Float[np.ndarray, "links antennas"] | None = None,
    bandwidth_hz: float = 20e6,
) -> Complex[np.ndarray, "links antennas positions subcarriers"]:
    """`received_csi` by chance that was drawn before."""
    if chain_rad is not None:
        channel = channel * np.exp(1j * chain_rad).astype(np.complex64)[:, :, None, None]
    if drawn.noise is None:
        received = channel.astype(np.complex64)
    else:
        windows = _noise_windows(float(1.0 / np.sqrt(snr_scale)), math.prod(channel.shape[1:]))
        received = windows[drawn.noise].reshape(channel.shape)
        received += channel
    if drawn.oscillator is not None:
        table = _oscillator_table(cfg.common_phase, cfg.timing_jitter_s, bandwidth_hz)
        received *= table.take(drawn.oscillator, axis=0)[:, None]
    if drawn.arrives is not None:
        received *= drawn.arrives[:, None, :, None]
    return reported(received, agc=cfg.agc, int8=cfg.int8) if cfg.agc or cfg.int8 else received
