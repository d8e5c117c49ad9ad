"""Runs of `nine_poses` under every treatment that Fig. 10 is judged by, and AOA errors of real recordings."""

from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np
from jaxtyping import Float

from baselines.evaluation.kept_arrays import KeptArrays
from baselines.reproduce._recordings import errors_by_sight
from baselines.reproduce.encounter_grid import ground_truth_error, without
from baselines.reproduce.nine_poses import (
    NinePoses,
    Run,
    heard,
    simulate_run,
    start_sigma,
)
from wifipgo.graph.bearings import Bearings
from wifipgo.graph.edges import Edges
from wifipgo.graph.outliers.methods import solve_robust
from wifipgo.graph.solve_weights import counted_alike
from wifipgo.threads import one_thread

# What is done to a run, in the order of the columns: equal information matrices, but where it says "true".
TREATMENTS = (
    "nothing",
    "eq11",
    "eq11_recorded_in_sight",
    "eq11_recorded_beyond",
    "outliers_removed",
    "true_covariances",
    "true_covariances_eq11",
)
ODOMETRY_SCALES, RANGES_M, COUNTS = (0.1, 0.3, 1.0), (1.0, 2.0, 4.0), (3, 0)
READINGS = tuple(
    NinePoses(odometry_scale=scale, range_m=range_m, n_outliers=n)
    for scale, range_m, n in product(ODOMETRY_SCALES, RANGES_M, COUNTS)
)
# Simulated AOA as elsewhere in `fig10`: 3 degrees, and 7.5 % anywhere.
_KEY = 0x916  # keeps the chance of these runs apart from that of other runs of a seed
_SIGMA_RAD, _GROSS_SHARE = float(np.deg2rad(3.0)), 0.075


@dataclass(frozen=True, slots=True)
class NineRuns(KeptArrays):
    """One reading of the experiment, once for each world's seed."""

    cfg: NinePoses
    seeds: tuple[int, ...]
    path: Path

    @property
    def label(self) -> str:
        """Which reading."""
        cfg = self.cfg
        return (
            f"{cfg.n_outliers} outliers of {cfg.n_met} at {cfg.range_m:g} m, odometry {cfg.odometry_scale:g}"
        )

    @one_thread
    def compute(self) -> dict[str, Float[np.ndarray, "trials treatments"]]:
        """Ground-truth error of every trial under every treatment; nan where there are no recordings."""
        recorded = errors_by_sight()
        rows = [_errors(self.cfg, np.random.default_rng([seed, _KEY]), recorded) for seed in self.seeds]
        return {"errors": np.array(rows)}


def _errors(
    cfg: NinePoses, rng: np.random.Generator, recorded: tuple[np.ndarray, np.ndarray] | None
) -> list[float]:
    """One run under every treatment."""
    world, channel, place = rng.spawn(3)
    run = simulate_run(cfg, rng=world)
    alike, simulated = counted_alike(run.edges), heard(run, _simulated(cfg.n_met, channel))
    real = [heard(run, place.choice(of, cfg.n_met)) for of in recorded or ()]
    return [
        _error(run, alike, simulated, "none"),
        _error(run, alike, simulated, "paper"),
        *([_error(run, alike, bearings, "paper") for bearings in real] or [np.nan, np.nan]),
        _error(run, without(alike, run.is_outlier), simulated, "none"),
        _error(run, run.edges, simulated, "none"),
        _error(run, run.edges, simulated, "paper"),
    ]


def _simulated(n: int, rng: np.random.Generator) -> Float[np.ndarray, " met"]:
    """AOA errors: Gaussian, some anywhere."""
    gross = rng.random(n) < _GROSS_SHARE
    return np.where(gross, rng.uniform(-np.pi, np.pi, n), rng.normal(0.0, _SIGMA_RAD, n))


def _error(run: Run, edges: Edges, bearings: Bearings, method: str) -> float:
    """Ground-truth error (Eq. 12 + Eq. 13) after a method."""
    solved, _ = solve_robust(
        run.start, edges, bearings, robots=(0, 1), outliers=method, start_sigma=start_sigma()
    )
    return ground_truth_error(solved, run.truth)


def chance_of_a_panel(
    errors: Float[np.ndarray, "trials 2"], *, claimed: float, n_trials: int = 5, n_panels: int = 20_000
) -> float:
    """How often a panel of trials drawn from these shows a reduction of the mean error by a share.

    Args:
        errors: Before and after.
        claimed: The share, e.g. 0.32.
        n_trials: Trials of a panel.
        n_panels: Panels drawn.
    """
    rng = np.random.default_rng(0)
    drawn = errors[rng.integers(len(errors), size=(n_panels, n_trials))].sum(axis=1)
    return float(np.mean(1.0 - drawn[:, 1] / drawn[:, 0] >= claimed))
