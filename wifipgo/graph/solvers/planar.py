"""Maximum-likelihood poses in the plane (paper Eq. 3) by Levenberg-Marquardt."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import NamedTuple

import gtsam
import numpy as np
from jaxtyping import Bool, Float, Int

from wifipgo.errors import pick, require
from wifipgo.graph.bearings import Bearings, bearing_residuals, select_bearings
from wifipgo.graph.posegraph import Edges, select
from wifipgo.graph.solvers._factors import add_anchors, add_bearings, add_between, add_told
from wifipgo.graph.solvers._losses import BEARING_C, LOSSES, geman_mcclure_weight, huber_weight
from wifipgo.graph.solvers._search import Found, as_values, optimise, truncate
from wifipgo.graph.solvers.report import Report, WeighedDown

# What an edge to a robot outside the solve does: whether it holds its tail to the pose that was told.
THIRD_PARTY: Mapping[str, bool] = MappingProxyType({"fixed_told": True, "ignore": False})
ANCHOR_SIGMA = 1e-5  # of first poses, m and rad: far below any sensor, and 1 / sigma^2 still well conditioned
KNOWN_START = (ANCHOR_SIGMA, ANCHOR_SIGMA)
UNKNOWN_START = (
    100.0,
    10.0,
)  # m, rad: pulls next to nothing, and nothing floats
TOLD_SIGMA = (0.6, 0.2)  # m, rad: least error over random walks of 4 and 10 robots, of 0.001 to 1.5 m
LEAST_WEIGHT = 1e-8  # of what GNC lets go: nothing, and no pose floats


def solve(
    poses: Float[np.ndarray, "robots times 3"],
    edges: Edges,
    *,
    robots: Sequence[int],
    third_party: str = "fixed_told",
    told_sigma: Float[np.ndarray, "#edges 2"] | tuple[float, float] = TOLD_SIGMA,
    loss: str = "none",
    bearings: Bearings | None = None,
    start_sigma: Float[np.ndarray, "#robots 2"] | tuple[float, float] = KNOWN_START,
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
        loss: Of every relative pose but odometry: a name in `LOSSES`.
        bearings: Directions in which robots heard each other, used where both ends take part, with
            Geman-McClure's loss. They enter after a first solve without them, and start from there:
            a loss that lets go of what does not fit must not choose what it fits. Two robots
            of which one has most of its bearings of the other let go then do without (ours).
        start_sigma: How well first poses are known, (m, rad), for all robots or one row each.

    Returns:
        New poses, those of other robots unchanged, and the report.

    Raises:
        ValueError: ``robots`` names one twice or nobody, an option is unknown, or a
            pose other than a first has no measurement.
    """
    pick(LOSSES, loss, "loss")
    problem = _posed(
        poses,
        edges,
        robots=robots,
        third_party=third_party,
        told_sigma=told_sigma,
        start_sigma=start_sigma,
    )
    found = _truncated(problem, edges) if loss == "gnc" else _plain(problem, edges, huber=loss == "huber")
    down = _let_go(loss, problem, found)
    solved = _put_back(poses, found.values, problem)
    if bearings is not None:
        solved, found, heard_down = _with_bearings(solved, found, bearings, problem)
        down += heard_down
    used = len(problem.rows)
    chi2 = 2.0 * found.before, 2.0 * found.after
    return solved, Report(found.iterations, *chi2, used, len(edges) - used, down)


def solve_team(
    poses: Float[np.ndarray, "robots times 3"], edges: Edges
) -> tuple[Float[np.ndarray, "robots times 3"], Report]:
    """Solve for all robots at once: what a central computer that hears everything would do."""
    return solve(poses, edges, robots=range(len(poses)))


class _Problem(NamedTuple):
    """Who takes part, with which of the measurements."""

    team: list[int]
    first_key: Int[np.ndarray, " robots"]
    start: Float[np.ndarray, "poses 3"]
    start_sigma: Float[np.ndarray, "team 2"]
    inner: Int[np.ndarray, " inner"]
    outer: Int[np.ndarray, " outer"]
    told_sigma: Float[np.ndarray, "outer 2"]
    doubted: Bool[np.ndarray, " rows"]

    @property
    def rows(self) -> Int[np.ndarray, " rows"]:
        """Edges in the order of their factors, which come after those that hold the first poses."""
        return np.concatenate([self.inner, self.outer])


