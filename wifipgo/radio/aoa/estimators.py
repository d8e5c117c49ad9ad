"""Angle of arrival: profiles over direction and their peaks (paper Eqs. 5, 6, 10).

A robot turns in place while packets arrive. Between its two antennas the phase of
a plane wave from azimuth ``g`` is ``2 pi gap / lambda cos(g - heading)``; comparing
what was received with that steering vector for every ``g`` gives the profile. All
links of a step share one turn, so all profiles are one matrix product.

This module has the antenna pair and the table of estimators; a new one is a row of it. What
it stands on is good for any aperture: `wifipgo.radio.aoa.steering`, `bartlett`, `music`,
`peaks`, `confidence` and, for what accuracy is possible, `cramer_rao`.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from jaxtyping import Complex, Float

from wifipgo.arithmetic import harmless_underflow
from wifipgo.errors import pick, require, require_within
from wifipgo.radio.aoa.bartlett import bartlett_profiles
from wifipgo.radio.aoa.music import music_profiles

# Beyond these, phases lose their digits or arrays their sense; no robot comes near.
GAP_LIMITS_M = (1e-4, 10.0)
_LIMITS: Mapping[str, tuple[float, float]] = MappingProxyType(
    {
        "antenna_gap_m": GAP_LIMITS_M,
        "turn_rad": (1e-6, 100.0),
        "n_positions": (8.0, 4096.0),
        "n_azimuths": (72.0, 7200.0),
        "n_peaks": (1.0, 10.0),
        "n_paths": (1.0, 7.0),
    }
)
_DEEPEST_FADE = 1e-30
_SCALE_LIMITS = (0.01, 100.0)
_MOST_STEERING = 1 << 22  # packets x directions of one pair of antennas: 32 MB


@dataclass(frozen=True, slots=True, kw_only=True)
class AoaConfig:
    """Antenna pair, turn and grid. Quarter turn: paper Sec. 4; gap: Sec. 7.2.1; the rest is ours.

    ``n_paths`` is the size of MUSIC's signal subspace, and only its. The product of two paths
    spans three dimensions over subcarriers: their own terms, which share one, and the
    two cross terms, which turn opposite ways.

    Attributes:
        antenna_gap_m: Distance between the two antennas.
        antenna_scale: One factor per robot on how far apart its antennas are, or empty for all 1.
        turn_rad: Angle by which a robot turns in place at the end of an iteration.
        n_positions: Packets that arrive during a turn.
        n_azimuths: Directions of a profile, a multiple of 72 up to 7200.
        aoa_estimator: A name in `wifipgo.radio.aoa.ESTIMATORS`; "ratio" is the paper's.
        n_peaks: Highest peaks of a profile that count as directions of a neighbour (N of Eq. 10).
        n_paths: Paths of MUSIC's signal subspace.
    """

    antenna_gap_m: float = 0.22
    antenna_scale: tuple[float, ...] = ()
    turn_rad: float = np.pi / 2.0
    n_positions: int = 64
    n_azimuths: int = 360
    aoa_estimator: str = "product"
    n_peaks: int = 2
    n_paths: int = 3

    def __post_init__(self) -> None:
        """Reject values that cannot mean anything."""
        require_within(self, _LIMITS)
        bins, size = self.n_azimuths, self.n_azimuths * self.n_positions
        require(bins % 72 == 0, "AoaConfig.n_azimuths", "a multiple of 72", bins)
        require(size <= _MOST_STEERING, "AoaConfig.n_azimuths * n_positions", f"<= {_MOST_STEERING}", size)
        pick(ESTIMATORS, self.aoa_estimator, "AOA estimator")
        self._check_scale()

    def _check_scale(self) -> None:
        """Reject factors that cannot be, or lead to a gap that cannot be."""
        (low, high), (least_m, most_m) = _SCALE_LIMITS, GAP_LIMITS_M
        for scale in self.antenna_scale:
            rule = f"all in {low:g}..{high:g}"
            require(low <= scale <= high, "AoaConfig.antenna_scale", rule, self.antenna_scale)
            rule = f"such that antennas are {least_m:g}..{most_m:g} m apart"
            within = least_m <= scale * self.antenna_gap_m <= most_m
            require(within, "AoaConfig.antenna_scale", rule, self.antenna_scale)


def turn_headings(cfg: AoaConfig) -> Float[np.ndarray, " positions"]:
    """Heading at each packet of the turn relative to the body frame, which is its end, rad."""
    return np.linspace(-cfg.turn_rad, 0.0, cfg.n_positions)


@harmless_underflow
def ratio_signal(
    csi: Complex[np.ndarray, "links 2 positions subcarriers"],
) -> Complex[np.ndarray, "links positions"]:
    """Channel ratio h1/h2 at the centre subcarrier: the paper's input of Eq. 5.

    The phase common to both antennas of a packet cancels. In a fade of the second
    antenna the ratio blows up: that is the paper's estimator, kept as it is up to a ratio of
    1e15, beyond which single precision has no square.
    """
    centre = csi[..., csi.shape[-1] // 2]
    tiny = np.finfo(np.float32).tiny
    power = np.maximum(np.abs(centre[:, 1]) ** 2, tiny)
    power = np.maximum(power, _DEEPEST_FADE * np.abs(centre[:, 0]) ** 2)
    behind = centre[:, 1].conj()
    return (centre[:, 0] * behind / power).astype(np.complex64)


@harmless_underflow
def product_signal(
    csi: Complex[np.ndarray, "links 2 positions subcarriers"],
) -> Complex[np.ndarray, "links positions"]:
    """Product h1 conj(h2) summed over subcarriers, then scaled to unit modulus.

    Same phase as the ratio and no blow-up in fades. Cross terms between paths turn
    with the subcarrier and largely cancel in the sum; the paths' own terms add up.

    Scaling every subcarrier to unit modulus before the sum was measured beside it: in
    traced rooms both fail equally often (concrete 2.0 and 2.2 % beyond 20 deg); on paths
    of random delays its median is lower (4 paths at 3 dB: 0.57 instead of 0.66 deg); at an
    SNR of 0 dB its error is 11 % larger; it takes nine times as long.
    """
    product = np.vecdot(csi[:, 1], csi[:, 0])
    return (product / np.maximum(np.abs(product), np.finfo(np.float32).tiny)).astype(np.complex64)


@harmless_underflow
def pair_snapshots(
    csi: Complex[np.ndarray, "links 2 positions subcarriers"],
) -> Complex[np.ndarray, "links subcarriers positions"]:
    """Product h1 conj(h2) of each subcarrier at unit modulus: the snapshots of MUSIC."""
    behind = csi[:, 1].conj()  # named, as a product in place of a nameless one is rounded otherwise
    product = csi[:, 0] * behind
    product /= np.maximum(np.abs(product), np.finfo(np.float32).tiny)
    return product.swapaxes(1, 2).astype(np.complex64)


def _bartlett(
    signal: Complex[np.ndarray, "links positions"],
    steering: Complex[np.ndarray, "positions grid"],
    cfg: AoaConfig,
) -> Float[np.ndarray, "links grid"]:
    """Share of the signal's power that each direction explains."""
    return bartlett_profiles(signal, steering)


