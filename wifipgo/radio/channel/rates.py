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
# Log error rates as straight pieces, a row per modulation: `below + rise * snr`, 64 pieces an octave. Which
# piece is read off the exponent and first digits of a number in single precision. They err by less than
# 1e-4 dB, do not underflow where the rate itself would, and cost a fraction of the special function.
_PIECES, _DIGITS = 64, 23 - 6  # an octave, and the binary digits that a piece leaves
_LEAST_SNR, _MOST_SNR = 2.0**-20, 2.0**20
_FIRST_PIECE = int(np.float32(_LEAST_SNR).view(np.int32)) >> _DIGITS
_KNOTS = np.append(np.arange(_FIRST_PIECE, _FIRST_PIECE + 40 * _PIECES), 0).astype(np.int32) << _DIGITS
_SNR = np.append(_KNOTS[:-1].view(np.float32).astype(float), _MOST_SNR)
_LOG_BER = np.log(_BER_SCALE)[:, None] + log_ndtr(-np.sqrt(2.0 * _SNR / _SNR_SPREAD[:, None]))
_RISE = np.diff(_LOG_BER) / np.diff(_SNR)
_BELOW = _LOG_BER[:, :-1] - _RISE * _SNR[:-1]
_RISES, _BELOWS = (  # looked up by all leading digits: what comes before the first piece is never asked for
    np.concatenate([np.zeros((4, _FIRST_PIECE)), table, table[:, -1:]], axis=1).astype(np.float32)
    for table in (_RISE, _BELOW)
)
# The way back: the piece by the logarithm of how far a log error rate is below that without any signal.
_LOG_BER_AT_0 = np.log(0.5 * _BER_SCALE).astype(np.float32)
_STEP, _LOWEST = 1.0 / 256.0, -8.0
_DEPTHS = _LOWEST + _STEP * (np.arange(round((15.0 - _LOWEST) / _STEP)) + 0.5)
_PIECE_AT = np.stack(
    [
        _FIRST_PIECE + np.searchsorted(at_0 - log_ber[1:-1], np.exp(_DEPTHS)).astype(np.intp)
        for at_0, log_ber in zip(np.log(0.5 * _BER_SCALE), _LOG_BER, strict=True)
    ]
)
_DB = np.float32(10.0 / np.log(10.0))  # of a natural logarithm

_LEAST_ESNR_DB = -30.0
_FEW_LINKS = 32  # of which calls cost more than numbers
_SLACK_DB = 0.01  # far more than the tables err

