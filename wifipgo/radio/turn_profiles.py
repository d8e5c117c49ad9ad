"""Profiles of chosen links from the packets that arrive while receivers turn (paper Sec. 4)."""

import functools
import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from wifipgo.arithmetic import harmless_underflow
from wifipgo.errors import require
from wifipgo.radio.aoa.estimators import AoaConfig, least_packets, pair_profiles, turn_headings
from wifipgo.radio.aoa.steering import azimuth_grid, turn_steering
from wifipgo.radio.channel import csi
from wifipgo.radio.channel.antenna_patterns import coupled, pattern_gain
from wifipgo.radio.channel.bands import band_of
from wifipgo.radio.channel.csi import RadioConfig
from wifipgo.radio.channel.impairments import (
    EpisodeImpairments,
    ImpairmentConfig,
    LinkChance,
    link_chance,
    true_headings,
)
from wifipgo.radio.channel.receiver import draw_reception, receive
from wifipgo.radio.links import Links
from wifipgo.radio.propagation.paths import Paths
from wifipgo.rows import Rows

Antennas = tuple[Sequence[float], ...]


# Links looked at in one go: their CSI stays in the cache.
_BLOCK = 64


def _towards(links: Links, receiver: np.ndarray, sender: np.ndarray) -> Paths:
    """Paths of each link as its receiver sees them."""
    paths = links.between(receiver, sender)
    arrives = np.where((receiver > sender)[:, None], paths.azimuth_rx_rad, paths.azimuth_tx_rad)
    return paths._replace(azimuth_rx_rad=arrives)


class _Schedule(NamedTuple):
    """A turn as the receiver believes it, for every pair of its antennas."""

    relative_rad: Float[np.ndarray, " positions"]
    pairs: tuple[tuple[int, int], ...]
    steering: tuple[np.ndarray, ...]


@functools.lru_cache(maxsize=8)
def _schedule(turn: AoaConfig, antennas_m: Antennas, wavelength_m: float) -> _Schedule:
    """Relative headings and steering of a turn: the same at every step, for every link."""
    places_m = _places(turn.antenna_gap_m, antennas_m)
    require(len(places_m) > 1, "RadioConfig.antennas_m", "2 or 3 positions for a turn", antennas_m)
    relative, grid = turn_headings(turn), azimuth_grid(turn.n_azimuths)
    pairs = tuple(itertools.combinations(range(len(places_m)), 2))
    steering = []
    for ahead, behind in pairs:
        axis_m = places_m[ahead] - places_m[behind]
        axis_rad, gap_m = np.arctan2(axis_m[1], axis_m[0]), float(np.hypot(*axis_m))
        steering.append(
            turn_steering(relative + axis_rad, grid, antenna_gap_m=gap_m, wavelength_m=wavelength_m)
        )
    for array in (relative, *steering):
        array.setflags(write=False)
    return _Schedule(relative, pairs, tuple(steering))


def _channel(
    paths: Paths, heading_rad: Float[np.ndarray, "links positions"], radio: RadioConfig, turn: AoaConfig
) -> np.ndarray:
    """Noise-free CSI during a turn: the pair has a faster way."""
    wavelength_m, bandwidth_hz = radio.wavelength_m, radio.bandwidth_hz
    if radio.front_to_back_db > 0.0 or radio.antenna_coupling > 0.0:
        return _shaped_channel(paths, heading_rad, radio, turn)
    if not radio.antennas_m:
        return csi.pair_csi(
            paths,
            heading_rad,
            antenna_gap_m=turn.antenna_gap_m,
            wavelength_m=wavelength_m,
            bandwidth_hz=bandwidth_hz,
        )
    offset_m = csi.antenna_offsets(np.array(radio.antennas_m), heading_rad)
    return csi.array_csi(paths, offset_m, wavelength_m=wavelength_m, bandwidth_hz=bandwidth_hz)


def _shaped_channel(
    paths: Paths, heading_rad: Float[np.ndarray, "links positions"], radio: RadioConfig, turn: AoaConfig
) -> np.ndarray:
    """The same of antennas that hear directions unlike, and each other."""
    places_m = _places(turn.antenna_gap_m, radio.antennas_m)
    pattern = pattern_gain(
        paths.azimuth_rx_rad, heading_rad, places_m, front_to_back_db=radio.front_to_back_db
    )
    channel = csi.array_csi(
        paths,
        csi.antenna_offsets(places_m, heading_rad),
        wavelength_m=radio.wavelength_m,
        bandwidth_hz=radio.bandwidth_hz,
        pattern=pattern,
    )
    return coupled(channel, places_m, coupling=radio.antenna_coupling, wavelength_m=radio.wavelength_m)


