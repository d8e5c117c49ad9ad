"""What robots measure of the world with sensors other than radio (paper Eq. 2)."""

import functools
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from wifipgo import se2
from wifipgo.errors import pick, require, require_within
from wifipgo.rows import Chance
from wifipgo.world.line_of_sight import in_sight
from wifipgo.world.neighbours import Neighbours, in_turn, neighbours
from wifipgo.world.pair_chance import pair_normals, pair_uniforms

_LEAST_SIGMA = 1e-3
# Errors and ranges beyond all rooms, and far from where their squares overflow.
_MOST_SIGMA, _MOST_RANGE_M = 1e4, 1e6
_LIMITS = {
    "sigma_t_m": (0.0, _MOST_SIGMA),
    "sigma_r_rad": (0.0, _MOST_SIGMA),
    "sensor_range_m": (0.0, _MOST_RANGE_M),
    "revisit_gap": (2, 1_000_000),
    "outlier_share": (0.0, 1.0),
    "outlier_min_sigma": (0.0, 1e6),
    "outlier_max_sigma": (0.0, 1e6),
}
# Whether noise of odometry grows with the distance driven, and for which distance it is as stated.
ODOMETRY_NOISE: Mapping[str, bool] = MappingProxyType({"constant": False, "motion": True})
_STATED_FOR_M = 2.0
# Whether one robot of a pair in view measures the other at an iteration, rather than each the other.
MEASURED_BY: Mapping[str, bool] = MappingProxyType({"both": False, "one": True})
_SIGMA_OF = np.array([0, 0, 1])  # of x, y and yaw
# A camera's bearings, and its distances as a share of them (ours; the paper gives no figures).
_CAMERA_SIGMA_RAD = float(np.deg2rad(2.0))
_CAMERA_RANGE_SIGMA = 0.05


@dataclass(frozen=True, slots=True, kw_only=True)
class SensingConfig:
    """Noise and range of odometry and relative poses.

    Noise and the range of 2.2 are the paper's (Secs. 7.1.2, 7.2.1). That a robot also
    measures its pose relative to places it passed before is Eq. 2's remark on landmarks;
    how long before (``revisit_gap``) is ours.

    Attributes:
        sigma_t_m: Standard deviation of a measured translation, in x and in y.
        sigma_r_rad: Standard deviation of a measured rotation.
        noise_scale: One factor per robot on both sigmas, or empty for all 1.
        odometry_noise: "constant", the same at every iteration, or "motion", in proportion to the distance
            driven: the stated noise for a drive of 2 m, none while a robot stands.
        sensor_range_m: How far robots measure the poses of others and of places.
        measured_by: "both" robots of a pair measure each other, so that an observation is two relative poses,
            or "one" of them, turn and turn about: then it is a single one.
        revisit_gap: Iterations after which a robot measures a place that it passed again.
        outlier_share: Share of relative poses between robots that are outliers.
        outlier_min_sigma, outlier_max_sigma: Size of an outlier's error in every component (paper Sec. 7.3).
    """

    sigma_t_m: float = 0.1
    sigma_r_rad: float = float(np.deg2rad(3.0))
    noise_scale: tuple[float, ...] = ()
    odometry_noise: str = "constant"
    sensor_range_m: float = 2.2
    measured_by: str = "both"
    revisit_gap: int = 3
    outlier_share: float = 0.0
    outlier_min_sigma: float = 2.0
    outlier_max_sigma: float = 3.0

    def __post_init__(self) -> None:
        """Reject values that cannot mean anything."""
        require_within(self, _LIMITS)
        pick(ODOMETRY_NOISE, self.odometry_noise, "odometry_noise")
        pick(MEASURED_BY, self.measured_by, "measured_by")
        spread = (self.outlier_min_sigma, self.outlier_max_sigma)
        require(
            0.0 <= spread[0] <= spread[1], "SensingConfig.outlier_max_sigma", ">= outlier_min_sigma", spread
        )
        for scale in self.noise_scale:
            require(0.0 <= scale <= 1e6, "SensingConfig.noise_scale", "all in 0..1e+06", self.noise_scale)
        factor = max(self.noise_scale, default=1.0) * max(self.outlier_max_sigma, 1.0)
        for name in ("sigma_t_m", "sigma_r_rad"):
            largest, rule = getattr(self, name) * factor, f"at most {_MOST_SIGMA:g} with its factors"
            require(largest <= _MOST_SIGMA, f"SensingConfig.{name}", rule, largest)

    @functools.lru_cache(maxsize=16)  # noqa: B019 (a few configurations, asked for at every step)
    def sigmas(self, n_robots: int, n_worlds: int = 1) -> Float[np.ndarray, "rows 2"]:
        """Standard deviations ``(sigma_t_m, sigma_r_rad)`` of measurements, robot by robot of each world."""
        scale = np.array(self.noise_scale) if self.noise_scale else np.ones(n_robots)
        require(
            len(scale) == n_robots, "SensingConfig.noise_scale", f"empty or {n_robots} long", self.noise_scale
        )
        return np.tile(scale[:, None] * np.array([self.sigma_t_m, self.sigma_r_rad]), (n_worlds, 1))

    @functools.lru_cache(maxsize=16)  # noqa: B019
    def stated_sigmas(self, n_robots: int, n_worlds: int = 1) -> Float[np.ndarray, "rows 2"]:
        """What robots take the standard deviations to be; a noise-free sensor still has a finite weight."""
        return np.maximum(self.sigmas(n_robots, n_worlds), _LEAST_SIGMA)


