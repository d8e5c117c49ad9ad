"""An evaluation in numbers: means, paired ratios and differences, each with a 95 % interval."""

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from jaxtyping import Float
from scipy import stats

from baselines.evaluation.intervals import CONFIDENCE, INTERVALS, Estimate, mean_of, ratio
from baselines.evaluation.plan import Plan

__all__ = [
    "CONFIDENCE",
    "FIGURES",
    "N_RESAMPLES",
    "Estimate",
    "Paired",
    "Samples",
    "Summary",
    "bootstrap",
    "summarise",
]

N_RESAMPLES = 9_999
_SEED = 0  # of the resampling: the same samples give the same interval
# Columns of episodes.parquet that are figures, and their units.
FIGURES: Mapping[str, str] = {
    "mapped_share": "share",
    "err_last10": "1",
    "ate_trans": "m^2",
    "ate_rot": "1",
    "rendezvous": "count",
    "share_above": "share",
    "coverage": "share",
    "bumps": "count",
    "distance_m": "m",
    "bytes_sent": "byte",
    "airtime_s": "s",
    "n_steps": "count",
}

Samples = tuple[Float[np.ndarray, " trials"], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Paired:
    """A policy against the reference on the same worlds.

    Attributes:
        n_pairs: Trials.
        score_difference: Mean of its ``mapped_share`` less the reference's.
        err_ratio: Its mean ``err_last10`` over the reference's.
        ate_trans_difference: Mean of its ``ate_trans`` less the reference's, m^2.
        ate_rot_difference: Mean of its ``ate_rot`` less the reference's.
    """

    n_pairs: int
    score_difference: Estimate
    err_ratio: Estimate
    ate_trans_difference: Estimate
    ate_rot_difference: Estimate


@dataclass(frozen=True, slots=True, kw_only=True)
class Summary:
    """An evaluation in numbers: ``summary.json``.

    Attributes:
        scenario: Name.
        trials: Trials of each policy.
        seed: Root of all seeds.
        reference: Policy that ``paired`` compares with.
        intervals: How the intervals were made.
        units: Unit of each figure.
        policies: Mean of each figure, by policy.
        paired: Every other policy against the reference.
        warnings: Why the numbers are to be taken with care.
    """

    scenario: str
    trials: int
    seed: int
    reference: str
    intervals: str
    units: Mapping[str, str]
    policies: Mapping[str, Mapping[str, Estimate]]
    paired: Mapping[str, Paired]
    warnings: tuple[str, ...] = ()


def summarise(episodes: pd.DataFrame, plan: Plan) -> Summary:
    """Means of all policies, and every policy against the reference."""
    samples = {p: episodes[episodes["policy"] == p].sort_values("trial") for p in plan.policies}
    reference = samples[plan.reference]
    return Summary(
        scenario=plan.scenario.name,
        trials=plan.trials,
        seed=plan.seed,
        reference=plan.reference,
        intervals=f"{100 * CONFIDENCE:.0f} %, {INTERVALS}",
        units=FIGURES,
        policies={p: {f: mean_of(rows[f].to_numpy(float)) for f in FIGURES} for p, rows in samples.items()},
        paired={p: _paired(rows, reference) for p, rows in samples.items() if p != plan.reference},
        warnings=plan.warnings,
    )


def bootstrap(
    samples: Samples, statistic: Callable[..., Any], *, method: str = "BCa", n_resamples: int = N_RESAMPLES
) -> Estimate:
    """A statistic of paired samples with its interval.

    Args:
        samples: One array for each argument of the statistic; row k of all is trial k.
        statistic: Takes the samples and ``axis``.
        method: ``BCa`` (percentile where that is undefined) or ``percentile``.
        n_resamples: More make the interval's own chance smaller.

    Returns:
        The statistic; without an interval if there is one trial only, or if it is not finite.
    """
    value = float(statistic(*samples, axis=-1))
    if len(samples[0]) < 2 or not np.isfinite(value):
        return Estimate(value if np.isfinite(value) else None, None, None)
    for attempt in dict.fromkeys((method, "percentile")):
        low, high = _interval(samples, statistic, attempt, n_resamples)
        if np.isfinite(low) and np.isfinite(high):
            return Estimate(value, low, high)
    return Estimate(value, None, None)


def _interval(
    samples: Samples, statistic: Callable[..., Any], method: str, n_resamples: int
) -> tuple[float, float]:
    """Interval of scipy, nan where the samples do not give one."""
    options: dict[str, Any] = {"method": method, "n_resamples": n_resamples, "batch": 1_000}
    options |= {"confidence_level": CONFIDENCE, "rng": np.random.default_rng(_SEED)}
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        found = stats.bootstrap(
            samples, statistic, paired=True, vectorized=True, **options
        ).confidence_interval
    return float(found.low), float(found.high)


def _paired(other: pd.DataFrame, reference: pd.DataFrame) -> Paired:
    """Compare two policies trial by trial."""

    def both(figure: str) -> Samples:
        return other[figure].to_numpy(float), reference[figure].to_numpy(float)

    def less(figure: str) -> np.ndarray:
        return np.subtract(*both(figure))

    return Paired(
        n_pairs=len(reference),
        score_difference=mean_of(less("mapped_share")),
        err_ratio=ratio(*both("err_last10")),
        ate_trans_difference=mean_of(less("ate_trans")),
        ate_rot_difference=mean_of(less("ate_rot")),
    )
