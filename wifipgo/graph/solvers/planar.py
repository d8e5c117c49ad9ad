"""Most likely poses in the plane (paper Eq. 3): squares by Gauss-Newton, losses by Levenberg-Marquardt."""

from collections.abc import Sequence
from functools import partial

import gtsam
import numpy as np
from jaxtyping import Bool, Float, Int

from wifipgo.arithmetic import harmless_underflow
from wifipgo.errors import pick, require
from wifipgo.graph.bearings import NEAREST_M, Bearings, bearing_residuals, select_bearings
from wifipgo.graph.edges import Edges
from wifipgo.graph.losses import BEARING_C, LOSSES, geman_mcclure_weight
from wifipgo.graph.solvers._banded_descent import BandedOptimum
from wifipgo.graph.solvers._elimination import MAX_ITERATIONS, named
from wifipgo.graph.solvers._factors import add_bearings, keys
from wifipgo.graph.solvers._gtsam_search import SearchOptimum, as_values, optimise
from wifipgo.graph.solvers._losses import weight_at_huber_loss
from wifipgo.graph.solvers._problem import (
    ANCHOR_SIGMA,
    KNOWN_START,
    REPORTED_SIGMA,
    Problem,
    build,
    name_of,
    posed,
)
from wifipgo.graph.solvers._searches import INITIAL, Optimum, lowest
from wifipgo.graph.solvers.marginals import last_rows
from wifipgo.graph.solvers.report import Downweighted, Report
from wifipgo.threads import one_thread


@one_thread
@harmless_underflow
def solve(
    poses: Float[np.ndarray, "robots times 3"],
    edges: Edges,
    *,
    robots: Sequence[int],
    third_party: str = "fixed_told",
    told_sigma: Float[np.ndarray, "#edges 2"] | tuple[float, float] = REPORTED_SIGMA,
    loss: str = "none",
    bearings: Bearings | None = None,
    start_sigma: Float[np.ndarray, "#robots 2"] | tuple[float, float] = KNOWN_START,
    covariances: bool = False,
    initial: str = "given",
    max_iterations: int = MAX_ITERATIONS,
    fixed: Int[np.ndarray, "fixed 2"] | None = None,
) -> tuple[Float[np.ndarray, "robots times 3"], Report]:
    """Poses of some robots that make their shared measurements most likely (paper Eq. 3).

    Used is what these robots measured, information times weight. First poses are known
    and stay, as do ``fixed`` ones; the others start from ``poses``. What another robot measured of these
    is not theirs to know, so it is dropped, as are edges of weight zero (up to 1e-30).

    Args:
        poses: Current estimates, world frame: where the search starts.
        edges: All measurements; their order does not matter.
        robots: Who takes part: one robot, a pair, or the team.
        third_party: What an edge to a robot outside does. ``fixed_told``: it ties its
            tail to the pose that the outsider told. ``ignore``: nothing.
        told_sigma: Uncertainty of told poses, (m, rad), for all edges or one row each.
        loss: Of every relative pose but odometry: a name in `wifipgo.graph.losses.LOSSES`.
        bearings: Directions in which robots heard each other, used where both ends take part, with
            Geman-McClure's loss. They enter after a first solve without them, and start from there:
            a loss that lets go of what does not fit must not choose what it fits. Two robots
            of which one has most of its bearings of the other let go then do without (ours).
        start_sigma: How well first poses are known, (m, rad), for all robots or one row each.
        covariances: Whether the report has those of the last poses; see
            `wifipgo.graph.last_pose_covariances`. It has none, and calls nothing converged, where they are
            beyond working precision.
        initial: Where the search starts, one of `INITIAL`. Of all but "near" a second start is tried too, at
            about twice the time: the report calls no minimum converged where that leads lower.
        max_iterations: Of Levenberg-Marquardt; once more as many by QR where that is not enough.
        fixed: Poses that are known besides, as (robot, index).

    Returns:
        New poses, those of other robots unchanged, and the report.

    Raises:
        NumericalError: No step can be found; says at which pose and measurement.
        ValueError: ``robots`` names one twice or nobody, an option is unknown, a pose
            is not finite, or one other than a first has no measurement.
    """
    pick(LOSSES, loss, "loss")
    pick(INITIAL, initial, "initial poses")
    require(max_iterations >= 1, "max_iterations", ">= 1", max_iterations)
    problem = posed(
        poses,
        edges,
        groups=[robots],
        third_party=third_party,
        told_sigma=told_sigma,
        start_sigma=start_sigma,
        fixed=fixed,
    )
    with named("solve", partial(name_of, problem, edges)):
        found, worse = lowest(problem, edges, initial=initial, loss=loss, max_iterations=max_iterations)
    down = _let_go(loss, problem, found)
    solved = _put_back(poses, found.poses, problem)
    if bearings is not None:
        with named("solve with bearings", partial(name_of, problem, edges)):
            solved, found, heard_down = _with_bearings(solved, found, bearings, problem, edges)
        down += heard_down
    ends, unknown = _ends(found, last_rows(problem, robots)) if covariances else (None, "")
    doubt = unknown or ("" if found.settled else f"cut after {found.iterations} iterations") or worse
    used, chi2 = len(problem.rows), (2.0 * found.before, 2.0 * found.after)
    counts = (used, len(edges) - used)
    return solved, Report(found.iterations, *chi2, *counts, down, ends, not doubt, doubt)