def odometry_sigmas(
    cfg: SensingConfig, motion: Float[np.ndarray, "rows 3"], *, n_worlds: int, stated: bool = False
) -> Float[np.ndarray, "rows 2"]:
    """Standard deviations of odometry over motions, or what robots that measured these take them to be."""
    n_robots = len(motion) // n_worlds
    sigma = (cfg.stated_sigmas if stated else cfg.sigmas)(n_robots, n_worlds)
    if not ODOMETRY_NOISE[cfg.odometry_noise]:
        return sigma
    scaled = sigma * (se2.length(motion[:, :2]) / _STATED_FOR_M)[:, None]
    return np.maximum(scaled, _LEAST_SIGMA) if stated else scaled


class RelativePoses(NamedTuple):
    """Relative poses measured at one iteration: ``z = T_tail_head``; an index is (row, iteration)."""

    tail: Int[np.ndarray, "edges 2"]
    head: Int[np.ndarray, "edges 2"]
    z: Float[np.ndarray, "edges 3"]
    sigma: Float[np.ndarray, "edges 2"]
    is_outlier: Bool[np.ndarray, " edges"]


def noisy(
    z: Float[np.ndarray, "... 3"], sigma: Float[np.ndarray, "... 2"], unit: Float[np.ndarray, "... 3"]
) -> Float[np.ndarray, "... 3"]:
    """Eq. 2: ``p + p_eps`` and ``R R_eps``, with the noise given in units of sigma."""
    out = z + unit * sigma.take(_SIGMA_OF, axis=-1)
    out[..., 2] = se2.wrap_angle(out[..., 2])
    return out


def odometry(
    before: Float[np.ndarray, "rows 3"],
    after: Float[np.ndarray, "rows 3"],
    *,
    cfg: SensingConfig,
    rng: Chance,
    n_worlds: int = 1,
) -> Float[np.ndarray, "rows 3"]:
    """Each robot's measured motion ``T_before_after`` over one iteration, drive and turn together."""
    motion = se2.between(before, after)
    sigma = odometry_sigmas(cfg, motion, n_worlds=n_worlds)
    return noisy(motion, sigma, rng.standard_normal((len(before), 3)))


def robots_in_view(
    poses: Float[np.ndarray, "rows 3"], faces_m: Float[np.ndarray, "*worlds faces 2 2"], *, range_m: float
) -> Bool[np.ndarray, "rows peers"]:
    """Who sees whom: within range, nothing in between, not oneself.

    Args:
        poses: ``T_world_robot``, world after world.
        faces_m: Edges of obstacles; of each world, if there are several.
        range_m: How far robots see.
    """
    found = _in_view(poses, faces_m, range_m)
    seen = np.zeros((len(poses), _team_size(poses, faces_m)), dtype=bool)
    seen[found.row, found.peer] = True
    return seen


def _team_size(poses: np.ndarray, faces_m: np.ndarray) -> int:
    """Robots of each world."""
    return len(poses) if faces_m.ndim == 3 else len(poses) // len(faces_m)


