"""Who hears whom: paths, effective SNR and rate of every pair (paper Eq. 1)."""

import functools
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from wifipgo.arithmetic import harmless_underflow
from wifipgo.radio.channel import csi, rates
from wifipgo.radio.channel.csi import RadioConfig
from wifipgo.radio.channel.impairments import EpisodeImpairments
from wifipgo.radio.propagation.diffuse_scattering import with_diffuse
from wifipgo.radio.propagation.paths import Paths, trace_paths
from wifipgo.radio.propagation.surfaces import Surfaces


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


@harmless_underflow
def probe_links(
    p_m: Float[np.ndarray, "robots 2"],
    surfaces: Surfaces,
    cfg: RadioConfig,
    standing: EpisodeImpairments | None = None,
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
    carried, shown_db = rates.rate_and_esnr(np.float32(cfg.snr_scale) * power, bandwidth_hz=cfg.bandwidth_hz)
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
