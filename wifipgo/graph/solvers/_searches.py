"""Searches of a team's problem in the plane: under a loss, and from one start or more."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from wifipgo.errors import NumericalError
from wifipgo.graph.edges import Edges
from wifipgo.graph.losses import LOSSES, truncation_chi2
from wifipgo.graph.solvers._banded_descent import BandedOptimum, banded_optimum
from wifipgo.graph.solvers._graduated import few_steps, graduated
from wifipgo.graph.solvers._gtsam_search import SearchOptimum, as_values, least_squares, optimise, poses_of
from wifipgo.graph.solvers._problem import Problem, build
from wifipgo.graph.solvers.keyed_problem import started
from wifipgo.graph.solvers.starts import STARTS, same

Optimum = SearchOptimum | BandedOptimum
Poses = Float[np.ndarray, "poses 3"]

INITIAL: Mapping[str, str] = MappingProxyType(
    {name: start.meaning for name, start in STARTS.items()}
    | {
        "near": "the poses as they are, as near to the optimum as the last one is: nothing else is tried",
        "best": "the lower of the optima from the given poses and from a second start",
    }
)
LEAST_WEIGHT = 1e-8  # of what GNC lets go: nothing, and no pose floats
FREEDOM = 3


class _Task(NamedTuple):
    """What to minimise, and how."""

    problem: Problem
    edges: Edges
    loss: str
    most: int


def lowest(
    problem: Problem, edges: Edges, *, initial: str, loss: str, max_iterations: int
) -> tuple[Optimum, str]:
    """Optimum from one kind of start, one of `INITIAL`, and where the cost is lower than there, if so.

    The second start is chordal; along odometry where a loss lets go of what all others would bend to.
    """
    task = _Task(problem, edges, loss, max_iterations)
    if initial == "near":
        return _searched(task), ""
    second = "odometry" if LOSSES[loss].graduated else "chordal"
    found = _searched(task if initial == "best" else _from(task, initial))
    if initial == second:
        return found, _doubt(_cost(task, found.poses), _cost(task, problem.start), "the given poses")
    other = _tried(task, second)
    if other is None:
        return found, ""
    mine, theirs = (_cost(task, one.poses) for one in (found, other))
    if initial == "best":
        return (found if mine <= theirs or same(mine, theirs) else other), ""
    return found, _doubt(mine, theirs, f"initial={second!r}")


def _doubt(mine: float, theirs: float, where: str) -> str:
    """What speaks against an optimum where the cost is lower elsewhere."""
    if mine <= theirs or same(mine, theirs):
        return ""
    return f"a worse local minimum: chi-square {mine:.6g}, from {where} {theirs:.6g}"


def _from(task: _Task, initial: str) -> _Task:
    """The same task, from another start."""
    return task if initial == "given" else task._replace(problem=started(task.problem, task.edges, initial))


def _tried(task: _Task, initial: str) -> Optimum | None:
    """Optimum from a second start; none where there is no such start."""
    try:
        return _searched(_from(task, initial))
    except (NumericalError, RuntimeError, np.linalg.LinAlgError):
        return None


def _searched(task: _Task) -> Optimum:
    """One search."""
    return _SEARCHES[task.loss](task.problem, task.edges, task.most)


def _cost(task: _Task, poses: Poses) -> float:
    """Twice what the loss makes of all residuals."""
    chi2, doubted = _chi_squares(task.problem, task.edges)(poses), task.problem.doubted
    chi2[doubted] = LOSSES[task.loss].cost(chi2[doubted], truncation_chi2(FREEDOM))
    return float(chi2.sum())


def _chi_squares(problem: Problem, edges: Edges) -> Callable[[Poses], Float[np.ndarray, " rows"]]:
    """Squared distances of all rows, as a function of the poses."""
    graph, n_known = build(problem, edges, huber=False), len(problem.known)

    def chi2(poses: Poses) -> Float[np.ndarray, " rows"]:
        values = as_values(poses)
        return 2.0 * np.array([graph.at(k).error(values) for k in range(n_known, graph.size())])

    return chi2


def _squares(problem: Problem, edges: Edges, most: int) -> Optimum:
    """Squares, without gtsam where that is faster."""
    low = banded_optimum(problem, edges)
    return low or least_squares(build(problem, edges, huber=False), as_values(problem.start), most)


def _hubers(problem: Problem, edges: Edges, most: int) -> SearchOptimum:
    """Huber's loss, by Levenberg-Marquardt."""
    return optimise(build(problem, edges, huber=True), as_values(problem.start), most)


def _truncated(problem: Problem, edges: Edges, most: int) -> SearchOptimum:
    """Weights by graduated non-convexity, then a search under these weights."""

    def weighted(weight: Float[np.ndarray, " rows"]) -> Edges:
        left = edges.weight.copy()
        left[problem.rows] *= np.maximum(weight, LEAST_WEIGHT)
        return replace(edges, weight=left)

    def solved(poses: Poses, weight: Float[np.ndarray, " rows"]) -> Poses:
        return poses_of(few_steps(build(problem, weighted(weight), huber=False), as_values(poses)))

    chi2 = _chi_squares(problem, edges)
    poses, weight = graduated(problem.start, problem.doubted, chi2=chi2, solved=solved)
    found = least_squares(build(problem, weighted(weight), huber=False), as_values(poses), most)
    return found._replace(weight=weight)


_SEARCHES: Mapping[str, Callable[[Problem, Edges, int], Optimum]] = MappingProxyType(
    {"none": _squares, "huber": _hubers, "gnc": _truncated}
)
