"""Fig. 10: outlier rejection by the direction of the signal, over trials and over a grid of encounters."""

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, replace
from hashlib import sha256
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd
from jaxtyping import Float

from baselines.evaluation.intervals import Estimate, linearised, reduction
from baselines.evaluation.kept_arrays import Arrays
from baselines.reproduce import _draw_outliers, _gate, _rules
from baselines.reproduce._claims import (
    BESIDE,
    HEADLINE,
    SENSITIVITY,
    Claim,
    Found,
    Sentence,
    judged,
    row,
)
from baselines.reproduce._outlier_trials import KEEP_ALL, METHODS, Cell, OutlierTrial
from baselines.reproduce._runs import TRIALS, Setting, changed
from baselines.reproduce.encounter_grid import ODOMETRY, OUTLIERS, encounter_grid
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
GRID = Sentence(
    "fig10.grid",
    "The same over encounters that the paper leaves open: range, odometry, kind of outlier.",
    "Sec. 7.3",
)
SENTENCES = (REDUCTION, DEFAULT, _gate.SENTENCE, GRID)
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
_OF_RUNS = ("errors", "removed")  # all else is of measurements
CALLED = {"none": "no method", "paper": "Eq. 11", "range_aware": "range-aware gate", "huber": "Huber"}
REMOVED = "removed"
CALLED |= {"bearing": "bearings as measurements (default)"}


def _trials(scenario: Scenario, setting: Setting) -> list[OutlierTrial]:
    """One run for each world; none if the scenario refuses what is changed."""
    changed_too = setting.changed(scenario)
    if changed_too is None or setting.changed(scenario.with_overrides(**KEEP_ALL)) is None:
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
    loaded = _solved(setting)
    errors, met, grid = _errors(loaded), _measured(loaded), _grid(setting)
    pd.DataFrame(errors, columns=list(METHODS)).to_parquet(folder / "errors.parquet", index=False)
    met.to_parquet(folder / "measurements.parquet", index=False)
    grid.to_parquet(folder / "grid.parquet", index=False)
    _draw_outliers.draw(folder / "fig10.png", errors, met, grid)
    return _judged(loaded, grid, setting)


def claims(setting: Setting) -> list[Claim]:
    """Judge only."""
    return _judged(_solved(setting), _grid(setting), setting)


def _solved(setting: Setting) -> list[Arrays]:
    """Errors of every run, and its measurements."""
    return [trial.load() for trial in _trials(SCENARIO, setting)]


def _errors(loaded: Sequence[Arrays]) -> Float[np.ndarray, "trials methods"]:
    return np.array([of["errors"] for of in loaded]).reshape(-1, len(METHODS))


def _judged(loaded: Sequence[Arrays], grid: pd.DataFrame, setting: Setting) -> list[Claim]:
    met = _measured(loaded)
    return [_reduced(loaded, setting), _default(loaded, setting), _gate.claim(met), _on_grid(grid)]


def _measured(loaded: Sequence[Arrays]) -> pd.DataFrame:
    """One row for each relative pose between robots."""
    parts = [
        pd.DataFrame({"trial": k} | {name: column for name, column in of.items() if name not in _OF_RUNS})
        for k, of in enumerate(loaded)
    ]
    return pd.concat(parts, ignore_index=True) if parts else pd.DataFrame()


def _grid(setting: Setting) -> pd.DataFrame:
    """One row for each cell, trial and method."""

    def rows() -> Iterator[pd.DataFrame]:
        for cell in _cells(setting):
            of = cell.load()
            errors = np.column_stack([of["errors"], of["removed"]])
            trial, method = np.indices(errors.shape).reshape(2, -1)
            yield pd.DataFrame(
                {
                    "kind": cell.cfg.kind if cell.cfg.n_outliers else "no",
                    "range_m": cell.cfg.range_m,
                    "odometry": ODOMETRY[cell.cfg.odometry_scale],
                    "trial": trial,
                    "method": np.array([*METHODS, REMOVED])[method],
                    "error": errors.ravel(),
                }
            )

    return pd.concat(rows(), ignore_index=True)


def _gained(method: str, loaded: Sequence[Arrays], conditions: str, role: str = HEADLINE) -> Found:
    """Reduction of the error of Sec. 7.3 by a method, per cent."""
    errors, removed = _errors(loaded), np.array([of["removed"] for of in loaded])
    found = row(conditions, lambda e: reduction(e[:, METHODS.index(method)], e[:, 0]), errors, role=role)
    if not loaded:
        return found
    return _powered(found, reduction(removed, errors[:, 0]).value)


def _powered(found: Found, most: float | None) -> Found:
    """A figure beside the most that can be had: by removing exactly the true outliers."""
    most = most or 0.0
    note = f"true outliers removed: {most:.1f} %"
    return replace(found, note=note, verdict=_rules.NO_POWER if most < CLAIMED else "")


def _reduced(loaded: Sequence[Arrays], setting: Setting) -> Claim:
    """The headline: Eq. 11 in the paper's setting, other methods beside it."""
    where = f"{SCENARIO.name}, until 9 relative poses"
    found = [
        _gained(name, loaded, f"{where}, {CALLED[name]}", HEADLINE if name == "paper" else BESIDE)
        for name in METHODS[1:]
    ]
    return judged(
        REDUCTION,
        quantity="ground-truth error (Eq. 12 + Eq. 13), reduction against no method with true covariances",
        unit=" %",
        rule=_rules.at_least(CLAIMED, 0.0, " %"),
        found=[*found, *_changed("paper", setting)],
    )


def _default(loaded: Sequence[Arrays], setting: Setting) -> Claim:
    """The same by this project's own method."""
    where = f"{SCENARIO.name}, until 9 relative poses, {CALLED['bearing']}"
    return judged(
        DEFAULT,
        quantity="ground-truth error (Eq. 12 + Eq. 13), reduction against no method with true covariances",
        unit=" %",
        rule=_rules.at_least(CLAIMED, 0.0, " %"),
        found=[_gained("bearing", loaded, where), *_changed("bearing", setting)],
    )


def _changed(method: str, setting: Setting) -> list[Found]:
    """A method's reduction with other numbers of ours."""
    return [
        _gained(method, [trial.load() for trial in _trials(other, setting)], label, SENSITIVITY)
        for label, other in (OTHERS if setting.sensitivity else {}).items()
    ]


def _on_grid(grid: pd.DataFrame) -> Claim:
    """Where 32 % holds: mean reduction over ranges, by kind of outlier and quality of odometry."""
    found = [
        _on_cells(
            grid[(grid.kind == kind) & (grid.odometry == odometry)],
            method,
            f"{kind} outliers, {odometry} odometry",
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


def _on_cells(cells: pd.DataFrame, method: str, where: str) -> Found:
    """A method on some cells, beside the removal of the true outliers."""
    with_outliers = bool((cells.kind != "no").any())
    found = Found(
        conditions=f"{where}, {CALLED[method]}",
        estimate=_cell_gain(cells, method),
        n=int(cells.trial.max()) + 1,
        role=HEADLINE if method == "paper" and with_outliers else BESIDE,
    )
    return _powered(found, _cell_gain(cells, REMOVED).value) if with_outliers else found


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
