"""Maximum-likelihood poses in the plane (paper Eq. 3) by Levenberg-Marquardt."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

import gtsam
import numpy as np
from jaxtyping import Float, Int

from wifipgo import se2
from wifipgo.errors import pick, require
from wifipgo.graph.posegraph import Edges, select

# What an edge to a robot outside the solve does: whether it holds its tail to the pose that was told.
THIRD_PARTY: Mapping[str, bool] = MappingProxyType({"fixed_told": True, "ignore": False})
ANCHOR_SIGMA = 1e-5  # of first poses, m and rad: far below any sensor, and 1 / sigma^2 still well conditioned
TOLD_SIGMA = (0.6, 0.2)  # m, rad: least error over random walks of 4 and 10 robots, of 0.001 to 1.5 m
TOLERANCE = 1e-8  # on the relative and absolute fall of the error: poses within about 0.1 mm of the optimum


class Report(NamedTuple):
    """What a solve did. A chi-square is the sum of squared residuals over sigma (twice gtsam's error)."""

    iterations: int
    chi2_before: float
    chi2_after: float
    n_used: int
    n_dropped: int


def solve(
    poses: Float[np.ndarray, "robots times 3"],
    edges: Edges,
    *,
    robots: Sequence[int],
    third_party: str = "fixed_told",
    told_sigma: Float[np.ndarray, "#edges 2"] | tuple[float, float] = TOLD_SIGMA,
) -> tuple[Float[np.ndarray, "robots times 3"], Report]:
    """Poses of some robots that make their shared measurements most likely (paper Eq. 3).

    Used is what these robots measured, information times weight. First poses are known
    and stay; the others start from ``poses``. What another robot measured of these
    is not theirs to know, so it is dropped, as are edges of weight zero.

    Args:
        poses: Current estimates, world frame: where the search starts.
        edges: All measurements; their order does not matter.
        robots: Who takes part: one robot, a pair, or the team.
        third_party: What an edge to a robot outside does. ``fixed_told``: it ties its
            tail to the pose that the outsider told. ``ignore``: nothing.
        told_sigma: Uncertainty of told poses, (m, rad), for all edges or one row each.

    Returns:
        New poses, those of other robots unchanged, and the report.

    Raises:
        ValueError: ``robots`` names one twice or nobody, an option is unknown, or a
            pose other than a first has no measurement.
    """
    team = sorted(robots)
    require(len(set(team)) == len(team) > 0, "robots", "one or more, each once", robots)
    times = poses.shape[1]
    first_key = np.full(len(poses), -1)
    first_key[team] = np.arange(len(team)) * times
    inner, outer = _split(edges, first_key, told=pick(THIRD_PARTY, third_party, "third-party option"))

    start = poses[team].reshape(-1, 3)
    graph = gtsam.NonlinearFactorGraph()
    _add_anchors(graph, start, times)
    _add_between(graph, select(edges, inner), first_key)
    sigmas = np.broadcast_to(np.asarray(told_sigma, dtype=np.float64), (len(edges), 2))
    _add_told(graph, select(edges, outer), sigmas[outer], first_key)

    n_loose = len(start) - len(graph.keyVector())
    require(n_loose == 0, "poses without any measurement", "none", n_loose)
    solution, iterations, before, after = _optimise(graph, start)
    solved = poses.copy()
    solved[team, 1:] = solution.reshape(len(team), times, 3)[:, 1:]
    used = len(inner) + len(outer)
    return solved, Report(iterations, 2.0 * before, 2.0 * after, used, len(edges) - used)


def solve_team(
    poses: Float[np.ndarray, "robots times 3"], edges: Edges
) -> tuple[Float[np.ndarray, "robots times 3"], Report]:
    """Solve for all robots at once: what a central computer that hears everything would do."""
    return solve(poses, edges, robots=range(len(poses)))


def _split(
    edges: Edges, first_key: Int[np.ndarray, " robots"], *, told: bool
) -> tuple[Int[np.ndarray, " inner"], Int[np.ndarray, " outer"]]:
    """Rows between participants, and rows to outsiders (none unless ``told``), sorted by tail, head and z."""
    ours = np.flatnonzero((first_key[edges.tail[:, 0]] >= 0) & (edges.weight > 0.0))
    columns = (*edges.tail[ours].T, *edges.head[ours].T, *edges.z[ours].T)
    ours = ours[np.lexsort(columns[::-1])]  # gtsam repeats itself to the bit only for one order of edges
    inside = first_key[edges.head[ours, 0]] >= 0
    return ours[inside], ours[~inside & told]


def _add_anchors(graph: gtsam.NonlinearFactorGraph, start: Float[np.ndarray, "poses 3"], times: int) -> None:
    """Hold the first pose of each robot where it is."""
    noise = gtsam.noiseModel.Isotropic.Sigma(3, ANCHOR_SIGMA)
    for key in range(0, len(start), times):
        graph.addPriorPose2(key, gtsam.Pose2(*start[key].tolist()), noise)


def _add_between(
    graph: gtsam.NonlinearFactorGraph, edges: Edges, first_key: Int[np.ndarray, " robots"]
) -> None:
    """Add measurements among participants; equal noise shares one model."""
    tail = first_key[edges.tail[:, 0]] + edges.tail[:, 1]
    head = first_key[edges.head[:, 0]] + edges.head[:, 1]
    sigma = edges.sigma / np.sqrt(edges.weight)[:, None]
    models: dict[tuple[float, float], gtsam.noiseModel.Diagonal] = {}
    for i, j, z, s in zip(
        tail.tolist(), head.tolist(), edges.z.tolist(), map(tuple, sigma.tolist()), strict=True
    ):
        if s not in models:
            models[s] = gtsam.noiseModel.Diagonal.Sigmas(np.array([s[0], s[0], s[1]]))
        graph.add(gtsam.BetweenFactorPose2(i, j, gtsam.Pose2(*z), models[s]))


def _add_told(
    graph: gtsam.NonlinearFactorGraph,
    edges: Edges,
    told_sigma: Float[np.ndarray, "edges 2"],
    first_key: Int[np.ndarray, " robots"],
) -> None:
    """Tie tails to what outsiders told: T_world_tail = T_world_head T_tail_head^-1.

    Noise of z and of the told pose both sit at the head. Seen from the tail, a turn
    there is a turn here and a shift along (y, -x) of z, which is exact to first order
    and needs no further variable.
    """
    tail = first_key[edges.tail[:, 0]] + edges.tail[:, 1]
    T_world_tail = se2.compose(edges.told, se2.inverse(edges.z))
    variance = edges.sigma**2 / edges.weight[:, None] + told_sigma**2
    lever = np.stack([edges.z[:, 1], -edges.z[:, 0], np.ones(len(edges))], axis=-1)
    turn = variance[:, 1, None, None] * lever[:, :, None] * lever[:, None, :]
    covariance = turn + variance[:, 0, None, None] * np.diag([1.0, 1.0, 0.0])
    for i, pose, cov in zip(tail.tolist(), T_world_tail.tolist(), covariance, strict=True):
        graph.addPriorPose2(i, gtsam.Pose2(*pose), gtsam.noiseModel.Gaussian.Covariance(cov))


def _optimise(
    graph: gtsam.NonlinearFactorGraph, start: Float[np.ndarray, "poses 3"]
) -> tuple[Float[np.ndarray, "poses 3"], int, float, float]:
    """Run Levenberg-Marquardt; keys are rows of ``start``. Errors are gtsam's, half a chi-square."""
    values = gtsam.Values()
    for key, pose in enumerate(start.tolist()):
        values.insert(key, gtsam.Pose2(*pose))
    params = gtsam.LevenbergMarquardtParams()
    params.setRelativeErrorTol(TOLERANCE)
    params.setAbsoluteErrorTol(TOLERANCE)
    optimiser = gtsam.LevenbergMarquardtOptimizer(graph, values, params)
    before = optimiser.error()
    solution = gtsam.utilities.extractPose2(optimiser.optimize())
    return solution, optimiser.iterations(), before, optimiser.error()
