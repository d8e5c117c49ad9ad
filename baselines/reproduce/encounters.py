"""Encounters of two robots with outliers, as in paper Sec. 7.3, drawn without a room, radio or physics.

The paper's numbers: relative poses are taken until there are nine, an outlier is 2 to 3
standard deviations off, noise is 0.2 m and 5 degrees. Ours: everything else, so that a grid
of `EncounterConfig` covers what the paper leaves open.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from wifipgo import se2
from wifipgo.errors import pick, require
from wifipgo.graph.bearings import Bearings, bearing_residuals
from wifipgo.graph.edges import Edges, extended
from wifipgo.graph.solvers import KNOWN_START, UNKNOWN_START

KINDS: Mapping[str, str] = MappingProxyType(
    {
        "random": "2 to 3 sigma off in every component, each sign drawn for itself",
        "same": "2 to 3 sigma off in every component, with the same three signs all through the encounter",
        "gross": "anywhere from half to one and a half times as far away, in any direction, facing any way",
    }
)


@dataclass(frozen=True, slots=True, kw_only=True)
class EncounterConfig:
    """One kind of encounter.

    Attributes:
        range_m: Distance of the robots while they measure each other.
        odometry_scale: Noise of a step of odometry, in units of that of a relative pose.
        n_outliers: Outliers among the relative poses.
        kind: A name in `KINDS`.
        start_known: Whether robot 1 knows where it starts in the frame of robot 0.
        bearings_wrong: Whether all bearings that a robot takes are off by one angle of 20 to 180 degrees.
        noise: Factor on all noise that is drawn; what the robots take it to be stays.
        sigma_t_m, sigma_r_rad: Noise of relative poses.
        bearing_sigma_rad: Noise of a bearing that is not gross.
        bearing_gross_share: Share of bearings that point anywhere.
        n_before, n_met, n_after: Steps before the encounter, relative poses in it, steps after it.
    """

    range_m: float = 2.0
    odometry_scale: float = 0.3
    n_outliers: int = 0
    kind: str = "random"
    start_known: bool = True
    bearings_wrong: bool = False
    noise: float = 1.0
    sigma_t_m: float = 0.2
    sigma_r_rad: float = float(np.deg2rad(5.0))
    bearing_sigma_rad: float = float(np.deg2rad(3.0))
    bearing_gross_share: float = 0.075
    n_before: int = 10
    n_met: int = 9
    n_after: int = 5

    def __post_init__(self) -> None:
        """Reject values that cannot mean anything."""
        for name in ("range_m", "odometry_scale", "sigma_t_m", "sigma_r_rad", "bearing_sigma_rad"):
            require(getattr(self, name) > 0.0, f"EncounterConfig.{name}", "> 0", getattr(self, name))
        require(self.noise >= 0.0, "EncounterConfig.noise", ">= 0", self.noise)
        share = self.bearing_gross_share
        require(0.0 <= share <= 1.0, "EncounterConfig.bearing_gross_share", "in 0..1", share)
        require(min(self.n_before, self.n_after) >= 0, "EncounterConfig.n_before, n_after", ">= 0", self)
        require(self.n_met >= 1, "EncounterConfig.n_met", ">= 1", self.n_met)
        rule = f"in 0..{self.n_met} (n_met)"
        require(0 <= self.n_outliers <= self.n_met, "EncounterConfig.n_outliers", rule, self.n_outliers)
        pick(KINDS, self.kind, "kind of outlier")


class Encounter(NamedTuple):
    """What happened and what was measured.

    Attributes:
        truth: True poses.
        start: Dead reckoning; of robot 1, if its start is unknown, from where most relative poses put it.
        start_sigma: How well the first poses are known, for `wifipgo.graph.solve`.
        edges: Odometry, then the relative poses.
        bearings: Of both robots at each relative pose, those of its tail first.
        is_outlier: Which edges are outliers.
    """

    truth: Float[np.ndarray, "2 times 3"]
    start: Float[np.ndarray, "2 times 3"]
    start_sigma: Float[np.ndarray, "2 2"]
    edges: Edges
    bearings: Bearings
    is_outlier: Bool[np.ndarray, " edges"]


def simulate_encounter(cfg: EncounterConfig, *, rng: np.random.Generator) -> Encounter:
    """Draw one encounter. One seed gives the same paths and noise for every kind and number of outliers."""
    walk, noise, outliers, channel = rng.spawn(4)
    truth = _paths(cfg, walk)
    sigma = (cfg.odometry_scale * cfg.sigma_t_m, cfg.odometry_scale * cfg.sigma_r_rad)
    odometry = wheel_odometry(truth, sigma=sigma, rng=noise, noise=cfg.noise)
    met, is_bad = _met(truth, cfg, noise, outliers)
    start = dead_reckoned(truth, odometry)
    if not cfg.start_known:
        start[1] = se2.compose(_alignment(start, met), start[1])
    return Encounter(
        truth,
        start,
        np.array([KNOWN_START, KNOWN_START if cfg.start_known else UNKNOWN_START]),
        extended(odometry, met),
        _bearings(truth, met, cfg, channel),
        np.append(np.zeros(len(odometry), dtype=bool), is_bad),
    )


def _steps(n: int, rng: np.random.Generator) -> Float[np.ndarray, "steps 2"]:
    """Steps of 0.5 to 1.5 m in any direction."""
    azimuth = rng.uniform(-np.pi, np.pi, n)
    return rng.uniform(0.5, 1.5, (n, 1)) * np.stack([np.cos(azimuth), np.sin(azimuth)], axis=-1)


def _paths(cfg: EncounterConfig, rng: np.random.Generator) -> Float[np.ndarray, "2 times 3"]:
    """Both wander and face anywhere; while they meet, robot 1 keeps its range and slowly circles robot 0."""
    n = cfg.n_before + cfg.n_met + cfg.n_after + 1
    poses = rng.uniform(-np.pi, np.pi, (2, n, 3))
    poses[0, :, :2] = np.cumsum(_steps(n, rng), axis=0)
    first, last = cfg.n_before + 1, cfg.n_before + cfg.n_met
    azimuth = rng.uniform(-np.pi, np.pi) + np.cumsum(rng.normal(0.0, 0.3, cfg.n_met))
    away_m = cfg.range_m * np.stack([np.cos(azimuth), np.sin(azimuth)], axis=-1)
    poses[1, first : last + 1, :2] = poses[0, first : last + 1, :2] + away_m
    poses[1, :first, :2] = poses[1, first, :2] - np.cumsum(_steps(first, rng), axis=0)[::-1]
    poses[1, last + 1 :, :2] = poses[1, last, :2] + np.cumsum(_steps(n - last - 1, rng), axis=0)
    return poses


def wheel_odometry(
    truth: Float[np.ndarray, "2 times 3"],
    *,
    sigma: tuple[float, float],
    rng: np.random.Generator,
    noise: float = 1.0,
) -> Edges:
    """Every step of both robots.

    Args:
        truth: True poses.
        sigma: Noise of a step, m and rad.
        rng: Draws it.
        noise: Factor on the noise that is drawn; what the robots take it to be stays.
    """
    n = truth.shape[1] - 1
    robot, t = np.indices((2, n)).reshape(2, -1)
    unit = noise * rng.standard_normal((2, n, 3))
    z = moved(se2.between(truth[:, :-1], truth[:, 1:]), unit * [sigma[0], *sigma])
    tail, head = np.stack([robot, t], axis=1), np.stack([robot, t + 1], axis=1)
    return Edges.measured(tail=tail, head=head, z=z.reshape(-1, 3), sigma=sigma)


def _met(
    truth: Float[np.ndarray, "2 times 3"],
    cfg: EncounterConfig,
    rng: np.random.Generator,
    outlier_rng: np.random.Generator,
) -> tuple[Edges, Bool[np.ndarray, " met"]]:
    """Relative poses, taken in turn by robot 0 and robot 1, and which are outliers."""
    n = cfg.n_met
    who, now = np.arange(n) % 2, cfg.n_before + 1 + np.arange(n)
    exact = se2.between(truth[who, now], truth[1 - who, now])
    scale = np.array([cfg.sigma_t_m, cfg.sigma_t_m, cfg.sigma_r_rad])
    good = moved(exact, cfg.noise * rng.standard_normal((n, 3)) * scale)
    is_bad = outlier_rng.permutation(n) < cfg.n_outliers
    size = outlier_rng.uniform(2.0, 3.0, (n, 3))
    signs = np.where(outlier_rng.random((n, 3)) < 0.5, -1.0, 1.0)
    anywhere = outlier_rng.uniform([0.5, -np.pi, -np.pi], [1.5, np.pi, np.pi], (n, 3))
    bad = moved(exact, size * (signs[:1] if cfg.kind == "same" else signs) * scale)
    if cfg.kind == "gross":
        range_m, azimuth, yaw = cfg.range_m * anywhere[:, 0], anywhere[:, 1], anywhere[:, 2]
        bad = np.stack([range_m * np.cos(azimuth), range_m * np.sin(azimuth), yaw], axis=-1)
    z = np.where(is_bad[:, None], bad, good)
    tail, head = np.stack([who, now], axis=1), np.stack([1 - who, now], axis=1)
    told = truth[1 - who, now]  # both take part in the solve, so nobody reads it
    sigma = (cfg.sigma_t_m, cfg.sigma_r_rad)
    return Edges.measured(tail=tail, head=head, z=z, sigma=sigma, reported_pose=told), is_bad


def moved(z: Float[np.ndarray, "*rows 3"], by: Float[np.ndarray, "*rows 3"]) -> Float[np.ndarray, "*rows 3"]:
    """Measurements with an error, in the frame of the tail."""
    found = z + by
    found[..., 2] = se2.wrap_angle(found[..., 2])
    return found


def _bearings(
    truth: Float[np.ndarray, "2 times 3"], met: Edges, cfg: EncounterConfig, rng: np.random.Generator
) -> Bearings:
    """What both robots hear at each relative pose: Gaussian, some gross, or all off by one angle a robot."""
    observer, target = np.concatenate([met.tail, met.head]), np.concatenate([met.head, met.tail])
    n = len(observer)
    exact = Bearings.measured(
        observer=observer, target=target, azimuth_rad=np.zeros((n, 1)), sigma_rad=cfg.bearing_sigma_rad
    )
    unit, gross = rng.standard_normal(n), rng.random(n) < cfg.bearing_gross_share
    anywhere = rng.uniform(-np.pi, np.pi, n)
    bias = rng.choice([-1.0, 1.0], 2) * rng.uniform(np.deg2rad(20.0), np.pi, 2)
    true_rad = bearing_residuals(truth, exact)
    azimuth = true_rad + cfg.noise * cfg.bearing_sigma_rad * unit
    if cfg.bearings_wrong:
        azimuth += bias[observer[:, 0]]
    elif cfg.noise > 0.0:
        azimuth = np.where(gross, anywhere, azimuth)
    return Bearings.measured(
        observer=observer,
        target=target,
        azimuth_rad=se2.wrap_angle(azimuth)[:, None],
        sigma_rad=cfg.bearing_sigma_rad,
    )


def dead_reckoned(truth: Float[np.ndarray, "2 times 3"], odometry: Edges) -> Float[np.ndarray, "2 times 3"]:
    """Odometry from the true first poses."""
    return se2.chained(truth[:, 0], odometry.z.reshape(2, -1, 3))


def _alignment(start: Float[np.ndarray, "2 times 3"], met: Edges) -> Float[np.ndarray, "3"]:
    """Motion of robot 1's whole path that one relative pose asks for: the one nearest to all others'."""
    from_0 = (met.tail[:, 0] == 0)[:, None]
    z: Float[np.ndarray, "met 3"] = np.where(from_0, met.z, se2.inverse(met.z))
    now: Int[np.ndarray, " met"] = met.tail[:, 1]
    moves = se2.compose(se2.compose(start[0, now], z), se2.inverse(start[1, now]))
    asked = se2.compose(moves, np.broadcast_to(start[1, now[:1]], moves.shape))
    off = asked[:, None] - asked[None]
    off[..., 2] = se2.wrap_angle(off[..., 2])
    distance = np.hypot(off[..., 0], off[..., 1]) / met.sigma[0, 0] + np.abs(off[..., 2]) / met.sigma[0, 1]
    return moves[distance.sum(axis=1).argmin()]
