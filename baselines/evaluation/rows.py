"""Rows of a table of results: figures by policy, and the paired comparison; for screen and paper."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from baselines.evaluation.statistics import Estimate, Summary

# Figure of the summary, what to call it, the unit that it is shown in, and which way is better, if any.
_FIGURES = (
    ("mapped_share", "score: mapped share", 1.0, 1),
    ("err_last10", "Err, last 10 iterations", 1.0, -1),
    ("share_above", "share above threshold", 1.0, -1),
    ("ate_trans", "ATE, translation (m²)", 1.0, -1),
    ("ate_rot", "ATE, rotation", 1.0, -1),
    ("rendezvous", "rendezvous", 1.0, 0),
    ("coverage", "share of cells seen", 1.0, 1),
    ("distance_m", "distance, team (m)", 1.0, 0),
    ("bumps", "bumps", 1.0, -1),
    ("bytes_sent", "sent in all (kB)", 1e3, 0),
    ("airtime_s", "solving by messages (s on the air)", 1.0, 0),
    ("n_steps", "iterations", 1.0, 0),
)
# Field of the comparison, the figure that it compares, how, and what to call it.
COMPARED = (
    ("score_difference", "mapped_share", "difference", "score"),
    ("err_ratio", "err_last10", "ratio", "Err"),
    ("ate_trans_difference", "ate_trans", "difference", "ATE (m²)"),
    ("ate_rot_difference", "ate_rot", "difference", "ATE, rotation"),
)
_SIGNS: Mapping[str, str] = {"difference": "+", "ratio": ""}
# Columns of a ladder, one policy a row.
_LADDER = {"mapped_share": "mapped share", "err_last10": "Err, last 10", "ate_trans": "ATE (m²)"}
SIDE_BY_SIDE = 3  # more policies than this make a ladder, the best score first


class Row(NamedTuple):
    """One quantity of every policy.

    Attributes:
        label: What it is.
        estimates: One for each policy, None where there is nothing to say.
        unit: That it is shown in.
        sign: Of positive numbers.
        better: 1 if more is better, -1 if less is, 0 if neither.
    """

    label: str
    estimates: Sequence[Estimate | None]
    unit: float = 1.0
    sign: str = ""
    better: int = 0

    @property
    def best(self) -> frozenset[int]:
        """Places of the best values, as printed; none where nothing is better, or all are the same."""
        values = {k: e.value for k, e in enumerate(self.estimates) if e is not None and e.value is not None}
        if not self.better or not values:
            return frozenset()
        printed = [cell.partition(" ")[0] for cell in self.cells()]
        best = printed[max(values, key=lambda k: self.better * values[k])]
        places = frozenset(k for k in values if printed[k] == best)
        return places if len(places) < len(values) else frozenset()

    def cells(self, digits: int = 3) -> list[str]:
        """Every estimate as text."""
        return [
            "" if e is None else shown(e, unit=self.unit, sign=self.sign, digits=digits)
            for e in self.estimates
        ]


def figure_rows(summary: Summary, policies: Sequence[str]) -> list[Row]:
    """Every figure."""
    return [
        Row(label, [summary.policies[policy][figure] for policy in policies], unit, "", better)
        for figure, label, unit, better in _FIGURES
    ]


def paired_rows(summary: Summary, policies: Sequence[str]) -> list[Row]:
    """Every policy against the reference, which has no estimates of its own; none where it is alone."""
    found = [summary.paired.get(policy) for policy in policies]
    if not any(found):
        return []
    return [
        Row(
            f"{name}, {how}",
            [None if pair is None else getattr(pair, field) for pair in found],
            sign=_SIGNS[how],
        )
        for field, _, how, name in COMPARED
    ]


def ladder_rows(summary: Summary, policies: Sequence[str]) -> list[Row]:
    """What a ladder shows of the figures."""
    rows = figure_rows(summary, policies)
    by_figure = {figure: row for (figure, *_), row in zip(_FIGURES, rows, strict=True)}
    return [by_figure[figure]._replace(label=label) for figure, label in _LADDER.items()]


def by_score(summary: Summary, policies: Sequence[str]) -> list[str]:
    """Policies, the best score first."""
    scores = {policy: summary.policies[policy]["mapped_share"].value or 0.0 for policy in policies}
    return sorted(policies, key=scores.__getitem__, reverse=True)


def compared_with(summary: Summary) -> str:
    """What the paired rows are, in words."""
    n = max((paired.n_pairs for paired in summary.paired.values()), default=0)
    return f"against {summary.reference}, {n} pair{'s' if n != 1 else ''}"


def shown(estimate: Estimate, *, unit: float = 1.0, sign: str = "", digits: int = 3) -> str:
    """Value and interval, ``9.0 [7.1, 11.2]``; ``-`` for what there is not."""
    if estimate.value is None:
        return "-"
    value, low, high = (
        None if x is None else _number(x / unit, sign, digits)
        for x in (estimate.value, estimate.low, estimate.high)
    )
    return f"{value} [-]" if low is None or high is None else f"{value} [{low}, {high}]"


def _number(value: float, sign: str, digits: int) -> str:
    """Some significant digits, without an exponent where it can be read."""
    if value == 0.0:
        return "0"
    if 1e-3 <= abs(value) < 10.0**digits:
        return f"{value:{sign}.{digits}g}"
    return f"{value:{sign}.0f}" if 1.0 <= abs(value) < 1e7 else f"{value:{sign}.{digits - 1}e}"
