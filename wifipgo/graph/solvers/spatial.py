"""Maximum-likelihood poses of a graph with any keys, in the plane or in space, by one computer.

A graph may be in several parts: the first pose of each stays where it is, since no
measurement says where a part is, and so no system is indeterminate.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import gtsam
import numpy as np
from jaxtyping import Float, Int

from wifipgo import se3
from wifipgo.errors import pick
from wifipgo.graph.chordal import matrices, pose_rows, two_stage
from wifipgo.graph.keyed import PoseGraph, normalised
from wifipgo.graph.parts import held
from wifipgo.graph.residuals import chi_squares
from wifipgo.graph.solvers.report import Report, WeighedDown
from wifipgo.threads import one_thread

METHODS: Mapping[str, str] = MappingProxyType({"lm": "Levenberg-Marquardt", "gn": "Gauss-Newton"})
INITIAL: Mapping[str, str] = MappingProxyType(
    {"given": "the poses as they are", "chordal": "two linear problems, see wifipgo.graph.chordal"}
)
ROBUST: Mapping[str, str] = MappingProxyType(
    {
        "none": "squares",
        "huber": "squares up to the knee, linear beyond",
        "gnc": "truncated squares, by graduated non-convexity (Yang et al., RA-L 2020)",
    }
)
ANCHOR_SIGMA = 1e-6  # m and rad
TOLERANCE = 1e-10  # on the relative and absolute fall of the error
STATIONARY = 1e-6  # gain of one more step, as a share of the error, that counts as none
MAX_ITERATIONS = 100  # of a search
HUBER_KNEE = 1.345  # in sigmas, the customary one
GNC_CONFIDENCE = 0.99  # share of good measurements that truncation keeps
FULL_WEIGHT = 1.0 - 1e-6  # what has less was weighed down
_ORDER = MappingProxyType({3: [0, 1, 2], 6: [3, 4, 5, 0, 1, 2]})  # in space gtsam puts rotation first


@one_thread
def solve_graph(
    graph: PoseGraph,
    start: Float[np.ndarray, "poses dims"] | None = None,
    *,
    fixed: Int[np.ndarray, " fixed"] | None = None,
    method: str = "lm",
    initial: str = "given",
    robust: str = "none",
) -> tuple[Float[np.ndarray, "poses dims"], Report]:
    """Poses that make the measurements most likely (paper Eq. 3).

    Args:
        graph: Poses and measurements; those of weight zero are dropped.
        start: Where the search starts, the last optimum say; the graph's own poses if left out.
        fixed: Rows of poses that are known and stay, as does the first of each part without any.
        method: One of `METHODS`.
        initial: One of `INITIAL`: what is made of the start before the search.
        robust: One of `ROBUST`, for all measurements but odometry, which is trusted.

    Returns:
        Pose rows, and what the search did.

    Raises:
        UnknownNameError: An option is unknown.
    """
    pick(METHODS, method, "method")
    pick(INITIAL, initial, "initial poses")
    pick(ROBUST, robust, "robust loss")
    rows = graph.poses if start is None else normalised(start)
    if initial == "chordal":
        rows = pose_rows(two_stage(graph, matrices(rows), fixed))
    weight = np.ones(len(graph.tail))
    if robust == "gnc":
        rows, weight = _truncated(graph, rows, fixed)
    searched = graph.with_weight(graph.weight * weight)
    rows, report = _search(searched, rows, fixed, method, huber=robust == "huber")
    if robust == "huber":
        weight = _huber_weights(graph, rows)
    down = np.flatnonzero((weight < FULL_WEIGHT) & (graph.weight > 0.0))
    return rows, report._replace(weighed_down=(WeighedDown(robust, down, weight[down]),) if len(down) else ())


@one_thread
def marginal_covariances(
    graph: PoseGraph,
    estimate: Float[np.ndarray, "poses dims"],
    rows: Int[np.ndarray, " wanted"] | None = None,
    *,
    fixed: Int[np.ndarray, " fixed"] | None = None,
) -> Float[np.ndarray, "wanted freedom freedom"]:
    """Covariance of poses, given all measurements, in each pose's own frame, translation first.

    The first pose of each connected part has none: it is where the others are counted from.

    Args:
        graph: Poses and measurements.
        estimate: The optimum.
        rows: Poses asked for; all if left out.
        fixed: Poses that are known besides.
    """
    factors, _ = _factors(graph, estimate, fixed, huber=False)
    marginals = gtsam.Marginals(factors, _values(estimate))
    order = np.argsort(_ORDER[graph.freedom])
    wanted = range(len(graph.poses)) if rows is None else rows.tolist()
    found = np.array([marginals.marginalCovariance(row) for row in wanted])
    return found.reshape(-1, graph.freedom, graph.freedom)[:, order][:, :, order]


@one_thread
def at_minimum(
    graph: PoseGraph,
    estimate: Float[np.ndarray, "poses dims"],
    fixed: Int[np.ndarray, " fixed"] | None = None,
) -> bool:
    """Whether one more step would gain nothing: a search may also end because it cannot go on.

    Args:
        graph: Poses and measurements, under the weights that a robust loss ended with.
        estimate: Where the search ended.
        fixed: Poses that are known.
    """
    factors, _ = _factors(graph, estimate, fixed, huber=False)
    values = _values(estimate)
    here = factors.error(values)
    if not np.isfinite(here):
        return False
    linear = factors.linearize(values)
    try:
        step = linear.optimize()
    except RuntimeError:  # no digits are left for one more step, so nobody can tell
        return False
    return bool(here - linear.error(step) <= STATIONARY * (1.0 + here))


def _search(
    graph: PoseGraph,
    rows: Float[np.ndarray, "poses dims"],
    fixed: Int[np.ndarray, " fixed"] | None,
    method: str,
    *,
    huber: bool,
) -> tuple[Float[np.ndarray, "poses dims"], Report]:
    """One search from ``rows``."""
    factors, used = _factors(graph, rows, fixed, huber=huber)
    optimiser = _optimiser(factors, rows, method)
    before = optimiser.error()
    found = _rows(optimiser.optimize(), graph.freedom)
    chi2 = (2.0 * before, 2.0 * optimiser.error())
    return found, Report(optimiser.iterations(), *chi2, len(used), len(graph.tail) - len(used))


def _optimiser(
    factors: gtsam.NonlinearFactorGraph, rows: Float[np.ndarray, "poses dims"], method: str
) -> gtsam.NonlinearOptimizer:
    kind = {
        "lm": (gtsam.LevenbergMarquardtParams, gtsam.LevenbergMarquardtOptimizer),
        "gn": (gtsam.GaussNewtonParams, gtsam.GaussNewtonOptimizer),
    }
    params = kind[method][0]()
    params.setRelativeErrorTol(TOLERANCE)
    params.setAbsoluteErrorTol(TOLERANCE)
    params.setMaxIterations(MAX_ITERATIONS)
    return kind[method][1](factors, _values(rows), params)


def _truncated(
    graph: PoseGraph, rows: Float[np.ndarray, "poses dims"], fixed: Int[np.ndarray, " fixed"] | None
) -> tuple[Float[np.ndarray, "poses dims"], Float[np.ndarray, " edges"]]:
    """Solution and weights of truncated squares; odometry and anchors keep their weight."""
    factors, used = _factors(graph, rows, fixed, huber=False)
    n_anchors = factors.size() - len(used)
    trusted = [*range(n_anchors), *(n_anchors + np.flatnonzero(graph.odometry[used])).tolist()]
    params = gtsam.GncLMParams()
    params.setLossType(gtsam.GncLossType.TLS)
    params.setKnownInliers(trusted)
    optimiser = gtsam.GncLMOptimizer(factors, _values(rows), params)
    optimiser.setInlierCostThresholdsAtProbability(GNC_CONFIDENCE)
    found = _rows(optimiser.optimize(), graph.freedom)
    weight = np.ones(len(graph.tail))
    weight[used] = np.clip(optimiser.getWeights()[n_anchors:], 0.0, 1.0)
    return found, weight


def _huber_weights(graph: PoseGraph, rows: Float[np.ndarray, "poses dims"]) -> Float[np.ndarray, " edges"]:
    """What Huber's loss left of each measurement's information: min(1, knee / distance in sigmas)."""
    distance = np.sqrt(chi_squares(graph, rows))
    weight = HUBER_KNEE / np.maximum(distance, HUBER_KNEE)
    return np.where(graph.odometry, 1.0, weight)


def _factors(
    graph: PoseGraph,
    rows: Float[np.ndarray, "poses dims"],
    fixed: Int[np.ndarray, " fixed"] | None,
    *,
    huber: bool,
) -> tuple[gtsam.NonlinearFactorGraph, Int[np.ndarray, " used"]]:
    """Anchors, then one factor for each measurement that counts, and which those are. Keys are rows."""
    factors, order = gtsam.NonlinearFactorGraph(), _ORDER[graph.freedom]
    prior, between = (
        (gtsam.PriorFactorPose2, gtsam.BetweenFactorPose2)
        if graph.freedom == 3
        else (gtsam.PriorFactorPose3, gtsam.BetweenFactorPose3)
    )
    anchors = held(graph, fixed)
    rigid = gtsam.noiseModel.Isotropic.Sigma(graph.freedom, ANCHOR_SIGMA)
    for row, pose in zip(anchors.tolist(), _gtsam_poses(rows[anchors]), strict=True):
        factors.add(prior(row, pose, rigid))
    used = np.flatnonzero(graph.weight > 0.0)
    information = (graph.weight[used, None, None] * graph.information[used])[:, order][:, :, order]
    noise = _noise_models(information, huber & ~graph.odometry[used])
    ends = zip(graph.tail[used].tolist(), graph.head[used].tolist(), strict=True)
    for (i, j), z, model in zip(ends, _gtsam_poses(graph.z[used]), noise, strict=True):
        factors.add(between(i, j, z, model))
    return factors, used


def _noise_models(
    information: Float[np.ndarray, "used freedom freedom"], huber: np.ndarray
) -> list[gtsam.noiseModel.Base]:
    """One model for each matrix; equal ones share it."""
    loss = gtsam.noiseModel.mEstimator.Huber.Create(HUBER_KNEE)
    models: dict[tuple[bytes, bool], gtsam.noiseModel.Base] = {}
    out = []
    for matrix, robust in zip(information, huber.tolist(), strict=True):
        key = (matrix.tobytes(), robust)
        if key not in models:
            plain = gtsam.noiseModel.Gaussian.Information(matrix)
            models[key] = gtsam.noiseModel.Robust.Create(loss, plain) if robust else plain
        out.append(models[key])
    return out


def _gtsam_poses(rows: Float[np.ndarray, "n dims"]) -> list[Any]:
    if rows.shape[1] == 3:
        return [gtsam.Pose2(*row) for row in rows.tolist()]
    quaternions = rows[:, [6, 3, 4, 5]].tolist()
    return [gtsam.Pose3(gtsam.Rot3.Quaternion(*q), p) for q, p in zip(quaternions, rows[:, :3], strict=True)]


def _values(rows: Float[np.ndarray, "poses dims"]) -> gtsam.Values:
    values = gtsam.Values()
    for key, pose in enumerate(_gtsam_poses(rows)):
        values.insert(key, pose)
    return values


def _rows(values: gtsam.Values, freedom: int) -> Float[np.ndarray, "poses dims"]:
    """Pose rows of values whose keys are rows."""
    if freedom == 3:
        return normalised(gtsam.utilities.extractPose2(values))
    table = gtsam.utilities.extractPose3(values)
    R, t_m = table[:, :9].reshape(-1, 3, 3), table[:, 9:]
    return np.concatenate([t_m, se3.quaternion(R)], axis=-1)
