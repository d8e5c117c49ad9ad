"""Fig. 10 as literally as Sec. 7.3 can be read: nine relative poses of several meetings, errors in them only.

The text: relative poses are generated "by randomly injecting them with translation and rotation error" of
2 to 3 sigma "of the original noise distribution", odometry is that of wheels, a run ends after nine of
them, five trials make a panel. It leaves open how good the wheels are, at which range robots are measured,
and which information matrices the solver is given: the first two are fields of `NinePoses`, the third is
`wifipgo.graph.solve_weights.counted_alike`.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from baselines.reproduce.encounters import dead_reckoned, moved, wheel_odometry
from wifipgo import se2
from wifipgo.errors import require
from wifipgo.graph.bearings import Bearings
from wifipgo.graph.edges import Edges, extended, select
from wifipgo.graph.outliers.aoa_weights import PAPER_SIGMA_RAD
from wifipgo.graph.solvers import KNOWN_START


@dataclass(frozen=True, slots=True, kw_only=True)
class NinePoses:
    """One reading of the experiment.

    Attributes:
        range_m: Distance of the robots when one measures the other.
        odometry_scale: Noise of a step of odometry, in units of that of a relative pose.
        n_outliers: Outliers among the relative poses.
        n_met: Relative poses of a run.
        n_meetings: Meetings that they come from, as evenly as they can be dealt out.
        n_between: Steps before the first meeting, between two, and after the last.
        sigma_t_m, sigma_r_rad: Noise of relative poses (paper Sec. 7.2).
        outlier_sigma: Least and most that an outlier is off in every component, in these.
    """

    range_m: float = 2.0
    odometry_scale: float = 0.1
    n_outliers: int = 3
    n_met: int = 9
    n_meetings: int = 3
    n_between: int = 8
    sigma_t_m: float = 0.2
    sigma_r_rad: float = float(np.deg2rad(5.0))
    outlier_sigma: tuple[float, float] = (2.0, 3.0)

    def __post_init__(self) -> None:
        """Reject values that cannot mean anything."""
        for name in ("range_m", "odometry_scale", "sigma_t_m", "sigma_r_rad"):
            require(getattr(self, name) > 0.0, f"NinePoses.{name}", "> 0", getattr(self, name))
        require(1 <= self.n_meetings <= self.n_met, "NinePoses.n_meetings", "1..n_met", self.n_meetings)
        require(0 <= self.n_outliers <= self.n_met, "NinePoses.n_outliers", "0..n_met", self.n_outliers)
        require(self.n_between >= 1, "NinePoses.n_between", ">= 1", self.n_between)

    @property
    def met_at(self) -> Int[np.ndarray, " met"]:
        """Iteration of each relative pose."""
        meeting = np.sort(np.arange(self.n_met) % self.n_meetings)
        return np.arange(self.n_met) + self.n_between * (1 + meeting)

    @property
    def n_times(self) -> int:
        """Poses of a robot."""
        return int(self.met_at[-1]) + self.n_between + 1


class Run(NamedTuple):
    """What happened and what was measured.

    Attributes:
        truth: True poses.
        start: Dead reckoning from the true first poses.
        edges: Odometry, then the relative poses, each with its true covariance.
        is_outlier: Which edges are outliers.
        azimuth_rad: True direction of each measured robot, from who measures it.
    """

    truth: Float[np.ndarray, "2 times 3"]
    start: Float[np.ndarray, "2 times 3"]
    edges: Edges
    is_outlier: Bool[np.ndarray, " edges"]
    azimuth_rad: Float[np.ndarray, " met"]


def simulate_run(cfg: NinePoses, *, rng: np.random.Generator) -> Run:
    """Draw one run. One seed gives the same paths and noise for every number of outliers."""
    walk, noise, outliers = rng.spawn(3)
    truth = _paths(cfg, walk)
    scale = cfg.odometry_scale
    odometry = wheel_odometry(truth, sigma=(scale * cfg.sigma_t_m, scale * cfg.sigma_r_rad), rng=noise)
    who, now = np.arange(cfg.n_met) % 2, cfg.met_at
    exact = se2.between(truth[who, now], truth[1 - who, now])
    z, is_bad = relative_poses(exact, cfg, noise, outliers)
    tail, head = np.stack([who, now], axis=1), np.stack([1 - who, now], axis=1)
    sigma = (cfg.sigma_t_m, cfg.sigma_r_rad)
    met = Edges.measured(tail=tail, head=head, z=z, sigma=sigma, reported_pose=truth[1 - who, now])
    return Run(
        truth,
        dead_reckoned(truth, odometry),
        extended(odometry, met),
        np.append(np.zeros(len(odometry), dtype=bool), is_bad),
        np.arctan2(exact[:, 1], exact[:, 0]),
    )


def heard(run: Run, error_rad: Float[np.ndarray, " met"]) -> Bearings:
    """Direction of the signal of each measured robot, with an error for each."""
    met = select(run.edges, run.edges.between_robots)
    azimuth = se2.wrap_angle(run.azimuth_rad + error_rad)
    return Bearings.measured(
        observer=met.tail, target=met.head, azimuth_rad=azimuth[:, None], sigma_rad=PAPER_SIGMA_RAD
    )


def start_sigma() -> Float[np.ndarray, "2 2"]:
    """How well the first poses are known: as the paper's robots, which share a frame."""
    return np.array([KNOWN_START, KNOWN_START])


