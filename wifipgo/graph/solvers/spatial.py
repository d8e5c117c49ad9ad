"""Maximum-likelihood poses of a graph with any keys, in the plane or in space, by one computer.

A graph may be in several parts: the first pose of each stays where it is, since no
measurement says where a part is, and so no system is indeterminate.
"""

from collections.abc import Mapping
from functools import partial
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from wifipgo.arithmetic import harmless_underflow
from wifipgo.errors import NumericalError, pick, require
from wifipgo.graph.losses import LOSSES, huber_weight, truncation_chi2
from wifipgo.graph.posegraph import PoseGraph, normalised
from wifipgo.graph.residuals import chi_squares
from wifipgo.graph.solvers._elimination import (
    MAX_ITERATIONS,
    QR,
    at_bottom,
    marginals,
    named,
    parameters,
    searched,
)
from wifipgo.graph.solvers._graduated import truncated_squares
from wifipgo.graph.solvers._keyed_factors import ORDER, factors_of, name_of, rows_of, values_of
from wifipgo.graph.solvers.report import Downweighted, Report
from wifipgo.graph.solvers.starts import STARTS, misfit, same
from wifipgo.threads import one_thread

METHODS: Mapping[str, str] = MappingProxyType({"lm": "Levenberg-Marquardt", "gn": "Gauss-Newton"})
INITIAL: Mapping[str, str] = MappingProxyType(
    {name: start.meaning for name, start in STARTS.items()}
    | {
        "near": "the poses as they are, as near to the optimum as the last one is: nothing else is tried",
        "best": "the lowest of the optima from the given poses and from chordal ones; from odometry too if "
        "these two differ; of a team under gnc, from frames, and from the given poses if they fit better",
    }
)
TOLERANCE = 1e-10  # on the relative and absolute fall of the error
FULL_WEIGHT = 1.0 - 1e-6  # what has less was weighed down


class _Task(NamedTuple):
    """What to minimise, and how."""

    graph: PoseGraph
    fixed: Int[np.ndarray, " fixed"] | None
    method: str
    robust: str
    max_iterations: int


class _Optimum(NamedTuple):
    """Where a search ended: poses, what the loss left of each measurement, and the cost that it minimises."""

    rows: Float[np.ndarray, "poses dims"]
    weight: Float[np.ndarray, " edges"]
    cost: float
    report: Report


@one_thread
@harmless_underflow
def solve_graph(
    graph: PoseGraph,
    start: Float[np.ndarray, "poses dims"] | None = None,
    *,
    fixed: Int[np.ndarray, " fixed"] | None = None,
    method: str = "lm",
    initial: str = "given",
    robust: str = "none",
    max_iterations: int = MAX_ITERATIONS,
) -> tuple[Float[np.ndarray, "poses dims"], Report]:
    """Poses that make the measurements most likely (paper Eq. 3).

    What is found from given poses or along odometry is compared with what is found from chordal ones: the
    report calls no minimum converged where that is lower.

    Args:
        graph: Poses and measurements; those of weight zero are dropped.
        start: Where the search starts, the last optimum say; the graph's own poses if left out.
        fixed: Rows of poses that are known and stay, as does the first of each part without any.
        method: One of `METHODS`.
        initial: One of `INITIAL`: what is made of the start before the search.
        robust: A name in `wifipgo.graph.losses.LOSSES`, for all measurements but odometry, which is trusted.
        max_iterations: Of a search; once more as many by QR where Cholesky's factors do not get there.

    Returns:
        Pose rows, and what the search did. Where the report says that it has not converged, the poses
        are the best of the search all the same.

    Raises:
        UnknownNameError: An option is unknown.
        NumericalError: Measurements differ so much in their information that no step can be found.
    """
    pick(METHODS, method, "method")
    pick(INITIAL, initial, "initial poses")
    pick(LOSSES, robust, "robust loss")
    require(max_iterations >= 1, "max_iterations", ">= 1", max_iterations)
    rows = graph.poses if start is None else normalised(start)
    found = _from(_Task(graph, fixed, method, robust, max_iterations), rows, initial)
    down = np.flatnonzero((found.weight < FULL_WEIGHT) & (graph.weight > 0.0))
    weighed = (Downweighted(robust, down, found.weight[down]),) if len(down) else ()
    return found.rows, found.report._replace(downweighted=weighed)


def _from(task: _Task, rows: Float[np.ndarray, "poses dims"], initial: str) -> _Optimum:
    """Optimum from one kind of start, doubted where another one leads lower."""
    if initial == "near":
        return _minimum(task, rows)
    if initial == "best":
        return _best_of_team(task, rows) if _votes_count(task) else _best(task, rows)
    found = _minimum(task, _start(task, rows, initial))
    second = "frames" if _votes_count(task) else "chordal"
    if initial == second:
        return _doubted(found, _cost(task, rows), "the given poses")
    other = _tried(task, rows, second)
    return found if other is None else _doubted(found, other.cost, f"initial={second!r}")


def _votes_count(task: _Task) -> bool:
    """Whether loops between robots may be wrong: then those that agree lead better than all together."""
    graph = task.graph
    return LOSSES[task.robust].graduated and bool((graph.between_robots & (graph.weight > 0.0)).any())


def _best_of_team(task: _Task, rows: Float[np.ndarray, "poses dims"]) -> _Optimum:
    """Optimum from aligned frames; from given poses too, and the lower, if more fits there."""
    try:
        frames = _start(task, rows, "frames")
        found = _minimum(task, frames)
    except NumericalError:
        return _best(task, rows)
    if misfit(task.graph, frames) < misfit(task.graph, rows):
        return found
    given = _tried(task, rows, "given")
    if given is None or (found.cost < given.cost and not same(found.cost, given.cost)):
        return found
    return given


