"""Fig. 10: outlier rejection by the direction of the signal, over trials and over a grid of encounters."""

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict
from hashlib import sha256
from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd
from jaxtyping import Float

from baselines.evaluation.intervals import Estimate, linearised, reduction
from baselines.reproduce import _draw_outliers, _rules
from baselines.reproduce._claims import (
    BESIDE,
    HEADLINE,
    NO_EPISODES,
    SENSITIVITY,
    Claim,
    Found,
    Sentence,
    judged,
    missing,
    row,
)
from baselines.reproduce._outlier_trials import METHODS, Arrays, Cell, OutlierTrial
from baselines.reproduce._runs import TRIALS, Setting, changed
from baselines.reproduce.encounter_grid import ODOMETRY, OUTLIERS, encounter_grid
from wifipgo.graph.outliers.aoa_weights import PAPER_GATE_RAD
from wifipgo.scenarios import Scenario

__all__ = ["SENTENCES", "TITLE", "TRIALS", "claims", "make", "tasks"]

TITLE = "Outlier rejection by the direction of the signal"
REDUCTION = Sentence(
    "fig10.reduction",
    "AOA weighting of outliers (Eq. 11) cuts the ground-truth error by 32 %.",
    "Abstract, Sec. 7.3, Fig. 10 (a)",
)
DEFAULT = Sentence(
    "fig10.default",
    "AOA information cuts the ground-truth error by 32 %, as bearings of their own (our method).",
    "Abstract, Fig. 10 (a)",
)
GATE = Sentence(
    "fig10.gate",
    "AOA measurements reliably detect outliers past 7.2 deg of difference.",
    "Sec. 7.3, Fig. 10 (c), (d)",
)
GRID = Sentence(
    "fig10.grid",
    "The same over encounters that the paper leaves open: range, odometry, kind of outlier.",
    "Sec. 7.3",
)
SENTENCES = (REDUCTION, DEFAULT, GATE, GRID)
CLAIMED = 32.0  # per cent
SCENARIO = changed("paper-outliers")
# The same with other numbers of ours.
OTHERS = {
    "room 10 x 10, power to match (ours 20)": changed(SCENARIO, size_m=10.0, tx_power_dbm=-18.0),
    "room 40 x 40, power to match (ours 20)": changed(SCENARIO, size_m=40.0, tx_power_dbm=-6.0),
    "no outliers (ours one in three)": changed(SCENARIO, outlier_share=0.0),
    "two in three are outliers (ours one in three)": changed(SCENARIO, outlier_share=2.0 / 3.0),
    "outliers of 8 to 12 sigma (paper: 2 to 3)": changed(
        SCENARIO, outlier_min_sigma=8.0, outlier_max_sigma=12.0
    ),
    "highest peak alone (N = 1; ours 2)": changed(SCENARIO, n_peaks=1),
}
RANGES_M, COUNT = (1.0, 4.0), 3
CALLED = {"none": "no method", "paper": "Eq. 11", "range_aware": "range-aware gate", "huber": "Huber"}
CALLED |= {"bearing": "bearings as measurements (default)"}


def _trials(scenario: Scenario, setting: Setting) -> list[OutlierTrial]:
    """One run for each world; none if the scenario refuses what is changed."""
    changed_too = setting.changed(scenario)
    if changed_too is None:
        return []
    digest = sha256(json.dumps(asdict(changed_too), sort_keys=True).encode()).hexdigest()[:16]
    return [
        OutlierTrial(changed_too, k, seed, setting.cache / f"outliers-{digest}-{k:05d}.npz")
        for k, seed in setting.worlds()
    ]


def _cells(setting: Setting) -> list[Cell]:
    """The grid: of encounters of its own, so that no field of a scenario touches it."""
    found = encounter_grid(ranges_m=RANGES_M, counts=(COUNT,), starts_known=(True,))
    seeds = tuple(seed for _, seed in setting.worlds())
    return [
        Cell(cfg, seeds, setting.cache / f"encounters-{k:03d}-{len(seeds)}.npz")
        for k, cfg in enumerate(found)
    ]


def tasks(setting: Setting) -> list[OutlierTrial | Cell]:
    """All runs, those of the sensitivity included, and the grid."""
    others = OTHERS.values() if setting.sensitivity else ()
    runs = [trial for of in (SCENARIO, *others) for trial in _trials(of, setting)]
    return [*runs, *_cells(setting)]


def make(setting: Setting, folder: Path) -> list[Claim]:
    """Draw, write the data, judge."""
    errors, met = _solved(setting)
    grid = _grid(setting)
    pd.DataFrame(errors, columns=list(METHODS)).to_parquet(folder / "errors.parquet", index=False)
    met.to_parquet(folder / "measurements.parquet", index=False)
    grid.to_parquet(folder / "grid.parquet", index=False)
    _draw_outliers.draw(folder / "fig10.png", errors, met, grid)
    return _judged(errors, met, grid, setting)


def claims(setting: Setting) -> list[Claim]:
    """Judge only."""
    return _judged(*_solved(setting), _grid(setting), setting)


def _solved(setting: Setting) -> tuple[Float[np.ndarray, "trials methods"], pd.DataFrame]:
    """Errors of every run, and its measurements."""
    loaded = [trial.load() for trial in _trials(SCENARIO, setting)]
    return _errors(loaded), _measured(loaded)


def _errors(loaded: Sequence[Arrays]) -> Float[np.ndarray, "trials methods"]:
    return np.array([of["errors"] for of in loaded]).reshape(-1, len(METHODS))