def _music(
    snapshots: Complex[np.ndarray, "links subcarriers positions"],
    steering: Complex[np.ndarray, "positions grid"],
    cfg: AoaConfig,
) -> Float[np.ndarray, "links grid"]:
    """Share of each steering vector in the signal subspace, of as many paths as a link spans."""
    return music_profiles(snapshots, steering, n_paths=cfg.n_paths, fewer=True)


def _one_packet(cfg: AoaConfig) -> int:
    """A single vector needs no more."""
    return 1


def _one_more_than_paths(cfg: AoaConfig) -> int:
    """A subspace needs more packets than dimensions."""
    return cfg.n_paths + 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimator:
    """An angle-of-arrival estimator of an antenna pair.

    Attributes:
        snapshots: Of the CSI of a turn ``(links, 2, positions, subcarriers)``; links come first.
        spectrum: Profile ``(links, grid)`` in [0, 1] of those snapshots, given the steering vectors
            ``(positions, grid)`` and the configuration. An estimator that finds directions and no
            spectrum, as ESPRIT, gives lines at its directions. What heard nothing gets zeros.
        least_packets: Packets of a turn below which a link counts as not heard.
        meaning: In words.
    """

    snapshots: Callable[[np.ndarray], np.ndarray]
    spectrum: Callable[[np.ndarray, np.ndarray, AoaConfig], np.ndarray]
    least_packets: Callable[[AoaConfig], int] = _one_packet
    meaning: str


ESTIMATORS: Mapping[str, Estimator] = MappingProxyType(
    {
        "music": Estimator(
            snapshots=pair_snapshots,
            spectrum=_music,
            least_packets=_one_more_than_paths,
            meaning="the signal subspace of the subcarriers' products (Schmidt 1986)",
        ),
        "product": Estimator(
            snapshots=product_signal,
            spectrum=_bartlett,
            meaning="Bartlett's spectrum of the antennas' product, summed over subcarriers",
        ),
        "ratio": Estimator(
            snapshots=ratio_signal,
            spectrum=_bartlett,
            meaning="Bartlett's spectrum of the channel ratio: the paper's Eq. 5 up to a monotone map",
        ),
    }
)


@harmless_underflow
def pair_profiles(
    csi: Complex[np.ndarray, "links 2 positions subcarriers"],
    steering: Complex[np.ndarray, "positions grid"],
    cfg: AoaConfig,
) -> Float[np.ndarray, "links grid"]:
    """Profiles of an antenna pair by the estimator that the configuration names, in [0, 1].

    Raises:
        ValueError: If the estimator gets fewer subcarriers or packets than it takes.
    """
    estimator = ESTIMATORS[cfg.aoa_estimator]
    return estimator.spectrum(estimator.snapshots(csi), steering, cfg)


def least_packets(cfg: AoaConfig) -> int:
    """Packets of a turn below which the estimator that the configuration names is not defined."""
    return ESTIMATORS[cfg.aoa_estimator].least_packets(cfg)