def _best(task: _Task, rows: Float[np.ndarray, "poses dims"]) -> _Optimum:
    """The lowest optimum; of equals the one from the given poses."""
    found, chordal = _minimum(task, rows), _tried(task, rows, "chordal")
    candidates = [found] if chordal is None else [found, chordal]
    if chordal is None or not same(found.cost, chordal.cost) or not found.report.converged:
        candidates += [one for one in [_tried(task, rows, "odometry")] if one is not None]
    lowest = min(one.cost for one in candidates)
    alike = [one for one in candidates if same(one.cost, lowest)]
    return next((one for one in alike if one.report.converged), alike[0])


def _start(
    task: _Task, rows: Float[np.ndarray, "poses dims"], initial: str
) -> Float[np.ndarray, "poses dims"]:
    return STARTS[initial].rows(task.graph.with_poses(rows), task.fixed)


def _tried(task: _Task, rows: Float[np.ndarray, "poses dims"], initial: str) -> _Optimum | None:
    """Optimum from a second start; none where there is no such start."""
    try:
        return _minimum(task, _start(task, rows, initial))
    except (NumericalError, np.linalg.LinAlgError):
        return None


def _doubted(found: _Optimum, cost: float, where: str) -> _Optimum:
    """The same optimum, called no optimum where the cost is lower elsewhere."""
    if found.cost <= cost or same(found.cost, cost):
        return found
    doubt = f"a worse local minimum: error {0.5 * found.cost:.6g}, from {where} {0.5 * cost:.6g}"
    return found._replace(report=found.report._replace(converged=False, doubt=doubt))


def _minimum(task: _Task, rows: Float[np.ndarray, "poses dims"]) -> _Optimum:
    """One search from ``rows`` under the loss, and whether it came to an end."""
    graph, weight = task.graph, np.ones(len(task.graph.tail))
    with named("search", partial(name_of, graph)):
        if task.robust == "gnc":
            rows, weight = truncated_squares(graph, rows, task.fixed)
        rows, report = _search(task._replace(graph=graph.with_weight(graph.weight * weight)), rows)
    if task.robust == "huber":
        weight = _huber_weights(graph, rows)
    if not at_minimum(graph.with_weight(graph.weight * weight), rows, task.fixed):
        doubt = f"a further step would gain, after {report.iterations} iterations"
        report = report._replace(converged=False, doubt=doubt)
    return _Optimum(rows, weight, _cost(task, rows), report)


def _cost(task: _Task, rows: Float[np.ndarray, "poses dims"]) -> float:
    """Twice what the loss makes of all residuals."""
    with np.errstate(over="ignore", invalid="ignore"):
        chi2 = chi_squares(task.graph, rows)
        doubted = ~task.graph.odometry
        limit = truncation_chi2(task.graph.freedom)
        chi2[doubted] = LOSSES[task.robust].cost(chi2[doubted], limit)
        total = float(chi2.sum())
    return total if np.isfinite(total) else np.inf


@one_thread
@harmless_underflow
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

    Raises:
        NumericalError: Measurements differ too much in their information.
    """
    factors, _ = factors_of(graph, estimate, fixed, huber=False)
    order = np.argsort(ORDER[graph.freedom])
    wanted = list(range(len(graph.poses))) if rows is None else rows.tolist()
    with named("marginal covariances", partial(name_of, graph)):
        found = marginals(factors, values_of(estimate), wanted)
    return found.reshape(-1, graph.freedom, graph.freedom)[:, order][:, :, order]


@one_thread
@harmless_underflow
def at_minimum(
    graph: PoseGraph,
    estimate: Float[np.ndarray, "poses dims"],
    fixed: Int[np.ndarray, " fixed"] | None = None,
) -> bool:
    """Whether one more step would gain nothing: a search may also end because it cannot go on.

    Args:
        graph: Poses and measurements, under the weights that a robust loss ended with.
        estimate: Where the search ended.
        fixed: Poses that are known besides.
    """
    factors, _ = factors_of(graph, estimate, fixed, huber=False)
    return at_bottom(factors, values_of(estimate))


def _search(
    task: _Task, rows: Float[np.ndarray, "poses dims"]
) -> tuple[Float[np.ndarray, "poses dims"], Report]:
    """One search from ``rows``; again by QR where Cholesky's factors end above the bottom."""
    graph, huber = task.graph, task.robust == "huber"
    factors, used = factors_of(graph, rows, task.fixed, huber=huber)
    params = parameters(task.method, tolerance=TOLERANCE, max_iterations=task.max_iterations)
    found = searched(factors, values_of(rows), params, method=task.method)
    if not huber and params.getLinearSolverType() != QR and not at_bottom(factors, found.values):
        again = parameters(task.method, tolerance=TOLERANCE, max_iterations=task.max_iterations, solver=QR)
        more = searched(factors, found.values, again, method=task.method)
        found = more._replace(before=found.before, iterations=found.iterations + more.iterations)
    chi2 = (2.0 * found.before, 2.0 * found.after)
    counts = (len(used), len(graph.tail) - len(used))
    return rows_of(found.values, graph.freedom), Report(found.iterations, *chi2, *counts)


def _huber_weights(graph: PoseGraph, rows: Float[np.ndarray, "poses dims"]) -> Float[np.ndarray, " edges"]:
    """What Huber's loss left of each measurement's information: min(1, knee / distance in sigmas)."""
    return np.where(graph.odometry, 1.0, huber_weight(np.sqrt(chi_squares(graph, rows))))
