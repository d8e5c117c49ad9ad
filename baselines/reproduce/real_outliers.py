"""Nine relative poses where real robots saw each other, some of them outliers, under real errors of bearings.

As in `baselines.reproduce.nine_poses`, relative poses are the truth with the paper's noise, three of nine
with 2 to 3 sigma of it in every component. Odometry and the places of encounters are those of a recorded
run, and so is the direction, or its error is that of recorded Wi-Fi.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int
from scipy import stats

from baselines.evaluation.kept_arrays import KeptArrays
from baselines.reproduce._recordings import errors_by_sight
from baselines.reproduce.encounter_grid import without
from baselines.reproduce.nine_poses import NinePoses, relative_poses
from baselines.reproduce.real_windows import run_in, window
from wifipgo import se2
from wifipgo.datasets.cut_run import cut_run
from wifipgo.datasets.team_run import TeamRun, known_ate
from wifipgo.graph.bearings import Bearings
from wifipgo.graph.edges import Edges, extended
from wifipgo.graph.outliers.aoa_weights import PAPER_SIGMA_RAD
from wifipgo.graph.outliers.methods import solve_robust
from wifipgo.graph.solve_weights import counted_alike
from wifipgo.threads import one_thread

_KEY = 0x4EA1  # keeps the chance of these draws apart from that of other runs of a seed
# Median of |error| in deg, and share beyond 20 deg, of two kinds of Wi-Fi bearings; correlation at 1 s.
WIFI = {"wifi_6": (6.0, 0.06), "wifi_12": (12.0, 0.34)}
CORRELATION = 0.5
SOURCES = ("camera", "in_sight", "beyond", *WIFI)
METHODS = {"eq11": "paper", "factors": "bearing"}
TREATMENTS = (
    "nothing",
    "removed",
    *(f"{method}_{source}" for source in SOURCES for method in METHODS),
    "alike_nothing",
    "alike_removed",
    *(f"alike_eq11_{source}" for source in SOURCES),
)


class Met(NamedTuple):
    """Two robots of a window, and nine of the steps at which one saw the other.

    Attributes:
        piece: The two.
        who: Who saw the other.
        at: When, ascending.
        camera_rad: In which direction, by the camera.
        exact: True pose of the other in the frame of who saw it.
    """

    piece: TeamRun
    who: Int[np.ndarray, " met"]
    at: Int[np.ndarray, " met"]
    camera_rad: Float[np.ndarray, " met"]
    exact: Float[np.ndarray, "met 3"]


@dataclass(frozen=True, slots=True)
class Draws(KeptArrays):
    """Repeated draws of encounters, noise and outliers in one window."""

    folder: Path
    number: int
    seeds: tuple[int, ...]
    path: Path

    @property
    def label(self) -> str:
        """Which window."""
        return f"outliers in window {self.number}"

    @one_thread
    def compute(self) -> dict[str, Float[np.ndarray, "draws treatments"]]:
        """Ground-truth error of every draw under every treatment; no rows where no two robots met often."""
        piece = window(run_in(self.folder), self.number)
        pairs = [] if piece is None else often_met(piece)
        rows = [
            errors_of(pairs, np.random.default_rng([seed, _KEY, self.number])) for seed in self.seeds if pairs
        ]
        return {"errors": np.array(rows).reshape(-1, len(TREATMENTS))}


def often_met(piece: TeamRun) -> list[Met]:
    """Each two robots with nine steps or more at which one saw the other and both have a truth."""
    n, found = len(piece.start), []
    for a, b in combinations(range(n), 2):
        two = cut_run(piece, 0, len(piece.time_s) - 1, robots=(a, b))
        at, first = np.unique(two.bearings.observer[:, 1], return_index=True)
        known = np.asarray(two.known.all(axis=0))[at]
        at, row = at[known], first[known]
        who = two.bearings.observer[row, 0]
        exact = se2.between(two.truth[who, at], two.truth[1 - who, at])
        if len(at) >= NinePoses().n_met:
            found.append(Met(two, who, at, two.bearings.azimuth_rad[row, 0], exact))
    return found


def errors_of(pairs: Sequence[Met], rng: np.random.Generator) -> list[float]:
    """One draw under every treatment."""
    place, noise, outliers, channel = rng.spawn(4)
    met = pairs[int(place.integers(len(pairs)))]
    rows = np.sort(place.permutation(len(met.at))[: NinePoses().n_met])
    met = Met(met.piece, *(column[rows] for column in met[1:]))
    z, is_bad = relative_poses(met.exact, NinePoses(), noise, outliers)
    edges = extended(met.piece.odometry, _edges(met, z))
    bad = np.append(np.zeros(len(met.piece.odometry), dtype=bool), is_bad)
    alike, heard = counted_alike(edges), _heard(met, channel)
    errors = [_error(met, edges, None, "none"), _error(met, without(edges, bad), None, "none")]
    errors += [_error(met, edges, heard[source], method) for source in SOURCES for method in METHODS.values()]
    errors += [_error(met, alike, None, "none"), _error(met, without(alike, bad), None, "none")]
    return [*errors, *(_error(met, alike, heard[source], "paper") for source in SOURCES)]


def _edges(met: Met, z: Float[np.ndarray, "met 3"]) -> Edges:
    """Relative poses with the paper's deviations."""
    cfg, other = NinePoses(), 1 - met.who
    return Edges.measured(
        tail=np.stack([met.who, met.at], axis=1),
        head=np.stack([other, met.at], axis=1),
        z=z,
        sigma=(cfg.sigma_t_m, cfg.sigma_r_rad),
        reported_pose=met.piece.truth[other, met.at],
    )


