"""Findings in one picture: how much is mapped, when robots meet, how far they go, where errors grow."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from wifipgo.command.figures import Axes, Figure

import matplotlib as mpl
import numpy as np
from jaxtyping import Float
from matplotlib.lines import Line2D

from baselines.conduct.conduct import Conduct
from baselines.conduct.findings import Findings
from baselines.conduct.measures import error_by_distance, met_within
from baselines.evaluation.intervals import Estimate, mean_of
from baselines.evaluation.labels import wrapped
from baselines.evaluation.plots import STYLE, colour_of, curve, dashes_of, save_small
from wifipgo.command.palette import GREY

_WINDOW = 5  # iterations in which a meeting counts
_BIN_M = 2.0
_ENOUGH = 0.5  # of the worlds, in which somebody has to be so far out
_APART = 0.16  # between the dots of one scenario
_TITLE = 130  # letters of a line
_NAME = 44  # letters of a line

Both = tuple[Conduct, Conduct]


def draw_findings(path: Path, findings: Findings, *, title: str) -> None:
    """Draw six panels; curves and dots are means over worlds with 95 % intervals."""
    first = findings.conduct[findings.scenarios[0]]
    both = first[findings.policy], first[findings.rule]
    draw: Sequence[Callable[[Axes, Both], None]] = (_mapped, _meetings, _away, _error, _error_away)
    with mpl.rc_context({**STYLE, "font.size": 9}):
        figure = Figure(figsize=(11.0, 6.6), dpi=110, layout="constrained")
        *panels, last = figure.subplots(2, 3).ravel()
        for axes, panel in zip(panels, draw, strict=True):
            panel(axes, both)
        _scores(last, findings)
        figure.suptitle(wrapped(title, _TITLE, most_lines=2), fontsize=10, x=0.01, ha="left")
        figure.legend(handles=_key(findings), loc="outside lower center", ncols=3, fontsize=8)
        save_small(figure, path)


def _mapped(axes: Axes, both: Both) -> None:
    for place, conduct in enumerate(both):
        curve(axes, 100.0 * conduct.mapped, place, len(both))
        axes.plot(_iterations(conduct), 100.0 * conduct.seen.mean(axis=0), color=colour_of(place), ls=":")
    _label(axes, "How much is mapped", "iteration", "% of the floor\nmapped (line), seen (dotted)")


def _meetings(axes: Axes, both: Both) -> None:
    for place, conduct in enumerate(both):
        shares = 100.0 * met_within(conduct.met, _WINDOW)
        n = conduct.met.shape[1]
        begins = np.arange(0, n, _WINDOW)
        middle = 0.5 * (begins + np.minimum(begins + _WINDOW, n) + 1.0)
        _dots(axes, middle + (place - 0.5), [mean_of(column) for column in shares.T], place)
    _label(axes, "When robots meet", "iteration", f"% of robots that meet\nin {_WINDOW} iterations")
    axes.set_ylim(0.0, 105.0)


def _away(axes: Axes, both: Both) -> None:
    for place, conduct in enumerate(both):
        curve(axes, conduct.from_start_m.mean(axis=2), place, len(both))
    _label(axes, "How far they go", "iteration", "distance from the own start (m)")


def _error(axes: Axes, both: Both) -> None:
    for place, conduct in enumerate(both):
        curve(axes, conduct.error_m.mean(axis=2), place, len(both))
    _label(axes, "When errors grow", "iteration", "position error (m)")


def _error_away(axes: Axes, both: Both) -> None:
    farthest_m = max(float(conduct.from_start_m.max()) for conduct in both)
    edges_m = np.arange(0.0, farthest_m + _BIN_M, _BIN_M)
    for place, conduct in enumerate(both):
        errors = error_by_distance(conduct, edges_m)
        known = np.isfinite(errors)
        kept = np.flatnonzero(known.mean(axis=0) >= _ENOUGH)
        found = [mean_of(errors[known[:, k], k]) for k in kept]
        _dots(axes, edges_m[kept] + 0.5 * _BIN_M + 0.2 * (place - 0.5), found, place)
    _label(axes, "Where errors grow", "distance from the own start (m)", "position error (m)")


def _scores(axes: Axes, findings: Findings) -> None:
    """The policy against the rule, and what it loses without something, by scenario."""
    compared = _compared(findings)
    rows = np.arange(len(findings.scenarios))[::-1]
    for k, (label, reference) in enumerate(compared):
        found = [findings.difference(name, "score", label, reference) for name in findings.scenarios]
        _dots(axes, rows - _APART * (k - 0.5 * (len(compared) - 1)), found, _place(k), across=True)
    axes.axvline(0.0, color=GREY, lw=0.8, zorder=0)
    axes.set_yticks(rows, findings.scenarios)
    axes.set_ylim(-0.6, len(rows) - 0.4)
    axes.set_title("What is gained and lost, by scenario", loc="left", fontsize=10)
    axes.set_xlabel("difference of the score (% of the floor)")


def _place(k: int) -> int:
    """Looks of a comparison: the policy has its own, the rule's are left out."""
    return k if k == 0 else k + 1


def _key(findings: Findings) -> list[Line2D]:
    """What has which looks."""
    both = findings.policy, findings.rule
    lines = [(name, place, dashes_of(place), "") for place, name in enumerate(both)]
    dots = [
        (f"{label} less {reference}", _place(k), "", "o")
        for k, (label, reference) in enumerate(_compared(findings))
    ]
    return [
        Line2D([], [], color=colour_of(place), ls=dashes, marker=marker, ms=4, label=_short(name))
        for name, place, dashes, marker in (*lines, *dots)
    ]


def _compared(findings: Findings) -> list[tuple[str, str]]:
    """The policy with the rule, and it without something with the whole."""
    without = [(label, findings.policy) for label in findings.ablations]
    return [(findings.policy, findings.rule), *without]


def _short(name: str) -> str:
    return wrapped(name, _NAME, most_lines=2)


def _dots(
    axes: Axes, at: Float[np.ndarray, " dots"], found: Sequence[Estimate], place: int, *, across: bool = False
) -> None:
    """Means with their intervals, along x; across: along y."""
    values = np.array([one.value for one in found], dtype=np.float64)
    ends = np.array([[one.low, one.high] for one in found], dtype=np.float64).reshape(-1, 2).T
    half = np.abs(ends - values)
    looks: dict[str, Any] = {"color": colour_of(place), "fmt": "o", "ms": 4, "lw": 1.5}
    if across:
        axes.errorbar(values, at, xerr=half, **looks)
    else:
        axes.errorbar(at, values, yerr=half, **looks)


def _iterations(conduct: Conduct) -> np.ndarray:
    return np.arange(1, conduct.mapped.shape[1] + 1)


def _label(axes: Axes, title: str, x: str, y: str) -> None:
    axes.set_title(title, loc="left", fontsize=10)
    axes.set(xlabel=x, ylabel=y)
    axes.set_xlim(left=0.0)
    axes.set_ylim(bottom=0.0)
