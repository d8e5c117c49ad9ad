"""Which claim and which ranking of policies survives a radio that is as hard as a real one."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from wifipgo.command.figures import Axes

import numpy as np
import pandas as pd

from baselines.evaluation.episodes import Episode
from baselines.evaluation.intervals import mean_of
from baselines.evaluation.jobs import Task
from baselines.evaluation.plots import colour_of, dashes_of
from baselines.evaluation.rows import shown
from baselines.reproduce import _draw
from baselines.reproduce._claims import Claim
from baselines.reproduce._measures import column, err_ratio, truth_reduction
from baselines.reproduce._rungs import POLICIES, REAL_MEMORY, REAL_SIGMA_DEG, RUNGS, Rung, bearing_errors
from baselines.reproduce._runs import TRIALS, Setting, tasks_of
from baselines.reproduce._tables import about, columns, estimate_in, table
from wifipgo.files.parquet_files import read_parquet

__all__ = ["TITLE", "TRIALS", "make", "page", "tasks"]

TITLE = "What survives a harder radio"
_MOST_WORLDS = 24  # whose bearings are looked at
_WRONG_RAD = float(np.deg2rad(20.0))
_CLAIMS = {"ratio": ("Err: random over each", 6.0), "gain": ("ground-truth gain over random, %", 64.0)}


def tasks(setting: Setting) -> list[Task]:
    """Every policy under every radio."""
    return tasks_of([run for rung in RUNGS for run in rung.runs.values()], setting)


def make(setting: Setting, folder: Path) -> list[Claim]:
    """Compare, write the table, draw; there is nothing to judge."""
    found = pd.DataFrame([row for rung in RUNGS for row in _compared(rung, setting)])
    found.to_parquet(folder / "fig_radio.parquet", index=False)
    _draw_rungs(folder / "fig_radio.png", found)
    return []


def _compared(rung: Rung, setting: Setting) -> list[dict[str, Any]]:
    """Every policy under one radio, beside random."""
    off = np.abs(bearing_errors(rung, setting.worlds()[:_MOST_WORLDS]))
    heard = {"median_deg": np.degrees(np.median(off)), "wrong_share": (off > _WRONG_RAD).mean()}
    of = {label: run.episodes(setting) for label, run in rung.runs.items()}
    return [{"radio": rung.label, **heard, **_figures(label, of)} for label in of]


def _figures(label: str, of: Mapping[str, Sequence[Episode]]) -> dict[str, Any]:
    """Figures of one policy, and against random and active."""
    ours, random, active = of[label], of["random"], of["active"]
    estimates = {
        "err": mean_of(column(ours, "err_last10")),
        "ratio": err_ratio(random, ours),
        "gain": truth_reduction(ours, random),
        "to_active": err_ratio(ours, active),
    }
    ends = {key: value for name, found in estimates.items() for key, value in columns(name, found).items()}
    means = {name: column(ours, name).mean() for name in ("rendezvous", "coverage", "mapped_share")}
    return {"policy": label, **ends, **means, "worlds": len(ours)}


def _draw_rungs(path: Path, found: pd.DataFrame) -> None:
    """Both claims over the rungs, a line a policy."""
    with _draw.page(path, (9.6, 4.4)) as figure:
        panels = figure.subplots(1, 2)
        for axes, name in zip(panels, _CLAIMS, strict=True):
            for place, (label, rows) in enumerate(_by_policy(found)):
                if label != "random":
                    _curve(axes, rows, name, place, label)
            axes.axhline(_CLAIMS[name][1], color="0.25", lw=0.9, ls=":", label="the paper")
            axes.set_ylabel(_CLAIMS[name][0])
            axes.set_xticks(range(len(RUNGS)), [_rung_label(found, rung.label) for rung in RUNGS], fontsize=7)
        panels[0].set_yscale("log")
        panels[0].set_ylim(0.5, 20.0)
        panels[0].set_yticks(ticks := [1, 2, 3, 4, 6, 8, 12], [str(tick) for tick in ticks])
        panels[0].set_yticks([], minor=True)
        panels[1].set_ylim(max(-100.0, float(found.gain_low.min())) - 5.0, 105.0)
        _draw.key(figure)
        worlds = int(found.worlds.iloc[0])
        figure.suptitle(f"{worlds} worlds, 95 % intervals; below: median error of direction", fontsize=9)


def _by_policy(found: pd.DataFrame) -> list[tuple[str, pd.DataFrame]]:
    return [(label, found[found.policy == label]) for label in POLICIES]


def _curve(axes: Axes, rows: pd.DataFrame, name: str, place: int, label: str) -> None:
    at = [[rung.label for rung in RUNGS].index(radio) + 0.04 * (place - 3.5) for radio in rows.radio]
    colour, dashes = colour_of(place), dashes_of(place)
    axes.plot(at, rows[name], color=colour, ls=dashes, marker="o", ms=3, lw=1.2, label=label)
    axes.vlines(at, rows[f"{name}_low"], rows[f"{name}_high"], color=colour, lw=0.9)


def _rung_label(found: pd.DataFrame, radio: str) -> str:
    first, _, rest = radio.rpartition(" ")
    return f"{first}\n{rest}\n{_of(found, radio).median_deg.iloc[0]:.1f} deg"


def _of(found: pd.DataFrame, radio: str) -> pd.DataFrame:
    return found[found.radio == radio]


def page(folder: Path, run: Mapping[str, Any], picture: str) -> str:
    """The page to read.

    Args:
        folder: Of `make`.
        run: Where the numbers come from.
        picture: Where the picture is.
    """
    found = read_parquet(folder / "fig_radio.parquet")
    parts = [f"# {TITLE}", _INTRODUCTION, f"![{TITLE}]({picture})", about(run), "## Claims", _claims(found)]
    parts += ["## Rankings", _RANKING, _rankings(found), "## All figures", _all(found)]
    return "\n\n".join(parts) + "\n"


def _claims(found: pd.DataFrame) -> str:
    """Both claims of active rendezvous under each radio, and how good directions are there."""
    header = ["radio", "error of direction: median, deg", "beyond 20 deg", "random over active", "gain, %"]
    return table(header, [_claims_of(row) for row in found[found.policy == "active"].itertuples()])


def _claims_of(row: Any) -> list[str]:
    heard = [f"{row.median_deg:.2f}", f"{100 * row.wrong_share:.1f} %"]
    return [row.radio, *heard, *_shown(row, *_CLAIMS)]


def _rankings(found: pd.DataFrame) -> str:
    """Policies from least Err to most; a sign says whether each differs from active."""
    rows = []
    for rung in RUNGS:
        here = _of(found, rung.label).sort_values("err")
        order = (f"{row.policy}{_sign(row)} {row.err:.3g}" for row in here.itertuples())
        rows.append([rung.label, ", ".join(order)])
    return table(["radio", "Err of the last ten iterations, least first"], rows)


def _sign(row: Any) -> str:
    """Whether a policy's Err is surely less than that of active (-), surely more (+), or neither."""
    if row.policy == "active" or not np.isfinite(row.to_active_low):
        return ""
    return " (-)" if row.to_active_high < 1.0 else " (+)" if row.to_active_low > 1.0 else " (=)"