# What MCS 0 to 7 need, whatever the bandwidth, and the modulation in which it is measured.
RATE_ESNR_DB = np.array([4.0, 7.0, 9.0, 12.0, 16.0, 20.0, 21.0, 22.0])
# Below this mean SNR surely no rate passes.
LEAST_MEAN_SNR = float(10.0 ** (0.1 * (RATE_ESNR_DB.min() - _SLACK_DB)))
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
        exchange_s: Time of each iteration in which a pair that is due exchanges; it has met once all is over
            the link. 0: an exchange takes no time.
        image_bytes: What goes with each pose that the other does not hold yet, as an image of the place;
            it takes time only with ``exchange_s``.
    """

    q_mbit_s: float = 39.0
    alpha: float = 1.0
    exchange_s: float = 0.0
    image_bytes: int = 0

    def __post_init__(self) -> None:
        """Reject values that cannot mean anything."""
        require_within(
            self, {"q_mbit_s": (_LEAST_Q_MBIT_S, _HIGHEST_RATE_MBIT_S), "alpha": (0.0, _LARGEST_ALPHA)}
        )
        require_within(self, {"exchange_s": (0.0, 1e6), "image_bytes": (0, 10**9)})


@harmless_underflow
def esnr_db(snr: Float[np.ndarray, "links subcarriers"]) -> Float[np.ndarray, "links 4"]:
    """Effective SNR of each link for BPSK, QPSK, 16-QAM and 64-QAM, dB.

    Args:
        snr: Linear SNR per subcarrier, >= 0.

    Returns:
        Effective SNR, in [-30, 60] dB.
    """
    return _flat_snrs_db(_Places.of(snr.T)).T.astype(float)


class _Places(NamedTuple):
    """SNRs, and which piece of the tables each is on.

    Links come last, which makes sums over subcarriers fast.
    """

    snr: Float32[np.ndarray, "subcarriers links"]
    piece: Int[np.ndarray, "subcarriers links"]

    def only(self, links: Int[np.ndarray, " some"]) -> "_Places":
        """Some of the links."""
        return _Places(*(column.take(links, axis=-1) for column in self))

    @classmethod
    def of(cls, snr: Float[np.ndarray, "subcarriers links"]) -> "_Places":
        """Look SNRs up."""
        within = np.maximum(snr, _LEAST_SNR, order="C", dtype=np.float32, casting="same_kind")
        np.minimum(within, _MOST_SNR, out=within)
        return cls(within, np.right_shift(within.view(np.int32), _DIGITS, dtype=np.intp))


def _flat_snr_db(places: _Places, modulation: int) -> Float32[np.ndarray, " links"]:
    """SNR of the flat channel with the same mean error rate, dB."""
    log_ber = _RISES[modulation].take(places.piece)
    log_ber *= places.snr
    log_ber += _BELOWS[modulation].take(places.piece)
    highest = np.maximum.reduce(log_ber)
    log_ber -= highest
    np.exp(log_ber, out=log_ber)
    highest += np.log(_added(log_ber) * np.float32(1.0 / len(log_ber)))
    return _snr_db(highest, modulation)


def _flat_snrs_db(places: _Places) -> Float32[np.ndarray, "4 links"]:
    """The same for every modulation, in as many calls as for one, and to the bit."""
    log_ber = _RISES.take(places.piece, axis=1)
    log_ber *= places.snr
    log_ber += _BELOWS.take(places.piece, axis=1)
    highest = np.maximum.reduce(log_ber, axis=1)
    log_ber -= highest[:, None]
    np.exp(log_ber, out=log_ber)
    total = np.add.accumulate(log_ber, axis=1)[:, -1]
    highest += np.log(total * np.float32(1.0 / log_ber.shape[1]))
    return _snr_db(highest, np.arange(4)[:, None])


def _added(terms: Float32[np.ndarray, "subcarriers links"]) -> Float32[np.ndarray, " links"]:
    """Sum over subcarriers, one after the other: the same bits for any number of links."""
    if terms.shape[1] > 1:
        return np.add.reduce(terms)
    return np.add.accumulate(terms)[-1]


def _snr_db(
    log_ber: Float32[np.ndarray, "*rows links"], modulation: int | Int[np.ndarray, "rows 1"]
) -> Float32[np.ndarray, "*rows links"]:
    """SNR of a flat channel with these log error rates, dB, by the same pieces."""
    depth = np.maximum(_LOG_BER_AT_0[modulation] - log_ber, np.float32(1e-7))
    at = np.log(depth)
    at -= np.float32(_LOWEST)
    at *= np.float32(1.0 / _STEP)
    np.maximum(at, np.float32(0.0), out=at)
    np.minimum(at, np.float32(_PIECE_AT.shape[1] - 1), out=at)
    piece = _PIECE_AT.ravel().take(at.astype(np.intp) + modulation * _PIECE_AT.shape[1])
    piece += modulation * _RISES.shape[1]
    snr = log_ber - _BELOWS.ravel().take(piece)
    snr /= _RISES.ravel().take(piece)
    flat_db = np.log(np.maximum(snr, np.float32(10.0 ** (0.1 * _LEAST_ESNR_DB))))
    flat_db *= _DB
    return flat_db


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
    return carried(snr.T, bandwidth_hz=bandwidth_hz)


def carried(
    snr: Float[np.ndarray, "subcarriers links"], *, bandwidth_hz: float
) -> tuple[Float[np.ndarray, " links"], Float[np.ndarray, " links"]]:
    """`rate_and_esnr` with links last."""
    places, n_links = _Places.of(snr), snr.shape[1]
    if n_links <= _FEW_LINKS:
        each_db = _flat_snrs_db(places)
        return rate_mbit_s(each_db.T, bandwidth_hz=bandwidth_hz), each_db[_FASTEST].astype(float)
    shown_db = _flat_snr_db(places, _FASTEST)
    best, waits = np.zeros(n_links, dtype=np.intp), np.ones(n_links, dtype=bool)
    for modulation, (needs_db, first) in reversed(_MCS_OF.items()):
        able = waits & (shown_db >= needs_db[0] - _SLACK_DB)
        n_able = np.count_nonzero(able)
        if not n_able:
            continue
        few = 2 * n_able < n_links  # of many, to choose costs more than to work out all
        which = able.nonzero()[0] if few else np.arange(n_links)
        if modulation == _FASTEST:
            esnr = shown_db[which]
        else:
            esnr = _flat_snr_db(places.only(which) if few else places, modulation)
        n_passed = needs_db.searchsorted(esnr, side="right") * able[which]
        best[which] = np.maximum(best[which], (first + n_passed) * (n_passed > 0))
        waits &= best == 0
        if not waits.any():
            break
    rates = np.append(0.0, band_of(bandwidth_hz).rates_mbit_s)
    return rates.take(best), shown_db.astype(float)


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