def _paths(cfg: NinePoses, rng: np.random.Generator) -> Float[np.ndarray, "2 times 3"]:
    """Robot 0 wanders, robot 1 from meeting to meeting, then at the range to measure. Both face anywhere."""
    n = cfg.n_times
    poses = rng.uniform(-np.pi, np.pi, (2, n, 3))
    heading = rng.uniform(-np.pi, np.pi, n)
    step = rng.uniform(0.5, 1.5, (n, 1)) * np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    poses[0, :, :2] = np.cumsum(step, axis=0)
    azimuth = rng.uniform(-np.pi, np.pi) + np.cumsum(rng.normal(0.0, 0.3, cfg.n_met))
    away_m = cfg.range_m * np.stack([np.cos(azimuth), np.sin(azimuth)], axis=-1)
    poses[1, :, :2] = _through(cfg.met_at, poses[0, cfg.met_at, :2] + away_m, n, rng)
    return poses


def _through(
    at: Int[np.ndarray, " met"], places_m: Float[np.ndarray, "met 2"], n: int, rng: np.random.Generator
) -> Float[np.ndarray, "times 2"]:
    """A random walk that is tied to places at given times (a Brownian bridge between each two)."""
    walk = np.cumsum(rng.normal(0.0, 0.5, (n, 2)), axis=0)
    tied = [np.interp(np.arange(n), at, places_m[:, k] - walk[at, k]) for k in (0, 1)]
    return walk + np.stack(tied, axis=-1)


def relative_poses(
    exact: Float[np.ndarray, "met 3"],
    cfg: NinePoses,
    rng: np.random.Generator,
    outlier_rng: np.random.Generator,
) -> tuple[Float[np.ndarray, "met 3"], Bool[np.ndarray, " met"]]:
    """Measured with noise, or, if an outlier, 2 to 3 sigma off in every component; and which are outliers."""
    n, scale = len(exact), np.array([cfg.sigma_t_m, cfg.sigma_t_m, cfg.sigma_r_rad])
    good = rng.standard_normal((n, 3))
    is_bad = outlier_rng.permutation(n) < cfg.n_outliers
    signs = np.where(outlier_rng.random((n, 3)) < 0.5, -1.0, 1.0)
    bad = signs * outlier_rng.uniform(*cfg.outlier_sigma, (n, 3))
    return moved(exact, np.where(is_bad[:, None], bad, good) * scale), is_bad