def _posed(
    poses: Float[np.ndarray, "robots times 3"],
    edges: Edges,
    *,
    robots: Sequence[int],
    third_party: str,
    told_sigma: Float[np.ndarray, "#edges 2"] | tuple[float, float],
    start_sigma: Float[np.ndarray, "#robots 2"] | tuple[float, float],
) -> _Problem:
    """Check who takes part and sort out what they use."""
    team = sorted(robots)
    require(len(set(team)) == len(team) > 0, "robots", "one or more, each once", robots)
    first_key = np.full(len(poses), -1)
    first_key[team] = np.arange(len(team)) * poses.shape[1]
    inner, outer = _split(edges, first_key, told=pick(THIRD_PARTY, third_party, "third-party option"))
    told = np.broadcast_to(np.asarray(told_sigma, dtype=np.float64), (len(edges), 2))
    known = np.broadcast_to(np.asarray(start_sigma, dtype=np.float64), (len(poses), 2))
    doubted = ~odometry(edges)[np.concatenate([inner, outer])]
    start = poses[team].reshape(-1, 3)
    return _Problem(team, first_key, start, known[team], inner, outer, told[outer], doubted)


def odometry(edges: Edges) -> Bool[np.ndarray, " edges"]:
    """Which measurements are of a robot's next pose: trusted by every outlier method."""
    return ~edges.between_robots & (edges.head[:, 1] == edges.tail[:, 1] + 1)


def _split(
    edges: Edges, first_key: Int[np.ndarray, " robots"], *, told: bool
) -> tuple[Int[np.ndarray, " inner"], Int[np.ndarray, " outer"]]:
    """Rows between participants, and rows to outsiders (none unless ``told``), sorted by tail, head and z."""
    ours = np.flatnonzero((first_key[edges.tail[:, 0]] >= 0) & (edges.weight > 0.0))
    columns = (*edges.tail[ours].T, *edges.head[ours].T, *edges.z[ours].T)
    ours = ours[np.lexsort(columns[::-1])]  # gtsam repeats itself to the bit only for one order of edges
    inside = first_key[edges.head[ours, 0]] >= 0
    return ours[inside], ours[~inside & told]


def _heard(bearings: Bearings | None, first_key: Int[np.ndarray, " robots"]) -> Int[np.ndarray, " heard"]:
    """Rows of the bearings between participants, sorted."""
    if bearings is None:
        return np.zeros(0, dtype=np.int64)
    inside = (first_key[bearings.observer[:, 0]] >= 0) & (first_key[bearings.target[:, 0]] >= 0)
    ours = np.flatnonzero(inside)
    columns = (*bearings.observer[ours].T, *bearings.target[ours].T, bearings.azimuth_rad[ours, 0])
    return ours[np.lexsort(columns[::-1])]


def _graph(problem: _Problem, edges: Edges, *, huber: bool) -> gtsam.NonlinearFactorGraph:
    """What the participants know of each other's relative poses."""
    graph, key = gtsam.NonlinearFactorGraph(), problem.first_key
    add_anchors(graph, problem.start, problem.start_sigma)
    add_between(graph, select(edges, problem.inner), key, problem.doubted[: len(problem.inner)] & huber)
    add_told(graph, select(edges, problem.outer), problem.told_sigma, key, doubted=huber)
    n_loose = len(problem.start) - len(graph.keyVector())
    require(n_loose == 0, "poses without any measurement", "none", n_loose)
    return graph


def _plain(problem: _Problem, edges: Edges, *, huber: bool) -> Found:
    """One search with squares, or with Huber's loss on what is doubted."""
    return optimise(_graph(problem, edges, huber=huber), as_values(problem.start))


