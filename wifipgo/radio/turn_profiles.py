"""What robots hear of each other in one iteration: links of all pairs, profiles of chosen ones."""

import functools
import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from wifipgo.errors import require
from wifipgo.radio import aoa
from wifipgo.radio.aoa import AoaConfig
from wifipgo.radio.channel import csi, rates
from wifipgo.radio.channel.csi import RadioConfig
from wifipgo.radio.channel.impairments import ImpairmentConfig, Standing, true_headings
from wifipgo.radio.propagation.diffuse_scattering import with_diffuse
from wifipgo.radio.propagation.paths import Paths, Surfaces, trace_paths

Antennas = tuple[Sequence[float], ...]


class Links(NamedTuple):
    """State of the links between all pairs; the channel is reciprocal, so both tables are symmetric.

    Attributes:
        esnr_db: Effective SNR for 64-QAM, which saturates last; -30 on the diagonal.
        rate_mbit_s: rho_ij of paper Eq. 1; 0 where not even a ping passes, and on the diagonal.
        paths: Propagation paths, one row per pair, from its lower to its higher robot.
        row: Row of each pair in ``paths``.
    """

    esnr_db: Float[np.ndarray, "robots robots"]
    rate_mbit_s: Float[np.ndarray, "robots robots"]
    paths: Paths
    row: Int[np.ndarray, "robots robots"]


@np.errstate(under="ignore")
def probe_links(
    p_m: Float[np.ndarray, "robots 2"],
    surfaces: Surfaces,
    cfg: RadioConfig,
    standing: Standing | None = None,
) -> Links:
    """Trace the paths of every pair and find which rate each link carries.

    A pair without any path has rate 0, which is what "no link" is.

    Args:
        p_m: Robots in the world.
        surfaces: The scene.
        cfg: Transmitters and receivers.
        standing: What the episode keeps; only its diffuse cluster matters here.
    """
    n = len(p_m)
    low, high, row = _pairs(n)
    paths = trace_paths(
        p_m[low],
        p_m[high],
        surfaces,
        carrier_hz=cfg.carrier_hz,
        max_order=cfg.max_order,
        penetration=cfg.penetration,
    )
    if standing is not None and standing.diffuse is not None:
        paths = with_diffuse(paths, p_m[low], p_m[high], standing.diffuse, carrier_hz=cfg.carrier_hz)
    channel = csi.centre_channel(paths, bandwidth_hz=cfg.bandwidth_hz)
    power = channel.real**2 + channel.imag**2
    carried, shown_db = rates.carried(np.float32(cfg.snr_scale) * power, bandwidth_hz=cfg.bandwidth_hz)
    rate, esnr = carried.take(row), shown_db.take(row)
    itself = slice(None, None, n + 1)
    rate.flat[itself], esnr.flat[itself] = 0.0, -30.0
    return Links(esnr, rate, paths, row)


