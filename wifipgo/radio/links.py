"""Who hears whom: paths, effective SNR and rate of every pair (paper Eq. 1)."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Inexact, Int

from wifipgo.arithmetic import harmless_underflow
from wifipgo.errors import require
from wifipgo.radio.channel import rates
from wifipgo.radio.channel.csi import RadioConfig
from wifipgo.radio.channel.impairments import EpisodeImpairments
from wifipgo.radio.channel.power_bound import most_mean_power
from wifipgo.radio.channel.subcarriers import combed_channel
from wifipgo.radio.pairs import Clutter, TracedPairs, all_pairs
from wifipgo.radio.propagation.paths import Paths
from wifipgo.radio.propagation.ray_gains import Medium
from wifipgo.radio.propagation.scenes import Scenes, scenes_of
from wifipgo.radio.propagation.surfaces import Surfaces
from wifipgo.rows import Chance, Rows

# Lines times links looked at in one go: some 20 MB of working arrays. Fewer would pay for more calls.
_BLOCK = 1 << 15
_NO_ESNR_DB, MOST_ESNR_DB = -30.0, 60.0
_MANY = 500  # links, from which on it pays to look which of them can be heard
_NEARLY_ALL = 0.9  # of links that can be heard: to choose costs as much as to work out the rest


class Links(NamedTuple):
    """State of the links between all pairs of each world; the channel is reciprocal, so tables are symmetric.

    Rows are robots of all worlds, columns the numbers of their peers in the same world.

    Attributes:
        esnr_db: Effective SNR for 64-QAM, which saturates last; -30 where not even a ping passes.
        rate_mbit_s: rho_ij of paper Eq. 1; 0 where not even a ping passes, and on the diagonal.
        row: Row of each pair in ``paths``; 0 on the diagonal.
        pairs: The pairs, whose paths are worked out where they are asked for.
    """

    esnr_db: Float[np.ndarray, "rows peers"]
    rate_mbit_s: Float[np.ndarray, "rows peers"]
    row: Int[np.ndarray, "rows peers"]
    pairs: TracedPairs

    @property
    def paths(self) -> Paths:
        """Propagation paths, one row per pair, from its lower to its higher robot."""
        return self.pairs.paths

    def between(self, a: Int[np.ndarray, " links"], b: Int[np.ndarray, " links"]) -> Paths:
        """Paths from the lower to the higher robot of some pairs, given as rows."""
        row = self.row[a, b % self.row.shape[1]]
        if 2 * len(row) < len(self.pairs.pairs.low):
            return self.pairs.some(row)
        return self.paths.only(row)


@harmless_underflow
def probe_links(
    p_m: Float[np.ndarray, "rows 2"],
    surfaces: Surfaces | Scenes,
    cfg: RadioConfig,
    standing: EpisodeImpairments | None = None,
    *,
    rows: Rows | None = None,
    t: int = 0,
) -> Links:
    """Trace the paths of every pair of each world and find which rate each link carries.

    A pair without any path has rate 0, which is what "no link" is. A link is the same, to the bit, whatever
    else there is.

    Args:
        p_m: Robots of all worlds.
        surfaces: The scene of all worlds, or the scenes of each.
        cfg: Transmitters and receivers.
        standing: What the episode keeps; only its diffuse cluster and people matter here.
        rows: Which robots are of which world; one world without.
        t: Iteration, which says where people are.
    """
    rows, scenes = rows or Rows(1, len(p_m)), scenes_of(surfaces)
    require(len(rows) == len(p_m), "rows", f"those of {len(p_m)} robots", rows)
    pairs, row = all_pairs(rows)
    medium = Medium(scenes, cfg.carrier_hz, cfg.max_order, cfg.penetration, cfg.diffraction, single=True)
    diffuse = None if standing is None else standing.diffuse
    bodies_m = None if standing is None or standing.bodies is None else standing.bodies.at(t)
    traced = TracedPairs.between(p_m, pairs, rows=rows, medium=medium, clutter=Clutter(diffuse, bodies_m))
    rate, esnr_db = np.empty((2, len(pairs.low)))
    step = max(64, _BLOCK // scenes.n_lines)
    for begin in range(0, len(rate), step):
        block = slice(begin, begin + step)
        rate[block], esnr_db[block] = _carried(traced, block, cfg)
    esnr_db[rate == 0.0] = _NO_ESNR_DB
    return Links(pairs.table(esnr_db, _NO_ESNR_DB, rows), pairs.table(rate, 0.0, rows), row, traced)


def read_levels(links: Links, *, sigma_db: float, rng: Chance) -> Links:
    """Links as each end reads their effective SNR; of what is not heard nothing is read."""
    if sigma_db == 0.0:
        return links
    read_db = links.esnr_db + sigma_db * rng.standard_normal(links.esnr_db.shape)
    heard_db = np.clip(read_db, _NO_ESNR_DB, MOST_ESNR_DB)
    return links._replace(esnr_db=np.where(links.rate_mbit_s > 0.0, heard_db, links.esnr_db))


def _carried(pairs: TracedPairs, block: slice, cfg: RadioConfig) -> tuple[np.ndarray, np.ndarray]:
    """Rate and effective SNR of some pairs; those that surely carry nothing are not looked at.

    Error rates are convex in the SNR, so effective SNR is at most the mean SNR.
    """
    gain, delay_s = pairs.columns(block)
    if gain.shape[1] < _MANY:
        return _carried_by(gain, delay_s, cfg)
    power = most_mean_power(gain, delay_s, bandwidth_hz=cfg.bandwidth_hz)
    audible = power >= rates.LEAST_MEAN_SNR / cfg.snr_scale
    n_audible = np.count_nonzero(audible)
    if n_audible > _NEARLY_ALL * len(audible):
        return _carried_by(gain, delay_s, cfg)
    rate, esnr_db = np.zeros(len(audible)), np.full(len(audible), _NO_ESNR_DB)
    if n_audible:
        heard = audible.nonzero()[0]
        rate[heard], esnr_db[heard] = _carried_by(gain.take(heard, axis=1), delay_s.take(heard, axis=1), cfg)
    return rate, esnr_db


def _carried_by(
    gain: Inexact[np.ndarray, "paths links"], delay_s: Float[np.ndarray, "paths links"], cfg: RadioConfig
) -> tuple[np.ndarray, np.ndarray]:
    """Rate and effective SNR of links with these paths."""
    amplitude = gain * np.float32(np.sqrt(cfg.snr_scale))
    parts = combed_channel(amplitude, delay_s, bandwidth_hz=cfg.bandwidth_hz).view(np.float32)
    np.square(parts, out=parts)
    return rates.carried(parts[:, ::2] + parts[:, 1::2], bandwidth_hz=cfg.bandwidth_hz)
