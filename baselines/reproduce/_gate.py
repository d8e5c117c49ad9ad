"""Whether the gate of Eq. 11 parts outliers from the rest."""

from typing import NamedTuple

import numpy as np
import pandas as pd
from jaxtyping import Float

from baselines.evaluation.intervals import linearised
from baselines.reproduce import _rules
from baselines.reproduce._claims import BESIDE, HEADLINE, NO_EPISODES, Claim, Found, Sentence, judged, missing
from wifipgo.graph.outliers.aoa_weights import PAPER_GATE_RAD

SENTENCE = Sentence(
    "fig10.gate",
    "AOA measurements reliably detect outliers past 7.2 deg of difference.",
    "Sec. 7.3, Fig. 10 (c), (d)",
)


def claim(met: pd.DataFrame) -> Claim:
    """Whether the gate parts outliers from the rest."""
    if met.empty:
        found = [missing("all relative poses", NO_EPISODES)]
        return judged(SENTENCE, quantity="", rule=_rules.at_least(0.6, 0.0), found=found)
    found = [_parted(met, "all relative poses", HEADLINE)]
    for low, high in ((0.0, 1.0), (1.0, 1.6), (1.6, 2.3)):
        near = met[(met.range_m >= low) & (met.range_m < high)]
        found.append(_parted(near, f"ranges of {low:g} to {high:g} m", BESIDE))
    return judged(
        SENTENCE,
        quantity="share of outliers past the gate less share of good measurements past it",
        rule=_rules.at_least(0.6, 0.0),
        found=found,
    )


def _parted(met: pd.DataFrame, conditions: str, role: str) -> Found:
    """Share of outliers flagged less share of others flagged; trials are what is independent."""
    if met.is_outlier.nunique() < 2:
        return missing(conditions, "no outliers, or nothing else", role)
    flagged = met.off_rad.abs() >= PAPER_GATE_RAD
    of_bad, of_good = (_flagged(met, flagged, which) for which in (met.is_outlier, ~met.is_outlier))
    note = (
        f"{100 * of_bad.share:.0f} % of outliers and {100 * of_good.share:.0f} % of the others are past it; "
        f"{len(met)} poses"
    )
    estimate = linearised(of_bad.share - of_good.share, of_bad.influence - of_good.influence)
    return Found(conditions=conditions, estimate=estimate, n=len(of_bad.influence), role=role, note=note)


class _Flagged(NamedTuple):
    """A share of measurements, and how much each trial moves it."""

    share: float
    influence: Float[np.ndarray, " trials"]


def _flagged(met: pd.DataFrame, flagged: pd.Series, which: pd.Series) -> _Flagged:
    """Share of some measurements that are past the gate."""
    hit, n = (values.groupby(met.trial).sum().to_numpy(float) for values in (which & flagged, which))
    share = float(hit.sum() / n.sum())
    return _Flagged(share, (hit - share * n) / n.mean())
