"""From channel to data rate: effective SNR, 802.11n rates, service discrepancy (paper Eq. 1).

Effective SNR after Halperin et al., "Predictable 802.11 packet delivery from wireless
channel measurements", SIGCOMM 2010: the SNR of a flat channel with the same mean bit
error rate over subcarriers.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.special import erfc, erfcinv

from wifipgo.errors import require

# Uncoded bit error rate of a Gray-coded constellation: scale * erfc(sqrt(snr / spread)),
# for BPSK, QPSK, 16-QAM and 64-QAM (Halperin et al., Table 2, with Q(x) = erfc(x / sqrt 2) / 2).
_BER_SCALE = np.array([0.5, 0.5, 3.0 / 8.0, 7.0 / 24.0])
_SNR_SPREAD = np.array([1.0, 2.0, 10.0, 42.0])
# Below this the error rate is zero in float64; the effective SNR saturates there (44 dB for 64-QAM).
_BER_FLOOR = 1e-300
_SNR_DB_LIMITS = (-30.0, 60.0)

# 802.11n, 20 MHz, one stream, 800 ns guard interval: MCS 0 to 7.
RATES_MBIT_S = np.array([6.5, 13.0, 19.5, 26.0, 39.0, 52.0, 58.5, 65.0])
RATE_ESNR_DB = np.array([4.0, 7.0, 9.0, 12.0, 16.0, 20.0, 21.0, 22.0])
_RATE_MODULATION = np.array([0, 1, 1, 2, 2, 3, 3, 3])


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkConfig:
    """What a rendezvous asks of a link. Both numbers are ours: the paper gives neither q nor alpha."""

    q_mbit_s: float = 39.0
    alpha: float = 1.0

    def __post_init__(self) -> None:
        """Reject values that cannot mean anything."""
        require(0.0 < self.q_mbit_s <= RATES_MBIT_S[-1], "LinkConfig.q_mbit_s", "in (0, 65]", self.q_mbit_s)
        require(self.alpha >= 0.0, "LinkConfig.alpha", ">= 0", self.alpha)


def esnr_db(snr: Float[np.ndarray, "links subcarriers"]) -> Float[np.ndarray, "links 4"]:
    """Effective SNR of each link for BPSK, QPSK, 16-QAM and 64-QAM, dB.

    Args:
        snr: Linear SNR per subcarrier, >= 0.

    Returns:
        Effective SNR, clipped to [-30, 60] dB.
    """
    error_rate = _BER_SCALE * erfc(np.sqrt(snr[..., None] / _SNR_SPREAD)).mean(axis=-2)
    flat = _SNR_SPREAD * erfcinv(np.maximum(error_rate, _BER_FLOOR) / _BER_SCALE) ** 2
    low, high = _SNR_DB_LIMITS
    return np.clip(10.0 * np.log10(np.maximum(flat, 10.0 ** (low / 10.0))), low, high)


def rate_mbit_s(link_esnr_db: Float[np.ndarray, "links 4"]) -> Float[np.ndarray, " links"]:
    """Highest 802.11n rate whose threshold the link's effective SNR passes, Mb/s; 0 where none does."""
    passes = link_esnr_db[..., _RATE_MODULATION] >= RATE_ESNR_DB
    return np.where(passes, RATES_MBIT_S, 0.0).max(axis=-1)


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