@functools.lru_cache(maxsize=8)
def _pairs(n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Lower and higher robot of every pair, and the table that finds a pair's row."""
    low, high = np.triu_indices(n, 1)
    row = np.zeros((n, n), dtype=np.int64)
    row[low, high] = row[high, low] = np.arange(len(low))
    for array in (low, high, row):
        array.setflags(write=False)
    return low, high, row


def _towards(links: Links, receiver: np.ndarray, sender: np.ndarray) -> Paths:
    """Paths of each link as its receiver sees them."""
    row = links.row[receiver, sender]
    chosen = Paths(*(column.take(row, axis=0) for column in links.paths))
    arrives = np.where((receiver > sender)[:, None], chosen.azimuth_rx_rad, chosen.azimuth_tx_rad)
    return chosen._replace(azimuth_rx_rad=arrives)


class _Schedule(NamedTuple):
    """A turn as the receiver believes it, for every pair of its antennas."""

    relative_rad: Float[np.ndarray, " positions"]
    pairs: tuple[tuple[int, int], ...]
    steering: tuple[np.ndarray, ...]


@functools.lru_cache(maxsize=8)
def _schedule(turn: AoaConfig, antennas_m: Antennas, wavelength_m: float) -> _Schedule:
    """Relative headings and steering of a turn: the same at every step, for every link."""
    half_m = 0.5 * turn.antenna_gap_m
    places_m = np.array(antennas_m or ((half_m, 0.0), (-half_m, 0.0)))
    require(len(places_m) > 1, "RadioConfig.antennas_m", "2 or 3 positions for a turn", antennas_m)
    relative, grid = aoa.turn_headings(turn), aoa.azimuth_grid(turn.n_azimuths)
    pairs = tuple(itertools.combinations(range(len(places_m)), 2))
    steering = []
    for ahead, behind in pairs:
        axis_m = places_m[ahead] - places_m[behind]
        axis_rad, gap_m = np.arctan2(axis_m[1], axis_m[0]), float(np.hypot(*axis_m))
        steering.append(
            aoa.turn_steering(relative + axis_rad, grid, antenna_gap_m=gap_m, wavelength_m=wavelength_m)
        )
    for array in (relative, *steering):
        array.setflags(write=False)
    return _Schedule(relative, pairs, tuple(steering))


def _channel(
    paths: Paths, heading_rad: Float[np.ndarray, "links positions"], radio: RadioConfig, turn: AoaConfig
) -> np.ndarray:
    """Noise-free CSI during a turn: the pair has a faster way."""
    wavelength_m, bandwidth_hz = radio.wavelength_m, radio.bandwidth_hz
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


def _profiles(
    received: np.ndarray, arrived: Int[np.ndarray, " links"], schedule: _Schedule, turn: AoaConfig
) -> np.ndarray:
    """Mean over antenna pairs of the share of power that each direction explains.

    A packet that did not arrive counts neither as signal nor as a packet; nothing at all gives zeros.
    """
    total = functools.reduce(
        np.add,
        (
            aoa.pair_profiles(received[:, ahead : behind + 1 : behind - ahead], steering, turn)
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


@np.errstate(under="ignore")
def listen(
    links: Links,
    receiver: Int[np.ndarray, " links"],
    sender: Int[np.ndarray, " links"],
    yaw_rad: Float[np.ndarray, " robots"],
    *,
    radio: RadioConfig,
    turn: AoaConfig,
    rng: np.random.Generator,
    standing: Standing | None = None,
) -> Float[np.ndarray, "links grid"]:
    """Profiles of chosen links from the packets that arrive while the receivers turn.

    Args:
        links: This iteration's links.
        receiver: Robot that turns, per link.
        sender: Robot that it listens to, per link.
        yaw_rad: True headings at the end of the turn, which are the body frames.
        radio: Transmitter and receiver.
        turn: Turn and estimator.
        rng: The channel's stream.
        standing: Impairments; the defaults of `ImpairmentConfig` without.

    Returns:
        One profile per link, in [0, 1], in the receiver's body frame. Zeros say that nothing was
        heard: no path, no rate that passes, or no packet that arrived.
    """
    cfg = ImpairmentConfig() if standing is None else standing.cfg
    schedule = _schedule(turn, radio.antennas_m, radio.wavelength_m)
    heading_rad = true_headings(yaw_rad[receiver, None] + schedule.relative_rad[None], cfg, rng=rng)
    received = csi.received_csi(
        _channel(_towards(links, receiver, sender), heading_rad, radio, turn),
        snr_scale=radio.snr_scale,
        rng=rng,
        cfg=cfg,
        chain_rad=None if standing is None or cfg.chain_phase_rad == 0.0 else standing.chain_rad[receiver],
        bandwidth_hz=radio.bandwidth_hz,
        only_between=True,
    )
    arrived = _arrived(received, links.rate_mbit_s[receiver, sender] > 0.0, cfg)
    # A subspace needs more packets than dimensions; nothing else asks for more than one.
    least = turn.n_paths + 1 if turn.aoa_estimator == "music" else 1
    received[arrived < least] = 0.0
    return _profiles(received, arrived, schedule, turn)
