"""Fig. 10: outlier rejection by the direction of the signal, over trials and over a grid of encounters."""

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from hashlib import sha256
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd
from jaxtyping import Float

from baselines.evaluation.episodes import trial_seed
from baselines.evaluation.statistics import Estimate, bootstrap
from baselines.reproduce import _draw_outliers, _rules
from baselines.reproduce._claims import BESIDE, SENSITIVITY, Claim, Found, judged
from baselines.reproduce._measures import reduction
from baselines.reproduce._outlier_trials import METHODS, Arrays, Cell, OutlierTrial
from baselines.reproduce._runs import Setting, changed
from baselines.reproduce.encounter_grid import ODOMETRY, OUTLIERS, encounter_grid
from wifipgo.graph.outliers.aoa_weights import PAPER_GATE_RAD
from wifipgo.scenarios import Scenario

TITLE = "Outlier rejection by the direction of the signal"
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
    """One run for each seed."""
    digest = sha256(json.dumps(asdict(scenario), sort_keys=True).encode()).hexdigest()[:16]
    seeds = [trial_seed(setting.seed, k) for k in range(setting.trials_of(scenario))]
    return [
        OutlierTrial(scenario, k, seed, setting.cache / f"outliers-{digest}-{k:05d}.npz")
        for k, seed in enumerate(seeds)
    ]


def _cells(setting: Setting) -> list[Cell]:
    """The grid."""
    found = encounter_grid(ranges_m=RANGES_M, counts=(COUNT,), starts_known=(True,))
    n = setting.trials_of(SCENARIO)
    return [
        Cell(cfg, n, setting.seed, setting.cache / f"encounters-{k:03d}.npz") for k, cfg in enumerate(found)
    ]


def tasks(setting: Setting) -> list[OutlierTrial | Cell]:
    """All runs, those of the sensitivity included, and the grid."""
    runs = [trial for of in (SCENARIO, *OTHERS.values()) for trial in _trials(of, setting)]
    return [*runs, *_cells(setting)]


def make(setting: Setting, folder: Path) -> list[Claim]:
    """Draw, write the data, judge."""
    loaded = [trial.load() for trial in _trials(SCENARIO, setting)]
    errors = np.array([of["errors"] for of in loaded])
    met = _measured(loaded)
    grid = _grid(setting)
    pd.DataFrame(errors, columns=list(METHODS)).to_parquet(folder / "errors.parquet", index=False)
    met.to_parquet(folder / "measurements.parquet", index=False)
    grid.to_parquet(folder / "grid.parquet", index=False)
    _draw_outliers.draw(folder / "fig10.png", errors, met, grid)
    return [_reduced(errors, setting), _default(errors, setting), _detected(met), _on_grid(grid)]


def _measured(loaded: Sequence[Arrays]) -> pd.DataFrame:
    """One row for each relative pose between robots."""
    parts = [
        pd.DataFrame({"trial": k, **{name: column for name, column in of.items() if name != "errors"}})
        for k, of in enumerate(loaded)
    ]
    return pd.concat(parts, ignore_index=True)


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


def _gain(errors: Float[np.ndarray, "trials methods"], method: str) -> Estimate:
    """Reduction of the error of Sec. 7.3 by a method, per cent."""
    return reduction(errors[:, METHODS.index(method)], errors[:, 0])


def _reduced(errors: Float[np.ndarray, "trials methods"], setting: Setting) -> Claim:
    """The headline: Eq. 11 in the paper's setting, other methods beside it."""
    where = f"{SCENARIO.name}, until 9 relative poses"
    n = len(errors)
    found = [Found(conditions=f"{where}, {CALLED['paper']}", estimate=_gain(errors, "paper"), n=n)]
    found += [
        Found(conditions=f"{where}, {CALLED[name]}", estimate=_gain(errors, name), n=n, role=BESIDE)
        for name in METHODS[2:]
    ]
    return judged(
        "fig10.reduction",
        "AOA weighting of outliers (Eq. 11) cuts the ground-truth error by 32 %.",
        source="Abstract, Sec. 7.3, Fig. 10 (a)",
        quantity="ground-truth error (Eq. 12 + Eq. 13), reduction against no method with true covariances",
        unit=" %",
        rule=_rules.at_least(CLAIMED, 0.0, " %"),
        found=[*found, *_changed("paper", setting)],
    )


def _default(errors: Float[np.ndarray, "trials methods"], setting: Setting) -> Claim:
    """The same by this project's own method."""
    estimate = _gain(errors, "bearing")
    where = f"{SCENARIO.name}, until 9 relative poses, {CALLED['bearing']}"
    return judged(
        "fig10.default",
        "AOA information cuts the ground-truth error by 32 %, as bearings of their own (our method).",
        source="Abstract, Fig. 10 (a)",
        quantity="ground-truth error (Eq. 12 + Eq. 13), reduction against no method with true covariances",
        unit=" %",
        rule=_rules.at_least(CLAIMED, 0.0, " %"),
        found=[Found(conditions=where, estimate=estimate, n=len(errors)), *_changed("bearing", setting)],
    )


