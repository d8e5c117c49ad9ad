"""Paths that another ray tracer found, compared with ours one to one."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int
from scipy.optimize import linear_sum_assignment

from benchmarks.reference_files import PathList, Reference
from wifipgo.radio.propagation.materials import SPEED_OF_LIGHT_M_S
from wifipgo.radio.propagation.paths import Paths, trace_paths
from wifipgo.se2 import wrap_angle

# Paths of equal order that differ by more than this are never the same one. A hundred times
# what is asked of ours, so that a wrong delay shows as a deviation and not only as a miss.
_SAME_DELAY_S = 1e-9
_SAME_AZIMUTH_RAD = np.deg2rad(1.0)


class Agreement(NamedTuple):
    """Our paths beside known ones.

    Attributes:
        n_links: Links compared.
        known: Known paths of order 0, 1 and 2, and over an edge.
        ours: Our paths, likewise.
        total: Largest modulus of the difference of all paths of a link, over the free-space field.
        deviations: Ours minus known of every pair of paths taken as the same: azimuth at the
            receiver and at the transmitter (deg), delay (ns), gain (dB) and phase (deg).
    """

    n_links: int
    known: Int[np.ndarray, "4"]
    ours: Int[np.ndarray, "4"]
    total: float
    deviations: Float[np.ndarray, "matched 5"]

    @property
    def matched(self) -> int:
        """Paths that are in both."""
        return len(self.deviations)

    @property
    def missed(self) -> int:
        """Known paths that are not among ours."""
        return int(self.known.sum()) - self.matched

    @property
    def extra(self) -> int:
        """Our paths that are not known."""
        return int(self.ours.sum()) - self.matched


def traced(reference: Reference) -> Paths:
    """Our paths of every link."""
    return trace_paths(
        reference.tx_m,
        reference.rx_m,
        reference.surfaces,
        carrier_hz=reference.carrier_hz,
        max_order=reference.max_order,
        penetration=reference.penetration,
        diffraction=reference.diffraction,
    )


def compare(references: Sequence[Reference]) -> Agreement:
    """Trace the links of all scenes and match our paths with the known ones, each with at most one."""
    return joined([_compared(reference) for reference in references])


def joined(parts: Sequence[Agreement]) -> Agreement:
    """Several comparisons as one."""
    return Agreement(
        sum(part.n_links for part in parts),
        np.sum([part.known for part in parts], axis=0),
        np.sum([part.ours for part in parts], axis=0),
        max(part.total for part in parts),
        np.concatenate([part.deviations for part in parts]),
    )


def _compared(reference: Reference) -> Agreement:
    paths, known = traced(reference), reference.known
    link, column = np.nonzero(paths.order >= 0)
    ours = PathList(
        link,
        paths.order[link, column],
        paths.delay_s[link, column],
        paths.azimuth_rx_rad[link, column],
        paths.azimuth_tx_rad[link, column],
        paths.gain[link, column],
    )
    pairs = [_matched(ours, known, link) for link in range(len(paths.order))]
    ours_row, known_row = np.concatenate([np.empty((2, 0), dtype=int), *pairs], axis=1)
    return Agreement(
        len(paths.order),
        _by_kind(known.order),
        _by_kind(ours.order),
        _total(ours, known, reference),
        _deviations(
            PathList(*(values[ours_row] for values in ours)),
            PathList(*(values[known_row] for values in known)),
        ),
    )


def _by_kind(order: Int[np.ndarray, " paths"]) -> Int[np.ndarray, "4"]:
    return np.bincount(np.minimum(order, 3), minlength=4)


def _total(ours: PathList, known: PathList, reference: Reference) -> float:
    """See `Agreement.total`."""
    gap_m = np.linalg.norm(reference.rx_m - reference.tx_m, axis=1)
    apart = np.zeros(len(gap_m), dtype=complex)
    np.add.at(apart, ours.link, ours.gain)
    np.subtract.at(apart, known.link, known.gain)
    wavelengths = gap_m * reference.carrier_hz / SPEED_OF_LIGHT_M_S
    return float(np.max(np.abs(apart) * 4.0 * np.pi * wavelengths, initial=0.0))


def _matched(ours: PathList, known: PathList, link: int) -> Int[np.ndarray, "2 matched"]:
    """Rows of paths of one link that are the same: least sum of deviations among those allowed."""
    own, other = np.flatnonzero(ours.link == link), np.flatnonzero(known.link == link)
    delay = np.abs(ours.delay_s[own, None] - known.delay_s[other]) / _SAME_DELAY_S
    azimuth = np.abs(wrap_angle(ours.azimuth_rx_rad[own, None] - known.azimuth_rx_rad[other]))
    azimuth /= _SAME_AZIMUTH_RAD
    allowed = (delay < 1.0) & (azimuth < 1.0) & (ours.order[own, None] == known.order[other])
    row, column = linear_sum_assignment(np.where(allowed, delay + azimuth, 1e6))
    same = allowed[row, column]
    return np.stack([own[row[same]], other[column[same]]])


def _deviations(ours: PathList, known: PathList) -> Float[np.ndarray, "paths 5"]:
    """See `Agreement.deviations`."""
    ratio = ours.gain / known.gain
    return np.stack(
        [
            np.rad2deg(wrap_angle(ours.azimuth_rx_rad - known.azimuth_rx_rad)),
            np.rad2deg(wrap_angle(ours.azimuth_tx_rad - known.azimuth_tx_rad)),
            1e9 * (ours.delay_s - known.delay_s),
            20.0 * np.log10(np.abs(ratio)),
            np.angle(ratio, deg=True),
        ],
        axis=1,
    )