def _judged(
    errors: Float[np.ndarray, "trials methods"], met: pd.DataFrame, grid: pd.DataFrame, setting: Setting
) -> list[Claim]:
    return [_reduced(errors, setting), _default(errors, setting), _detected(met), _on_grid(grid)]


def _measured(loaded: Sequence[Arrays]) -> pd.DataFrame:
    """One row for each relative pose between robots."""
    parts = [
        pd.DataFrame({"trial": k, **{name: column for name, column in of.items() if name != "errors"}})
        for k, of in enumerate(loaded)
    ]
    return pd.concat(parts, ignore_index=True) if parts else pd.DataFrame()


def _grid(setting: Setting) -> pd.DataFrame:
    """One row for each cell, trial and method."""

    def rows() -> Iterator[pd.DataFrame]:
        for cell in _cells(setting):
            errors = cell.load()["errors"]
            trial, method = np.indices(errors.shape).reshape(2, -1)
            yield pd.DataFrame(
                {
                    "kind": cell.cfg.kind if cell.cfg.n_outliers else "no",
                    "range_m": cell.cfg.range_m,
                    "odometry": ODOMETRY[cell.cfg.odometry_scale],
                    "trial": trial,
                    "method": np.array(METHODS)[method],
                    "error": errors.ravel(),
                }
            )

    return pd.concat(rows(), ignore_index=True)


def _gain(method: str) -> Callable[[np.ndarray], Estimate]:
    """Reduction of the error of Sec. 7.3 by a method, per cent."""
    return lambda errors: reduction(errors[:, METHODS.index(method)], errors[:, 0])


def _reduced(errors: Float[np.ndarray, "trials methods"], setting: Setting) -> Claim:
    """The headline: Eq. 11 in the paper's setting, other methods beside it."""
    where = f"{SCENARIO.name}, until 9 relative poses"
    found = [
        row(f"{where}, {CALLED[name]}", _gain(name), errors, role=HEADLINE if name == "paper" else BESIDE)
        for name in METHODS[1:]
    ]
    return judged(
        REDUCTION,
        quantity="ground-truth error (Eq. 12 + Eq. 13), reduction against no method with true covariances",
        unit=" %",
        rule=_rules.at_least(CLAIMED, 0.0, " %"),
        found=[*found, *_changed("paper", setting)],
    )


def _default(errors: Float[np.ndarray, "trials methods"], setting: Setting) -> Claim:
    """The same by this project's own method."""
    where = f"{SCENARIO.name}, until 9 relative poses, {CALLED['bearing']}"
    return judged(
        DEFAULT,
        quantity="ground-truth error (Eq. 12 + Eq. 13), reduction against no method with true covariances",
        unit=" %",
        rule=_rules.at_least(CLAIMED, 0.0, " %"),
        found=[row(where, _gain("bearing"), errors), *_changed("bearing", setting)],
    )


def _changed(method: str, setting: Setting) -> list[Found]:
    """A method's reduction with other numbers of ours."""
    return [
        row(
            label,
            _gain(method),
            _errors([trial.load() for trial in _trials(other, setting)]),
            role=SENSITIVITY,
        )
        for label, other in (OTHERS if setting.sensitivity else {}).items()
    ]


def _detected(met: pd.DataFrame) -> Claim:
    """Whether the gate parts outliers from the rest."""
    if met.empty:
        found = [missing("all relative poses", NO_EPISODES)]
        return judged(GATE, quantity="", rule=_rules.at_least(0.6, 0.0), found=found)
    found = [_parted(met, "all relative poses", HEADLINE)]
    for low, high in ((0.0, 1.0), (1.0, 1.6), (1.6, 2.3)):
        near = met[(met.range_m >= low) & (met.range_m < high)]
        found.append(_parted(near, f"ranges of {low:g} to {high:g} m", BESIDE))
    return judged(
        GATE,
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


def _on_grid(grid: pd.DataFrame) -> Claim:
    """Where 32 % holds: mean reduction over ranges, by kind of outlier and quality of odometry."""
    found = [
        Found(
            conditions=f"{kind} outliers, {odometry} odometry, {CALLED[method]}",
            estimate=_cell_gain(grid[(grid.kind == kind) & (grid.odometry == odometry)], method),
            n=int(grid.trial.max()) + 1,
            role=HEADLINE if method == "paper" and kind != "no" else BESIDE,
        )
        for method, kind, odometry in product(("paper", "bearing"), ("no", *OUTLIERS), ODOMETRY.values())
    ]
    ranges = " and ".join(f"{r:g}" for r in RANGES_M)
    return judged(
        GRID,
        quantity=f"reduction, mean of cells at {ranges} m, {COUNT} outliers of 9",
        unit=" %",
        rule=_rules.at_least(CLAIMED, 0.0, " %"),
        found=found,
    )


def _cell_gain(cells: pd.DataFrame, method: str) -> Estimate:
    """Mean over cells of the reduction; trials are paired over cells."""
    kept, influence = [], []
    for _, of in cells.groupby("range_m"):
        under, bare = (
            of[of.method == name].sort_values("trial").error.to_numpy(float) for name in (method, "none")
        )
        kept.append(under.mean() / bare.mean())
        influence.append((under - kept[-1] * bare) / bare.mean())
    return linearised(100.0 * (1.0 - float(np.mean(kept))), -100.0 * np.mean(influence, axis=0))