def _places(antenna_gap_m: float, antennas_m: Antennas) -> Float[np.ndarray, "antennas 2"]:
    """Antennas in the body frame: those given, or the pair along the heading."""
    half_m = 0.5 * antenna_gap_m
    return np.array(antennas_m or ((half_m, 0.0), (-half_m, 0.0)))


def _profiles(
    received: np.ndarray, arrived: Int[np.ndarray, " links"], schedule: _Schedule, turn: AoaConfig
) -> np.ndarray:
    """Mean over antenna pairs of the share of power that each direction explains.

    A packet that did not arrive counts neither as signal nor as a packet; nothing at all gives zeros.
    """
    total = functools.reduce(
        np.add,
        (
            pair_profiles(received[:, ahead : behind + 1 : behind - ahead], steering, turn)
            for (ahead, behind), steering in zip(schedule.pairs, schedule.steering, strict=True)
        ),
    )
    scale = received.shape[2] / (len(schedule.pairs) * np.maximum(arrived, 1))
    total *= scale[:, None].astype(np.float32)
    return np.minimum(total, 1.0, out=total)


def _arrived(
    received: np.ndarray, linked: Bool[np.ndarray, " links"], cfg: ImpairmentConfig
) -> Int[np.ndarray, " links"]:
    """Packets of each link that arrived: none where not even a ping passes."""
    if cfg.packet_loss == 0.0:
        return linked * received.shape[2]
    return linked * received.any(axis=(1, 3)).sum(axis=1)


@harmless_underflow
def listen(
    links: Links,
    receiver: Int[np.ndarray, " links"],
    sender: Int[np.ndarray, " links"],
    yaw_rad: Float[np.ndarray, " rows"],
    *,
    radio: RadioConfig,
    turn: AoaConfig,
    rng: LinkChance,
    standing: EpisodeImpairments | None = None,
) -> Float[np.ndarray, "links grid"]:
    """Profiles of chosen links from the packets that arrive while the receivers turn.

    Args:
        links: This iteration's links.
        receiver: Row of the robot that turns, per link.
        sender: Row of the robot of the same world that it listens to, per link.
        yaw_rad: True headings at the end of the turn, which are the body frames.
        radio: Transmitter and receiver.
        turn: Turn and estimator.
        rng: The channel's stream, or the `link_chance` that was made of it.
        standing: Impairments; the defaults of `ImpairmentConfig` without.

    Returns:
        One profile per link, in [0, 1], in the receiver's body frame. Zeros say that nothing was
        heard: no path, no rate that passes, or no packet that arrived.
    """
    cfg = ImpairmentConfig() if standing is None else standing.cfg
    rng = link_chance(rng, receiver, sender, rows=Rows.of(*links.rate_mbit_s.shape))
    schedule = _schedule(turn, radio.antennas_m, radio.wavelength_m)
    heading_rad = true_headings(yaw_rad[receiver, None] + schedule.relative_rad[None], cfg, rng=rng)
    paths, n_antennas = _towards(links, receiver, sender), len(radio.antennas_m) or 2
    n_subcarriers = len(band_of(radio.bandwidth_hz).subcarriers)
    shape = (len(receiver), n_antennas, turn.n_positions, n_subcarriers)
    drawn = draw_reception(shape, cfg, rng=rng, skip_common_phase=True)
    linked = links.rate_mbit_s[receiver, sender % links.rate_mbit_s.shape[1]] > 0.0
    chain_rad = None if standing is None or cfg.chain_phase_rad == 0.0 else standing.chain_rad[receiver]
    out = np.empty((len(receiver), turn.n_azimuths), dtype=np.float32)
    for begin in range(0, len(receiver), _BLOCK):
        block = slice(begin, begin + _BLOCK)
        received = receive(
            _channel(paths.of(block), heading_rad[block], radio, turn),
            drawn.of(block),
            cfg,
            snr_scale=radio.snr_scale,
            chain_rad=None if chain_rad is None else chain_rad[block],
            bandwidth_hz=radio.bandwidth_hz,
        )
        arrived = _arrived(received, linked[block], cfg)
        unheard = arrived < least_packets(turn)
        if unheard.any():
            received[unheard] = 0.0
        out[block] = _profiles(received, arrived, schedule, turn)
    return out
