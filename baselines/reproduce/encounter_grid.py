"""Outlier methods on encounters: which encounters to compare them on, and the error each leaves.

Every method solves the same encounters, so comparisons are paired. The error is that of
the paper's Sec. 7.3, Eq. 12 + Eq. 13.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import product
from types import MappingProxyType

import numpy as np
from jaxtyping import Bool, Float

from baselines.reproduce.encounters import Encounter, EncounterConfig, simulate_encounter
from wifipgo.graph.bearings import Bearings
from wifipgo.graph.edges import Edges
from wifipgo.graph.metrics import ate_rot, ate_trans
from wifipgo.graph.outliers.methods import solve_robust

# Noise of a step of odometry in units of that of a relative pose, and what to call it.
ODOMETRY = MappingProxyType({0.1: "good", 0.3: "mid", 1.0: "noisy"})
OUTLIERS = ("random", "same", "gross")


def encounter_grid(
    *, ranges_m: Sequence[float], counts: Iterable[int], starts_known: Sequence[bool] = (True, False)
) -> list[EncounterConfig]:
    """Every range, quality of odometry, kind and number of outliers, none of them, starts known or not."""
    outliers = [("random", 0), *product(OUTLIERS, counts)]
    return [
        EncounterConfig(range_m=r, odometry_scale=odometry, kind=kind, n_outliers=n, start_known=known)
        for known, odometry, r, (kind, n) in product(starts_known, ODOMETRY, ranges_m, outliers)
    ]


def encounter(cfg: EncounterConfig, key: Sequence[int]) -> Encounter:
    """The encounter that a key draws."""
    return simulate_encounter(cfg, rng=np.random.default_rng(list(key)))


def ground_truth_error(
    solved: Float[np.ndarray, "robots times 3"], truth: Float[np.ndarray, "robots times 3"]
) -> float:
    """Eq. 12 + Eq. 13, mean over robots."""
    return float((ate_trans(solved, truth) + ate_rot(solved, truth)).mean())


def without(edges: Edges, dropped: Bool[np.ndarray, " edges"]) -> Edges:
    """The measurements with some of no weight: what nobody could know who sees no truth."""
    return replace(edges, weight=edges.weight * ~dropped)


def error_under(
    method: str, seen: Encounter, *, bearings: Bearings | None = None, without_outliers: bool = False
) -> float:
    """Ground-truth error that a method leaves.

    Args:
        method: A name in `wifipgo.graph.OUTLIER_METHODS`.
        seen: What was measured.
        bearings: Others than those of the encounter.
        without_outliers: Leave out what really is an outlier: no robot could.
    """
    edges = seen.edges
    if without_outliers:
        edges = without(edges, seen.is_outlier)
    solved, _ = solve_robust(
        seen.start,
        edges,
        seen.bearings if bearings is None else bearings,
        robots=(0, 1),
        outliers=method,
        start_sigma=seen.start_sigma,
    )
    return ground_truth_error(solved, seen.truth)
