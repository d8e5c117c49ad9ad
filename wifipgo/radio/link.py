"""From channel to data rate: effective SNR, 802.11n rates, service discrepancy (paper Eq. 1).

Effective SNR after Halperin et al., "Predictable 802.11 packet delivery from wireless
channel measurements", SIGCOMM 2010: the SNR of a flat channel with the same mean bit
error rate over subcarriers.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.special import log_ndtr

from wifipgo.errors import require
from wifipgo.radio.bands import BANDS, band_of

# Uncoded bit error rate of a Gray-coded constellation: scale * Q(sqrt(2 snr / spread)), for BPSK,
# QPSK, 16-QAM and 64-QAM (Halperin et al., Table 2).
_BER_SCALE = np.array([1.0, 1.0, 3.0 / 4.0, 7.0 / 12.0])
_SNR_SPREAD = np.array([1.0, 2.0, 10.0, 42.0])
# Log error rates by dB, a row per modulation. Linear interpolation errs by less than 1e-3 dB, does not
# underflow where the rate itself would, and costs half of the special function.
_STEP_DB = 0.025
_TABLE_DB = np.arange(-60.0, 60.0 + _STEP_DB, _STEP_DB)
_LOG_BER = np.log(_BER_SCALE)[:, None] + log_ndtr(
    -np.sqrt(2.0 * 10.0 ** (_TABLE_DB / 10.0) / _SNR_SPREAD[:, None])
)
_LOG_BER_RISE = np.diff(_LOG_BER, axis=1, append=_LOG_BER[:, -1:])

_LEAST_ESNR_DB = -30.0

# What MCS 0 to 7 need, whatever the bandwidth, and the modulation in which it is measured.
RATE_ESNR_DB = np.array([4.0, 7.0, 9.0, 12.0, 16.0, 20.0, 21.0, 22.0])
_RATE_MODULATION = np.array([0, 1, 1, 2, 2, 3, 3, 3])
_HIGHEST_RATE_MBIT_S = max(band.top_rate_mbit_s for band in BANDS.values())


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkConfig:
    """What a rendezvous asks of a link. Both numbers are ours: the paper gives neither q nor alpha.

    Attributes:
        q_mbit_s: Rate that a rendezvous needs (q of Eq. 1).
        alpha: Factor on the service discrepancy (alpha of Eq. 1).
    """

    q_mbit_s: float = 39.0
    alpha: float = 1.0

    def __post_init__(self) -> None:
        """Reject values that cannot mean anything."""
        highest = _HIGHEST_RATE_MBIT_S
        require(0.0 < self.q_mbit_s <= highest, "LinkConfig.q_mbit_s", f"in (0, {highest:g}]", self.q_mbit_s)
        require(0.0 <= self.alpha < np.inf, "LinkConfig.alpha", ">= 0 and finite", self.alpha)


def esnr_db(snr: Float[np.ndarray, "links subcarriers"]) -> Float[np.ndarray, "links 4"]:
    """Effective SNR of each link for BPSK, QPSK, 16-QAM and 64-QAM, dB.

    Args:
        snr: Linear SNR per subcarrier, >= 0.

    Returns:
        Effective SNR, in [-30, 60] dB.
    """
    place = (10.0 * np.log10(np.maximum(snr, 1e-6)) - _TABLE_DB[0]) / _STEP_DB
    np.clip(place, 0.0, len(_TABLE_DB) - 1.0, out=place)
    below = place.astype(np.intp)
    place -= below
    tables = zip(_LOG_BER, _LOG_BER_RISE, strict=True)
    flat_db = [_flat_snr_db(table.take(below) + place * rise.take(below), table) for table, rise in tables]
    return np.maximum(np.stack(flat_db, axis=-1), _LEAST_ESNR_DB)


def _flat_snr_db(
    log_ber: Float[np.ndarray, "links subcarriers"], table: Float[np.ndarray, " places"]
) -> Float[np.ndarray, " links"]:
    """SNR of the flat channel with the same mean error rate, dB."""
    highest = log_ber.max(axis=1)
    mean = np.exp(log_ber - highest[:, None]).mean(axis=1)
    return np.interp(-(highest + np.log(mean)), -table, _TABLE_DB)


def rate_mbit_s(
    link_esnr_db: Float[np.ndarray, "links 4"], *, bandwidth_hz: float = 20e6
) -> Float[np.ndarray, " links"]:
    """Highest 802.11n rate whose threshold the link's effective SNR passes, Mb/s; 0 where none does.

    The thresholds are the same at both bandwidths: noise that doubles is in the SNR already.

    Raises:
        ValueError: A bandwidth other than 20 or 40 MHz.
    """
    passes = link_esnr_db[..., _RATE_MODULATION] >= RATE_ESNR_DB
    return np.where(passes, band_of(bandwidth_hz).rates_mbit_s, 0.0).max(axis=-1)


def service_discrepancy(
    rate: Float[np.ndarray, "*links"],
    *,
    q_mbit_s: Float[np.ndarray, "*links"] | float,
    alpha: float,
    clip: bool = True,
) -> Float[np.ndarray, "*links"]:
    """Service discrepancy w_ij of paper Eq. 1, unitless; ``clip=False`` only to rank neighbours."""
    w = alpha * (q_mbit_s - rate) / q_mbit_s
    return np.maximum(w, 0.0) if clip else w