def _in_view(
    poses: Float[np.ndarray, "rows 3"], faces_m: Float[np.ndarray, "*worlds faces 2 2"], range_m: float
) -> Neighbours:
    """Neighbours with nothing in between."""
    p_m, n = poses[:, :2], _team_size(poses, faces_m)
    near = neighbours(p_m, n, range_m)
    if not faces_m.size or not len(near.row):
        return near
    hiding_m = faces_m if faces_m.ndim == 4 else faces_m[None]
    clear = in_sight(p_m[near.row], p_m[near.other], hiding_m, near.row // n).nonzero()[0]
    return Neighbours(*(column[clear] for column in near))


def sight_robots(
    poses: Float[np.ndarray, "rows 3"],
    faces_m: Float[np.ndarray, "*worlds faces 2 2"],
    *,
    range_m: float,
    rng: Chance,
) -> Float[np.ndarray, "rows 2"]:
    """The nearest robot that each robot's camera sees, if any (for vision-based policies).

    Noise is drawn for every robot, so that the stream does not depend on who saw whom.

    Args:
        poses: ``T_world_robot``, world after world.
        faces_m: Edges of obstacles; of each world, if there are several.
        range_m: How far cameras recognise a robot; 0 in the dark.
        rng: Of the camera's noise.

    Returns:
        Distance (m) and bearing (body frame, rad) of it; 0 and 0 where none is seen.
    """
    unit, found = rng.standard_normal((len(poses), 2)), np.zeros((len(poses), 2))
    pairs = _in_view(poses, faces_m, range_m)
    if not len(pairs.row):
        return found
    shortest_m = np.full(len(poses), np.inf)
    np.minimum.at(shortest_m, pairs.row, pairs.apart_m)
    at = (pairs.apart_m == shortest_m[pairs.row]).nonzero()[0][::-1]
    nearest = np.full(len(poses), -1)
    nearest[pairs.row[at]] = at  # the lower number of two that are as near, as it is written last
    nearest = nearest[nearest >= 0]
    seer, apart_m, unit = pairs.row[nearest], pairs.apart_m[nearest], unit[pairs.row[nearest]]
    d_m = poses[pairs.other[nearest], :2] - poses[seer, :2]
    distance_m = apart_m * np.exp(_CAMERA_RANGE_SIGMA * unit[:, 0])
    bearing_rad = np.arctan2(d_m[:, 1], d_m[:, 0]) - poses[seer, 2] + _CAMERA_SIGMA_RAD * unit[:, 1]
    found[seer, 0], found[seer, 1] = np.minimum(distance_m, range_m), se2.wrap_angle(bearing_rad)
    return found


_NOTHING = RelativePoses(
    np.zeros((0, 2), dtype=np.int64),
    np.zeros((0, 2), dtype=np.int64),
    np.zeros((0, 3)),
    np.zeros((0, 2)),
    np.zeros(0, dtype=bool),
)


def observe_robots(
    poses: Float[np.ndarray, "rows 3"],
    t: int,
    seen: Bool[np.ndarray, "rows peers"],
    *,
    cfg: SensingConfig,
    rng: Chance,
    outlier_rng: Chance,
) -> RelativePoses:
    """Relative poses between robots in view of each other, some of them outliers.

    An outlier's error is between ``outlier_min_sigma`` and ``outlier_max_sigma`` with a random
    sign in every component (paper Sec. 7.3) in place of the Gaussian one. Noise is a function of
    the pair and the step (`wifipgo.world.pair_chance`), so it does not depend on who saw whom; that
    of outliers is only drawn where there are any.
    """
    i, peer = (in_turn(seen, t) if MEASURED_BY[cfg.measured_by] else seen).nonzero()
    noise, is_outlier = pair_normals(rng, seen.shape, i, peer, 3), np.zeros(len(i), dtype=bool)
    if cfg.outlier_share > 0.0:
        is_outlier = pair_uniforms(outlier_rng, seen.shape, i, peer, 1)[:, 0] < cfg.outlier_share
        spread = cfg.outlier_max_sigma - cfg.outlier_min_sigma
        size = cfg.outlier_min_sigma + spread * pair_uniforms(outlier_rng, seen.shape, i, peer, 3)
        negative = pair_uniforms(outlier_rng, seen.shape, i, peer, 3) < 0.5
        noise = np.where(is_outlier[:, None], np.where(negative, -size, size), noise)
    if not len(i):
        return _NOTHING
    n = seen.shape[1]
    j, n_worlds = i - i % n + peer, len(seen) // n
    z = noisy(se2.between(poses[i], poses[j]), cfg.sigmas(n, n_worlds)[i], noise)
    return RelativePoses(indices(i, t), indices(j, t), z, cfg.stated_sigmas(n, n_worlds)[i], is_outlier)


def indices(row: Int[np.ndarray, " poses"], t: Int[np.ndarray, " poses"] | int) -> Int[np.ndarray, "poses 2"]:
    """Indices (row, iteration) of poses."""
    out = np.empty((len(row), 2), dtype=np.int64)
    out[:, 0], out[:, 1] = row, t
    return out


def measure_loop_closures(
    history: Float[np.ndarray, "rows times 3"],
    faces_m: Float[np.ndarray, "*worlds faces 2 2"],
    *,
    cfg: SensingConfig,
    rng: Chance,
) -> RelativePoses:
    """Each robot's pose relative to the nearest place in view that it passed at least ``revisit_gap`` ago."""
    n_rows, n_times = history.shape[:2]
    t, unit, n = n_times - 1, rng.standard_normal((n_rows, 3)), _team_size(history, faces_m)
    now, n_past = history[:, -1], t - cfg.revisit_gap + 1
    if n_past <= 0:
        return _NOTHING
    gap_m = se2.length(history[:, :n_past, :2] - now[:, None, :2])
    near = gap_m.argmin(axis=1)
    robot = (gap_m[np.arange(n_rows), near] <= cfg.sensor_range_m).nonzero()[0]
    old = history[robot, near[robot]]
    if faces_m.size and len(robot):
        hiding_m = faces_m if faces_m.ndim == 4 else faces_m[None]
        clear = in_sight(now[robot, :2], old[:, :2], hiding_m, robot // n)
        robot, old = robot[clear], old[clear]
    if not len(robot):
        return _NOTHING
    z = noisy(se2.between(now[robot], old), cfg.sigmas(n, n_rows // n)[robot], unit[robot])
    tail, head, sigma = indices(robot, t), indices(robot, near[robot]), cfg.stated_sigmas(n, n_rows // n)
    return RelativePoses(tail, head, z, sigma[robot], np.zeros(len(robot), dtype=bool))
