"""From channel to data rate: effective SNR, 802.11n rates, service discrepancy (paper Eq. 1).

Effective SNR after Halperin et al., "Predictable 802.11 packet delivery from wireless
channel measurements", SIGCOMM 2010: the SNR of a flat channel with the same mean bit
error rate over subcarriers.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Float32, Int
from scipy.special import log_ndtr

from wifipgo.arithmetic import harmless_underflow
from wifipgo.errors import require_within
from wifipgo.radio.channel.bands import BANDS, band_of

# Uncoded bit error rate of a Gray-coded constellation: scale * Q(sqrt(2 snr / spread)), for BPSK,
# QPSK, 16-QAM and 64-QAM (Halperin et al., Table 2).
_BER_SCALE = np.array([1.0, 1.0, 3.0 / 4.0, 7.0 / 12.0])
_SNR_SPREAD = np.array([1.0, 2.0, 10.0, 42.0])
# Log error rates by dB, a row per modulation. Linear interpolation errs by less than 1e-3 dB, also in single
# precision, does not underflow where the rate itself would, and costs a quarter of the special function.
_STEP_DB = 0.025
_TABLE_DB = np.arange(-60.0, 60.0 + _STEP_DB, _STEP_DB)
_LOG_BER = np.log(_BER_SCALE)[:, None] + log_ndtr(
    -np.sqrt(2.0 * 10.0 ** (_TABLE_DB / 10.0) / _SNR_SPREAD[:, None])
)
_MINUS_LOG_BER = -_LOG_BER  # ascends, as interpolation wants it
_TABLE = _LOG_BER.astype(np.float32)
_TABLE_RISE = np.diff(_LOG_BER, axis=1, append=_LOG_BER[:, -1:]).astype(np.float32)

_LEAST_SNR = 1.001e-6  # rounding must not lead below the tables
_LEAST_ESNR_DB = -30.0
_SLACK_DB = 0.01  # far more than the tables err

# What MCS 0 to 7 need, whatever the bandwidth, and the modulation in which it is measured.
RATE_ESNR_DB = np.array([4.0, 7.0, 9.0, 12.0, 16.0, 20.0, 21.0, 22.0])
_RATE_MODULATION = np.array([0, 1, 1, 2, 2, 3, 3, 3])
_FASTEST = int(_RATE_MODULATION.max())
# Of each modulation, what its MCS need and which of them is the first.
_MCS_OF = {
    modulation: (RATE_ESNR_DB[modulation == _RATE_MODULATION], int((modulation > _RATE_MODULATION).sum()))
    for modulation in range(_FASTEST + 1)
}
_HIGHEST_RATE_MBIT_S = max(band.top_rate_mbit_s for band in BANDS.values())
_LEAST_Q_MBIT_S, _LARGEST_ALPHA = 1e-3, 1e6  # so that no discrepancy is beyond 1e11


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
        require_within(
            self, {"q_mbit_s": (_LEAST_Q_MBIT_S, _HIGHEST_RATE_MBIT_S), "alpha": (0.0, _LARGEST_ALPHA)}
        )


@harmless_underflow
def esnr_db(snr: Float[np.ndarray, "links subcarriers"]) -> Float[np.ndarray, "links 4"]:
    """Effective SNR of each link for BPSK, QPSK, 16-QAM and 64-QAM, dB.

    Args:
        snr: Linear SNR per subcarrier, >= 0.

    Returns:
        Effective SNR, in [-30, 60] dB.
    """
    places = _Places.of(snr)
    return np.stack([_flat_snr_db(places, modulation) for modulation in range(4)], axis=-1)


class _Places(NamedTuple):
    """Where SNRs lie in the tables: the entry below, and how far to the next.

    Links come last, which makes sums over subcarriers fast.
    """

    below: Int[np.ndarray, "subcarriers links"]
    beyond: Float32[np.ndarray, "subcarriers links"]

    def only(self, links: Int[np.ndarray, " some"]) -> "_Places":
        """Some of the links."""
        return _Places(*(column.take(links, axis=-1) for column in self))

    @classmethod
    def of(cls, snr: Float[np.ndarray, "links subcarriers"]) -> "_Places":
        """Look SNRs up."""
        place = np.maximum(snr.T, _LEAST_SNR, order="C", dtype=np.float32, casting="same_kind")
        np.log10(place, out=place)
        place *= 10.0 / _STEP_DB
        place -= _TABLE_DB[0] / _STEP_DB
        np.minimum(place, len(_TABLE_DB) - 1.0, out=place)
        below = np.floor(place)
        place -= below
        return cls(below.astype(np.intp), place)


def _flat_snr_db(places: _Places, modulation: int) -> Float[np.ndarray, " links"]:
    """SNR of the flat channel with the same mean error rate, dB."""
    log_ber = _TABLE_RISE[modulation].take(places.below)
    log_ber *= places.beyond
    log_ber += _TABLE[modulation].take(places.below)
    highest = np.maximum.reduce(log_ber)
    log_ber -= highest
    np.exp(log_ber, out=log_ber)
    highest += np.log(np.add.reduce(log_ber) / len(log_ber))
    flat_db = np.interp(-highest, _MINUS_LOG_BER[modulation], _TABLE_DB)
    return np.maximum(flat_db, _LEAST_ESNR_DB)


@harmless_underflow
def rate_and_esnr(
    snr: Float[np.ndarray, "links subcarriers"], *, bandwidth_hz: float = 20e6
) -> tuple[Float[np.ndarray, " links"], Float[np.ndarray, " links"]]:
    """Rate of each link, and its effective SNR for 64-QAM.

    The same as `rate_mbit_s` of `esnr_db`, but a modulation is only looked at where no faster one passes, and
    where it can: effective SNR grows with the modulation, whose error rate is the less convex (Arrow
    and Pratt's theorem), so that for 64-QAM is the highest.

    Args:
        snr: Linear SNR per subcarrier, >= 0.
        bandwidth_hz: Width of the channel, 20 or 40 MHz.

    Returns:
        Rate, Mb/s, and effective SNR, dB.
    """
    places, rates = _Places.of(snr), band_of(bandwidth_hz).rates_mbit_s
    shown_db = _flat_snr_db(places, _FASTEST)
    rate, waits = np.zeros(len(snr)), np.ones(len(snr), dtype=bool)
    for modulation, (needs_db, first) in reversed(_MCS_OF.items()):
        able = (waits & (shown_db >= needs_db[0] - _SLACK_DB)).nonzero()[0]
        if not len(able):
            continue
        if modulation == _FASTEST:
            esnr = shown_db.take(able)
        else:
            some = places if len(able) == len(snr) else places.only(able)
            esnr = _flat_snr_db(some, modulation)
        n_passed = needs_db.searchsorted(esnr, side="right")
        rate[able] = rates.take(first - 1 + n_passed, mode="clip") * (n_passed > 0)
        waits[able] = n_passed == 0
        if not waits.any():
            break
    return rate, shown_db


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
