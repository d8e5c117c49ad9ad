"""What Fig. 10 is made of: runs until nine relative poses, and encounters of a grid."""

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float

from baselines.evaluation.episodes import play
from baselines.evaluation.kept_arrays import Arrays, KeptArrays
from baselines.policies import make_policy
from baselines.reproduce.encounter_grid import encounter, error_under, ground_truth_error, without
from baselines.reproduce.encounters import EncounterConfig
from envs.rendezvous_v0 import vector_env
from wifipgo import se2
from wifipgo.graph.bearings import bearing_residuals, heard_along
from wifipgo.graph.edges import Edges, select
from wifipgo.graph.outliers.aoa_weights import bearing, likelihood
from wifipgo.graph.outliers.methods import solve_robust
from wifipgo.scenarios import Scenario
from wifipgo.state import Tick
from wifipgo.threads import one_thread

METHODS = ("none", "paper", "range_aware", "huber", "bearing")
# Bearings are kept and nothing is optimised before all measurements are there.
KEEP_ALL = {"outliers": "bearing", "kappa": 1_000}


@dataclass(frozen=True, slots=True)
class OutlierTrial(KeptArrays):
    """Active rendezvous until enough relative poses are taken; every method then solves the same graph."""

    scenario: Scenario
    trial: int
    seed: int
    path: Path

    @property
    def label(self) -> str:
        """Which trial."""
        return f"{self.scenario.name}, trial {self.trial}, seed {self.seed}"

    @property
    def kind(self) -> Hashable:
        """Trials of one scenario are played together."""
        return self.scenario

    def compute(self) -> Arrays:
        """Errors by method and with the true outliers removed, and every measurement beside its direction."""
        return self.compute_all([self])[0]

    def compute_all(self, items: Sequence["OutlierTrial"]) -> list[Arrays]:
        """The same of several trials, played together."""
        ticks = _played(self.scenario.with_overrides(**KEEP_ALL), [item.seed for item in items])
        return [_judged(tick) for tick in ticks]


@dataclass(frozen=True, slots=True)
class Cell(KeptArrays):
    """Encounters of one kind, one for each world's seed."""

    cfg: EncounterConfig
    seeds: tuple[int, ...]
    path: Path

    @property
    def label(self) -> str:
        """Which cell."""
        return f"{self.cfg.n_outliers} outliers ({self.cfg.kind}) at {self.cfg.range_m:g} m"

    def compute(self) -> Arrays:
        """Ground-truth error of every trial under every method, and with the true outliers removed."""
        seen = [encounter(self.cfg, (seed,)) for seed in self.seeds]
        removed = [error_under("none", e, without_outliers=True) for e in seen]
        return {
            "errors": np.array([[error_under(method, e) for method in METHODS] for e in seen]),
            "removed": np.array(removed),
        }


@one_thread
def _played(scenario: Scenario, seeds: Sequence[int]) -> list[Tick]:
    """The ends of episodes of active rendezvous."""
    env = vector_env(scenario, n_worlds=len(seeds))
    ends: dict[int, Tick] = {}

    def keep_end(world: int) -> None:
        ends[world] = env.tick_of(world)

    play(env, make_policy("active", scenario), seeds, at_end=keep_end)
    return [ends[k] for k in range(len(seeds))]


def _judged(tick: Tick) -> Arrays:
    """What every method leaves of a run, and what was measured in it."""
    belief, truth = tick.belief, tick.truth.poses
    edges, bearings = belief.log.edges, belief.log.bearings
    true = without(edges, _outliers(edges, truth))
    tried = [(edges, method) for method in METHODS] + [(true, "none")]
    errors = [
        ground_truth_error(
            solve_robust(belief.paths.estimate, of, bearings, robots=(0, 1), outliers=method)[0],
            truth,
        )
        for of, method in tried
    ]
    return {"errors": np.array(errors[:-1]), "removed": np.array(errors[-1]), **_measurements(tick)}


def _measurements(tick: Tick) -> Arrays:
    """Relative poses between robots: how wrong they are, and how far from the nearest peak (Eq. 10)."""
    belief, truth = tick.belief, tick.truth.poses
    met = select(belief.log.edges, belief.log.edges.tail[:, 0] != belief.log.edges.head[:, 0])
    row = heard_along(met, belief.log.bearings)
    met, row = select(met, row >= 0), row[row >= 0]
    exact = se2.between(truth[tuple(met.tail.T)], truth[tuple(met.head.T)])
    reported, peaks = bearing(met.z), belief.log.bearings.azimuth_rad[row]
    away = se2.wrap_angle(reported[:, None] - peaks)
    nearest = np.take_along_axis(away, np.abs(away).argmin(axis=1)[:, None], axis=1)[:, 0]
    return {
        "off_rad": nearest,
        "weight": likelihood(nearest),
        "pose_azimuth_error_rad": se2.wrap_angle(reported - bearing(exact)),
        "aoa_error_rad": -bearing_residuals(truth, belief.log.bearings)[row],
        "is_outlier": _outliers(met, truth),
        "range_m": np.hypot(exact[:, 0], exact[:, 1]),
    }


def _outliers(edges: Edges, truth: Float[np.ndarray, "robots times 3"]) -> Bool[np.ndarray, " edges"]:
    """Relative poses between robots, 2 sigma off in every component: noise is so once in ten thousand."""
    off = edges.z - se2.between(truth[tuple(edges.tail.T)], truth[tuple(edges.head.T)])
    off[:, 2] = se2.wrap_angle(off[:, 2])
    far: Bool[np.ndarray, " edges"] = (np.abs(off) > 1.99 * edges.sigma[:, [0, 0, 1]]).all(axis=1)
    return far & edges.between_robots