def _changed(method: str, setting: Setting) -> list[Found]:
    """A method's reduction with other numbers of ours."""
    loaded = {
        label: np.array([trial.load()["errors"] for trial in _trials(other, setting)])
        for label, other in OTHERS.items()
    }
    return [
        Found(conditions=label, estimate=_gain(errors, method), n=len(errors), role=SENSITIVITY)
        for label, errors in loaded.items()
    ]


def _detected(met: pd.DataFrame) -> Claim:
    """Whether the gate parts outliers from the rest."""
    flagged = met.off_rad.abs() >= PAPER_GATE_RAD
    found = [_parted(met, flagged, "all relative poses", "headline")]
    for low, high in ((0.0, 1.0), (1.0, 1.6), (1.6, 2.3)):
        near = (met.range_m >= low) & (met.range_m < high)
        if near.sum() > 10 and met[near].is_outlier.nunique() == 2:
            found.append(_parted(met[near], flagged[near], f"ranges of {low:g} to {high:g} m", BESIDE))
    return judged(
        "fig10.gate",
        "AOA measurements reliably detect outliers past 7.2 deg of difference.",
        source="Sec. 7.3, Fig. 10 (c), (d)",
        quantity="share of outliers past the gate less share of good measurements past it",
        rule=_rules.at_least(0.6, 0.0),
        found=found,
    )


def _parted(met: pd.DataFrame, flagged: pd.Series, conditions: str, role: str) -> Found:
    """Share of outliers flagged less share of others flagged; resampled by trial."""
    table = pd.DataFrame({"trial": met.trial, "bad": met.is_outlier, "flagged": flagged})
    counts = [
        table.assign(value=values).groupby("trial").value.sum().to_numpy(float)
        for values in (
            table.bad & table.flagged,
            table.bad,
            ~table.bad & table.flagged,
            ~table.bad,
        )
    ]
    hit, false = (float(counts[k].sum() / max(counts[k + 1].sum(), 1.0)) for k in (0, 2))
    note = (
        f"{100 * hit:.0f} % of outliers and {100 * false:.0f} % of the others are past it; {len(met)} poses"
    )
    estimate = bootstrap(tuple(counts), _difference_of_shares, method="percentile")
    return Found(conditions=conditions, estimate=estimate, n=len(counts[0]), role=role, note=note)


def _difference_of_shares(*counts: np.ndarray, axis: int = -1) -> np.ndarray:
    hit, bad, false, good = (count.sum(axis=axis) for count in counts)
    return np.asarray(hit / np.maximum(bad, 1.0) - false / np.maximum(good, 1.0))


def _on_grid(grid: pd.DataFrame) -> Claim:
    """Where 32 % holds: mean reduction over ranges, by kind of outlier and quality of odometry."""
    found = [
        Found(
            conditions=f"{kind} outliers, {odometry} odometry, {CALLED[method]}",
            estimate=_cell_gain(grid[(grid.kind == kind) & (grid.odometry == odometry)], method),
            n=int(grid.trial.max()) + 1,
            role="headline" if method == "paper" and kind != "no" else BESIDE,
        )
        for method, kind, odometry in product(("paper", "bearing"), ("no", *OUTLIERS), ODOMETRY.values())
    ]
    ranges = " and ".join(f"{r:g}" for r in RANGES_M)
    return judged(
        "fig10.grid",
        "The same over encounters that the paper leaves open: range, odometry, kind of outlier.",
        source="Sec. 7.3",
        quantity=f"reduction, mean of cells at {ranges} m, {COUNT} outliers of 9",
        unit=" %",
        rule=_rules.at_least(CLAIMED, 0.0, " %"),
        found=found,
    )


def _cell_gain(cells: pd.DataFrame, method: str) -> Estimate:
    """Mean over cells of the reduction; trials are paired over cells."""
    samples: Sequence[np.ndarray] = [
        of[of.method == name].sort_values("trial").error.to_numpy(float)
        for _, of in cells.groupby("range_m")
        for name in (method, "none")
    ]

    def statistic(*errors: np.ndarray, axis: int = -1) -> np.ndarray:
        means = [error.mean(axis=axis) for error in errors]
        kept = [under / bare for under, bare in zip(means[::2], means[1::2], strict=True)]
        return np.asarray(100.0 * (1.0 - np.mean(kept, axis=0)))

    return bootstrap(tuple(samples), statistic, method="percentile")