def _truncated(problem: _Problem, edges: Edges) -> Found:
    """Weights by GNC, then a search under these weights."""
    graph, n_anchors = _graph(problem, edges, huber=False), len(problem.team)
    trusted = np.append(np.arange(n_anchors), n_anchors + np.flatnonzero(~problem.doubted))
    values, weights = truncate(graph, as_values(problem.start), trusted=trusted.tolist())
    weight = edges.weight.copy()
    weight[problem.rows] *= np.maximum(weights[n_anchors:], LEAST_WEIGHT)
    found = optimise(_graph(problem, replace(edges, weight=weight), huber=False), values)
    return found._replace(weight=weights[n_anchors:])


def _put_back(
    poses: Float[np.ndarray, "robots times 3"], values: gtsam.Values, problem: _Problem
) -> Float[np.ndarray, "robots times 3"]:
    """All robots' poses with those found; a known first pose stays to the bit."""
    found = gtsam.utilities.extractPose2(values).reshape(len(problem.team), poses.shape[1], 3)
    known = (problem.start_sigma <= ANCHOR_SIGMA).all(axis=1)
    found[known, 0] = poses[problem.team, 0][known]
    solved = poses.copy()
    solved[problem.team] = found
    return solved


def _let_go(loss: str, problem: _Problem, found: Found) -> tuple[WeighedDown, ...]:
    """Edges that the loss weighs less than squares would."""
    if loss == "none":
        return ()
    weight = found.weight
    if weight is None:
        doubted = (np.flatnonzero(problem.doubted) + len(problem.team)).tolist()
        weight = np.ones(len(problem.rows))
        loss_of = [found.graph.at(k).error(found.values) for k in doubted]
        weight[problem.doubted] = huber_weight(np.array(loss_of))
    low = weight < 1.0
    return (WeighedDown(loss, problem.rows[low], weight[low]),) if low.any() else ()


def _with_bearings(
    poses: Float[np.ndarray, "robots times 3"], first: Found, bearings: Bearings, problem: _Problem
) -> tuple[Float[np.ndarray, "robots times 3"], Found, tuple[WeighedDown, ...]]:
    """Add bearings to a first solution, and search on from there; again without pairs that disown theirs."""
    heard = _heard(bearings, problem.first_key)
    kept, solved, found = heard, poses, first
    while len(kept):
        graph = gtsam.NonlinearFactorGraph()
        graph.push_back(first.graph)
        add_bearings(graph, select_bearings(bearings, kept), problem.first_key)
        found = optimise(graph, first.values)
        solved = _put_back(poses, found.values, problem)
        disowned = _disowned(solved, select_bearings(bearings, kept))
        if not disowned.any():
            break
        kept, solved, found = kept[~disowned], poses, first
    off = bearing_residuals(solved, bearings)[heard] / bearings.sigma_rad[heard]
    weight = np.where(np.isin(heard, kept), geman_mcclure_weight(off), 0.0)
    low = (np.abs(off) > BEARING_C) | (weight == 0.0)
    return solved, found, (WeighedDown("bearing", heard[low], weight[low]),) if low.any() else ()


def _disowned(
    solved: Float[np.ndarray, "robots times 3"], bearings: Bearings
) -> Bool[np.ndarray, " bearings"]:
    """Bearings between robots of which one has most of its bearings of the other let go.

    No loss can tell which half is right once most are wrong, and what blocks or bends the direct path
    does so both ways: the few that fit on one side, or all on the other, then fit by chance.
    """
    fits = np.abs(bearing_residuals(solved, bearings)) <= BEARING_C * bearings.sigma_rad
    ways, way = np.unique(
        np.stack([bearings.observer[:, 0], bearings.target[:, 0]]), axis=1, return_inverse=True
    )
    most_fit = 2.0 * np.bincount(way, fits) >= np.bincount(way)
    bad = {frozenset(pair) for pair in ways[:, ~most_fit].T.tolist()}
    of_bad = np.array([frozenset(pair) in bad for pair in ways.T.tolist()], dtype=bool)
    return of_bad[way]
