"""Channels of 802.11n: what an Intel 5300 reports of them and which rates they carry.

IEEE 802.11n-2009: subcarriers 312.5 kHz apart, of which a report holds every second (20 MHz,
Ng = 2) or every fourth (40 MHz, Ng = 4); rates for one stream and a guard interval of 800 ns.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from wifipgo.errors import require

SUBCARRIER_SPACING_HZ = 312.5e3


class Band(NamedTuple):
    """One channel width.

    Attributes:
        bandwidth_hz: Width over which power and noise are spread.
        subcarriers: Indices of the reported subcarriers, in units of `SUBCARRIER_SPACING_HZ`.
        rates_mbit_s: Data rates of MCS 0 to 7.
    """

    bandwidth_hz: float
    subcarriers: Int[np.ndarray, " subcarriers"]
    rates_mbit_s: Float[np.ndarray, " rates"]

    @property
    def top_rate_mbit_s(self) -> float:
        """The highest rate."""
        return float(self.rates_mbit_s[-1])


_NARROW = Band(
    20e6,
    np.concatenate([np.arange(-28, 0, 2), [-1], np.arange(1, 28, 2), [28]]),
    np.array([6.5, 13.0, 19.5, 26.0, 39.0, 52.0, 58.5, 65.0]),
)
_WIDE = Band(
    40e6,
    np.arange(-58, 59, 4),
    np.array([13.5, 27.0, 40.5, 54.0, 81.0, 108.0, 121.5, 135.0]),
)
BANDS: Mapping[float, Band] = MappingProxyType({band.bandwidth_hz: band for band in (_NARROW, _WIDE)})
for _band in BANDS.values():
    for _array in _band[1:]:
        _array.setflags(write=False)


def band_of(bandwidth_hz: float) -> Band:
    """The channel of a width.

    Raises:
        ValueError: A width other than 20 or 40 MHz.
    """
    require(bandwidth_hz in BANDS, "bandwidth_hz", "20e6 or 40e6", bandwidth_hz)
    return BANDS[bandwidth_hz]
