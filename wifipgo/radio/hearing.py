"""What robots hear of each other in one iteration: links of all pairs, profiles of chosen ones."""

import functools
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from wifipgo.radio import aoa, csi, link
from wifipgo.radio.aoa import AoaConfig
from wifipgo.radio.csi import RadioConfig
from wifipgo.radio.paths import Paths, Surfaces, trace_paths

# Which column of `link.esnr_db` is shown to robots: 64-QAM saturates last.
_SHOWN_MODULATION = 3


class Links(NamedTuple):
    """State of the links between all pairs; the channel is reciprocal, so both tables are symmetric.

    Attributes:
        esnr_db: Effective SNR for 64-QAM; -30 on the diagonal.
        rate_mbit_s: rho_ij of paper Eq. 1; 0 where not even a ping passes, and on the diagonal.
        paths: Propagation paths, one row per pair, from its lower to its higher robot.
        row: Row of each pair in ``paths``.
    """

    esnr_db: Float[np.ndarray, "robots robots"]
    rate_mbit_s: Float[np.ndarray, "robots robots"]
    paths: Paths
    row: Int[np.ndarray, "robots robots"]


def probe_links(p_m: Float[np.ndarray, "robots 2"], surfaces: Surfaces, cfg: RadioConfig) -> Links:
    """Trace the paths of every pair and find which rate each link carries."""
    n = len(p_m)
    low, high = np.triu_indices(n, 1)
    row = np.zeros((n, n), dtype=np.int64)
    row[low, high] = row[high, low] = np.arange(len(low))
    paths = trace_paths(
        p_m[low],
        p_m[high],
        surfaces,
        carrier_hz=cfg.carrier_hz,
        max_order=cfg.max_order,
        penetration=cfg.penetration,
    )
    channel = csi.centre_channel(paths)
    effective_db = link.esnr_db(cfg.snr_scale * (channel.real**2 + channel.imag**2).astype(np.float64))
    rate, esnr = np.zeros((n, n)), np.full((n, n), -30.0)
    rate[low, high] = rate[high, low] = link.rate_mbit_s(effective_db)
    esnr[low, high] = esnr[high, low] = effective_db[:, _SHOWN_MODULATION]
    return Links(esnr, rate, paths, row)


def _towards(links: Links, receiver: np.ndarray, sender: np.ndarray) -> Paths:
    """Paths of each link as its receiver sees them."""
    chosen = Paths(*(column[links.row[receiver, sender]] for column in links.paths))
    arrives = np.where((receiver > sender)[:, None], chosen.azimuth_rx_rad, chosen.azimuth_tx_rad)
    return chosen._replace(azimuth_rx_rad=arrives)


@functools.lru_cache(maxsize=8)
def _schedule(turn: AoaConfig, wavelength_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Relative headings and steering of a turn: the same at every step, for every link."""
    relative, grid = aoa.turn_headings(turn), aoa.azimuth_grid(turn.n_azimuths)
    steering = aoa.turn_steering(relative, grid, antenna_gap_m=turn.antenna_gap_m, wavelength_m=wavelength_m)
    for array in (relative, steering):
        array.setflags(write=False)
    return relative, steering


def listen(
    links: Links,
    receiver: Int[np.ndarray, " links"],
    sender: Int[np.ndarray, " links"],
    yaw_rad: Float[np.ndarray, " robots"],
    *,
    radio: RadioConfig,
    turn: AoaConfig,
    rng: np.random.Generator,
) -> Float[np.ndarray, "links grid"]:
    """Profiles of chosen links from the packets that arrive while the receivers turn.

    Args:
        links: This iteration's links.
        receiver: Robot that turns, per link.
        sender: Robot that it listens to, per link.
        yaw_rad: True headings at the end of the turn, which are the body frames.
        radio: Transmitter and receiver.
        turn: Antenna pair, turn and estimator.
        rng: The channel's stream.

    Returns:
        One profile per link, in [0, 1], in the receiver's body frame.
    """
    paths = _towards(links, receiver, sender)
    relative, steering = _schedule(turn, radio.wavelength_m)
    heading = yaw_rad[receiver, None] + relative[None]
    channel = csi.pair_csi(paths, heading, antenna_gap_m=turn.antenna_gap_m, wavelength_m=radio.wavelength_m)
    received = csi.received_csi(channel, snr_scale=radio.snr_scale, rng=rng)
    signal = aoa.ESTIMATORS[turn.aoa_estimator](received)
    return aoa.bartlett_profiles(signal, steering)