def _heard(met: Met, rng: np.random.Generator) -> dict[str, Bearings | None]:
    """Directions by every source; none where there are no recordings."""
    true_rad = np.arctan2(met.exact[:, 1], met.exact[:, 0])
    by_sight, wifi = rng.spawn(2)
    recorded = errors_by_sight() or (None, None)
    error = {
        "camera": met.camera_rad - true_rad,
        "in_sight": None if recorded[0] is None else by_sight.choice(recorded[0], len(met.at)),
        "beyond": None if recorded[1] is None else by_sight.choice(recorded[1], len(met.at)),
        **{name: wifi_errors(met.piece.time_s[met.at], *WIFI[name], rng=wifi) for name in WIFI},
    }
    return {name: None if of is None else _bearings(met, true_rad + of) for name, of in error.items()}


def _bearings(met: Met, azimuth_rad: Float[np.ndarray, " met"]) -> Bearings:
    """Directions as the paper's robots have them."""
    return Bearings.measured(
        observer=np.stack([met.who, met.at], axis=1),
        target=np.stack([1 - met.who, met.at], axis=1),
        azimuth_rad=se2.wrap_angle(azimuth_rad)[:, None],
        sigma_rad=PAPER_SIGMA_RAD,
    )


def wifi_errors(
    time_s: Float[np.ndarray, " times"], median_deg: float, beyond_20: float, *, rng: np.random.Generator
) -> Float[np.ndarray, " times"]:
    """Errors with heavy tails that are alike for a while: Student's t over a Gaussian of first order in time.

    Args:
        time_s: Ascending times.
        median_deg: Median of the absolute error.
        beyond_20: Share of errors beyond 20 degrees.
        rng: Chance.

    Returns:
        Errors, rad; beyond half a turn they are wrapped.
    """
    kept = CORRELATION ** np.diff(time_s, prepend=-np.inf)
    gauss, step = np.empty(len(time_s)), rng.standard_normal(len(time_s))
    before = 0.0
    for k, share in enumerate(kept.tolist()):
        before = gauss[k] = share * before + np.sqrt(1.0 - share**2) * step[k]
    freedom, scale_deg = tails(median_deg, beyond_20)
    error_deg: np.ndarray = scale_deg * stats.t.ppf(stats.norm.cdf(gauss), freedom)
    return se2.wrap_angle(np.deg2rad(error_deg))


def tails(median_deg: float, beyond_20: float) -> tuple[float, float]:
    """Degrees of freedom and scale, deg, of Student's t with a median and a share beyond 20 degrees."""
    freedoms = np.geomspace(1.0, 60.0, 400)
    scales = median_deg / np.asarray(stats.t.ppf(0.75, freedoms))
    best = int(np.abs(2.0 * stats.t.sf(20.0 / scales, freedoms) - beyond_20).argmin())
    return float(freedoms[best]), float(scales[best])


def _error(met: Met, edges: Edges, bearings: Bearings | None, method: str) -> float:
    """Ground-truth error (Eq. 12 + Eq. 13) after a method; nan where it has no directions."""
    if bearings is None and method != "none":
        return float("nan")
    solved, _ = solve_robust(met.piece.start, edges, bearings, robots=(0, 1), outliers=method)
    return float(np.add(*known_ate(solved, met.piece.truth)).mean())