def _ends(found: Optimum, rows: Int[np.ndarray, " team"]) -> tuple[Float[np.ndarray, "team 3 3"] | None, str]:
    """Covariances of last poses, or why there are none."""
    try:
        return found.covariances(rows), ""
    except RuntimeError:
        return None, "covariances are beyond working precision"


def solve_team(
    poses: Float[np.ndarray, "robots times 3"], edges: Edges
) -> tuple[Float[np.ndarray, "robots times 3"], Report]:
    """Solve for all robots at once: what a central computer that hears everything would do."""
    return solve(poses, edges, robots=range(len(poses)))


def _heard(bearings: Bearings | None, first_key: Int[np.ndarray, " robots"]) -> Int[np.ndarray, " heard"]:
    """Rows of the bearings between participants, sorted."""
    if bearings is None:
        return np.zeros(0, dtype=np.int64)
    inside = (first_key[bearings.observer[:, 0]] >= 0) & (first_key[bearings.target[:, 0]] >= 0)
    ours = np.flatnonzero(inside)
    columns = (*bearings.observer[ours].T, *bearings.target[ours].T, bearings.azimuth_rad[ours, 0])
    return ours[np.lexsort(columns[::-1])]


def put_back(
    poses: Float[np.ndarray, "robots times 3"], found: Float[np.ndarray, "poses 3"], problem: Problem
) -> Float[np.ndarray, "team times 3"]:
    """Poses found of those who take part; known ones stay to the bit."""
    found = found.reshape(len(problem.team), poses.shape[1], 3)
    known = problem.known[(problem.known_sigma <= ANCHOR_SIGMA).all(axis=1)]
    found.reshape(-1, 3)[known] = poses[problem.team].reshape(-1, 3)[known]
    return found


def _put_back(
    poses: Float[np.ndarray, "robots times 3"], found: Float[np.ndarray, "poses 3"], problem: Problem
) -> Float[np.ndarray, "robots times 3"]:
    """All robots' poses with those found."""
    solved = poses.copy()
    solved[problem.team] = put_back(poses, found, problem)
    return solved


def _let_go(loss: str, problem: Problem, found: Optimum) -> tuple[Downweighted, ...]:
    """Edges that the loss weighs less than squares would."""
    if isinstance(found, BandedOptimum) or loss == "none":
        return ()
    weight = found.weight
    if weight is None:
        doubted = (np.flatnonzero(problem.doubted) + len(problem.known)).tolist()
        weight = np.ones(len(problem.rows))
        loss_of = [found.graph.at(k).error(found.values) for k in doubted]
        weight[problem.doubted] = weight_at_huber_loss(np.array(loss_of))
    low = weight < 1.0
    return (Downweighted(loss, problem.rows[low], weight[low]),) if low.any() else ()


def _with_bearings(
    poses: Float[np.ndarray, "robots times 3"],
    first: Optimum,
    bearings: Bearings,
    problem: Problem,
    edges: Edges,
) -> tuple[Float[np.ndarray, "robots times 3"], Optimum, tuple[Downweighted, ...]]:
    """Add bearings to a first solution, and search on from there; again without pairs that disown theirs."""
    heard = _heard(bearings, problem.first_key)
    kept, solved, found = heard, poses, first
    deaf = build(problem, edges, huber=False) if isinstance(first, BandedOptimum) else first.graph
    values = as_values(first.poses) if isinstance(first, BandedOptimum) else first.values
    while len(kept):
        found = _heard_too(deaf, values, select_bearings(bearings, kept), problem)
        solved = _put_back(poses, found.poses, problem)
        disowned = _disowned(solved, select_bearings(bearings, kept))
        if not disowned.any():
            break
        kept, solved, found = kept[~disowned], poses, first
    off = bearing_residuals(solved, bearings)[heard] / bearings.sigma_rad[heard]
    weight = np.where(np.isin(heard, kept), geman_mcclure_weight(off), 0.0)
    low = (np.abs(off) > BEARING_C) | (weight == 0.0)
    return solved, found, (Downweighted("bearing", heard[low], weight[low]),) if low.any() else ()


def _heard_too(
    deaf: gtsam.NonlinearFactorGraph, values: gtsam.Values, bearings: Bearings, problem: Problem
) -> SearchOptimum:
    """Search with bearings; with a bounded slope where two that heard each other came to be on one place."""

    def search(*, near: bool) -> SearchOptimum:
        graph = gtsam.NonlinearFactorGraph()
        graph.push_back(deaf)
        add_bearings(graph, bearings, problem.first_key, near=near)
        return optimise(graph, values)

    try:
        found = search(near=False)
    except RuntimeError:
        return search(near=True)
    return search(near=True) if _on_one_place(found, bearings, problem) else found


def _on_one_place(found: SearchOptimum, bearings: Bearings, problem: Problem) -> bool:
    """Whether an observer and its target are nearer than a bearing is good for."""
    p_m = found.poses[:, :2]
    observer, target = (
        np.array(keys(ends, problem.first_key)) for ends in (bearings.observer, bearings.target)
    )
    return bool((np.hypot(*(p_m[observer] - p_m[target]).T) < NEAREST_M).any())


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
