"""Figures of a team's conduct, one a world: a table of what is compared, each with its function."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from baselines.conduct.conduct import Conduct

Figures = Float[np.ndarray, " worlds"]


class Measure(NamedTuple):
    """One figure of each world.

    Attributes:
        label: What it is, with its unit.
        decimals: As it is shown.
        of: The figure; where robots have one each, their mean.
    """

    label: str
    decimals: int
    of: Callable[[Conduct], Figures]


def longest_apart(met: Bool[np.ndarray, "worlds iterations robots"]) -> Figures:
    """Most iterations in a row in which a robot met nobody, mean over robots."""
    apart = np.zeros((met.shape[0], met.shape[2]))
    longest = apart
    for now in np.moveaxis(met, 1, 0):
        apart = np.where(now, 0.0, apart + 1.0)
        longest = np.maximum(longest, apart)
    return longest.mean(axis=1)


def since_met(met: Bool[np.ndarray, "worlds iterations robots"]) -> Figures:
    """Iterations at the end in which a robot met nobody, mean over robots."""
    back = met[:, ::-1].argmax(axis=1)
    return np.where(met.any(axis=1), back, met.shape[1]).mean(axis=1)


MEASURES: Mapping[str, Measure] = MappingProxyType(
    {
        "score": Measure("mapped, the score (% of the floor)", 1, lambda c: 100.0 * c.mapped[:, -1]),
        "seen": Measure("seen (%)", 1, lambda c: 100.0 * c.seen[:, -1]),
        "misplaced": Measure(
            "seen, but not where it is (%)", 1, lambda c: 100.0 * (c.seen[:, -1] - c.mapped[:, -1])
        ),
        "meetings": Measure("meetings of a robot", 1, lambda c: c.met.sum(axis=1).mean(axis=1)),
        "apart": Measure("longest time without a meeting (iterations)", 1, lambda c: longest_apart(c.met)),
        "since": Measure("last meeting before the end (iterations)", 1, lambda c: since_met(c.met)),
        "calling": Measure("time with a call up (%)", 1, lambda c: 100.0 * c.calling.mean(axis=(1, 2))),
        "away": Measure(
            "distance from the own start, mean (m)", 1, lambda c: c.from_start_m.mean(axis=(1, 2))
        ),
        "farthest": Measure(
            "distance from the own start, greatest (m)", 1, lambda c: c.from_start_m.max(axis=1).mean(axis=1)
        ),
        "driven": Measure("way of a robot (m)", 1, lambda c: c.driven_m[:, -1].mean(axis=1)),
        "off": Measure("position error, mean (m)", 2, lambda c: c.error_m.mean(axis=(1, 2))),
        "off_at_end": Measure("position error at the end (m)", 2, lambda c: c.error_m[:, -1].mean(axis=1)),
        "bumps": Measure("bumps of a robot", 1, lambda c: c.bumps[:, -1].mean(axis=1)),
    }
)


def met_within(met: Bool[np.ndarray, "worlds iterations robots"], window: int) -> np.ndarray:
    """Share of robots that met at least once in each window of some iterations, (worlds, windows)."""
    begins = np.arange(0, met.shape[1], window)
    return np.logical_or.reduceat(met, begins, axis=1).mean(axis=2)


def error_by_distance(conduct: Conduct, edges_m: Float[np.ndarray, " edges"]) -> np.ndarray:
    """Mean position error while robots are so far from their starts, (worlds, bins); nan where none was.

    Args:
        conduct: Of many worlds.
        edges_m: Ends of the bins, in order; what lies beyond the last counts to no bin.
    """
    n_worlds, n_bins = len(conduct.met), len(edges_m) - 1
    place = np.digitize(conduct.from_start_m, edges_m) - 1
    inside = (place >= 0) & (place < n_bins)
    cell = (np.arange(n_worlds)[:, None, None] * n_bins + place)[inside]
    counts = np.bincount(cell, minlength=n_worlds * n_bins)
    sums = np.bincount(cell, weights=conduct.error_m[inside], minlength=n_worlds * n_bins)
    means = np.where(counts > 0, sums / np.maximum(counts, 1), np.nan)
    return means.reshape(n_worlds, n_bins)