def _all(found: pd.DataFrame) -> str:
    header = ["radio", "policy", "Err", "random over it", "gain, %", "it over active"]
    header += ["rendezvous", "coverage", "mapped"]
    return table(header, [_all_of(row) for row in found.itertuples()])


def _all_of(row: Any) -> list[str]:
    means = [f"{value:.2f}" for value in (row.rendezvous, row.coverage, row.mapped_share)]
    return [row.radio, row.policy, *_shown(row, "err", "ratio", "gain", "to_active"), *means]


def _shown(row: Any, *names: str) -> list[str]:
    """Figures with their intervals."""
    return [shown(estimate_in(row, name)) for name in names]


_INTRODUCTION = f"""\
The same worlds (rules and noise of `paper-hw-2`, four boxes of wood, brick, plasterboard and steel)
under a radio that grows harder: signals that only lose power along the straight line and through boxes;
reflected twice at most; bent at edges; scattered, with lost packets and people about
(`radio-real-2-obstacles`); at last directions with the errors of a public Wi-Fi run, normal with a
median of 9 degrees ({REAL_SIGMA_DEG} deg) that last (correlation {REAL_MEMORY} from iteration to
iteration). Who explores by direction is left out there. Beside active and random rendezvous stand
policies that ask what a direction is worth: a called robot that climbs the strength of the signal, one
that knows the distance only, one that takes any direction, one that is told the true one; and two that
explore, one of them away from where it hears the other."""
_RANKING = """\
Whether a policy's Err is surely less than that of active (-), surely more (+), or neither (=): by the 95 %
interval of their ratio."""
