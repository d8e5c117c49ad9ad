"""Elimination where digits are short: by Cholesky's factors, then by QR, then an error that says where.

Cholesky's factors square the condition of the system: where one measurement is 1e10 times as sure as
another, rounding is all that is left. QR does without the square, in twice the time.
"""

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import MappingProxyType
from typing import Any, NamedTuple

import gtsam
import numpy as np
from jaxtyping import Float

from wifipgo.errors import NumericalError

CHOLESKY, QR = "MULTIFRONTAL_CHOLESKY", "MULTIFRONTAL_QR"
MAX_ITERATIONS = 100  # of a search
STATIONARY = 1e-6  # gain of one more step, as a share of the error, that counts as none
_KINDS = MappingProxyType(
    {
        "lm": (gtsam.LevenbergMarquardtParams, gtsam.LevenbergMarquardtOptimizer),
        "gn": (gtsam.GaussNewtonParams, gtsam.GaussNewtonOptimizer),
    }
)


class Search(NamedTuple):
    """Where a search ended, and whether before it had to. Errors are gtsam's, half a chi-square."""

    values: gtsam.Values
    iterations: int
    before: float
    after: float
    settled: bool = True


def parameters(
    method: str = "lm",
    *,
    tolerance: float,
    max_iterations: int = MAX_ITERATIONS,
    solver: str = CHOLESKY,
) -> Any:
    """Parameters of "lm" or "gn", which ends once a fall of the error is below ``tolerance``."""
    params = _KINDS[method][0]()
    params.setRelativeErrorTol(tolerance)
    params.setAbsoluteErrorTol(tolerance)
    params.setMaxIterations(max_iterations)
    params.setLinearSolverType(solver)
    return params


def searched(
    graph: gtsam.NonlinearFactorGraph,
    values: gtsam.Values,
    params: gtsam.NonlinearOptimizerParams,
    *,
    method: str = "lm",
) -> Search:
    """Run one search; by QR again, from the lowest poses, where Cholesky's factors fail or get stuck."""
    before = graph.error(values)
    try:
        first = _run(graph, values, params, method)
    except RuntimeError:
        first = Search(values, 0, before, np.inf)
    if np.isfinite(first.after) and not _stuck(graph, first, params):
        return first._replace(before=before)
    params.setLinearSolverType(QR)
    begin = first.values if first.after < before else values
    again = _run(graph, begin, params, method)
    return again._replace(iterations=first.iterations + again.iterations, before=before)


def _run(
    graph: gtsam.NonlinearFactorGraph,
    values: gtsam.Values,
    params: gtsam.NonlinearOptimizerParams,
    method: str,
) -> Search:
    optimiser = _KINDS[method][1](graph, values, params)
    before = optimiser.error()
    found = optimiser.optimize()
    settled = optimiser.iterations() < params.getMaxIterations()
    return Search(found, optimiser.iterations(), before, optimiser.error(), settled)


def _stuck(graph: gtsam.NonlinearFactorGraph, search: Search, params: gtsam.NonlinearOptimizerParams) -> bool:
    """Whether the steps did not come to an end, or there was none though it had gained something."""
    if search.iterations == 0:
        return not at_bottom(graph, search.values)
    return not search.settled


def at_bottom(graph: gtsam.NonlinearFactorGraph, values: gtsam.Values) -> bool:
    """Whether one more step of Gauss-Newton, by QR, would gain nothing, to first order."""
    here = graph.error(values)
    if not np.isfinite(here):
        return False
    try:
        optimiser = gtsam.GaussNewtonOptimizer(graph, values, parameters("gn", tolerance=0.0, solver=QR))
        optimiser.iterate()
    except RuntimeError:  # no step can be found, so nobody knows
        return False
    delta = values.localCoordinates(optimiser.values())
    return bool(here - graph.linearize(values).error(delta) <= STATIONARY * (1.0 + here))


def marginals(
    graph: gtsam.NonlinearFactorGraph, values: gtsam.Values, keys: list[int]
) -> Float[np.ndarray, "keys freedom freedom"]:
    """Covariance of some poses, in the axes of each, in gtsam's order.

    Raises:
        RuntimeError: Measurements do not say where the poses are, to working precision.
    """
    try:
        of = gtsam.Marginals(graph, values).marginalCovariance
        return _finite(np.array([of(key) for key in keys]))
    except RuntimeError:
        params = gtsam.ISAM2Params()
        params.setFactorization("QR")
        tree = gtsam.ISAM2(params)  # the one of gtsam's trees whose marginals can be had by QR from Python
        tree.update(graph, values)
        return _finite(np.array([tree.marginalCovariance(key) for key in keys]))


def _finite(covariances: np.ndarray) -> np.ndarray:
    if not np.isfinite(covariances).all():
        raise RuntimeError("a covariance is not finite")
    return covariances


@contextmanager
def named(doing: str, name: Callable[[int], str]) -> Iterator[None]:
    """Turn a failure of gtsam's or scipy's into one that says what failed and at which pose.

    Args:
        doing: What is being done: "search" say.
        name: Names the pose and a measurement of it, given its key.

    Raises:
        NumericalError: Something inside failed.
    """
    try:
        yield
    except NumericalError:
        raise
    except RuntimeError as error:
        raise NumericalError(f"{doing}: {_reason(str(error), name)}") from error


def _reason(message: str, name: Callable[[int], str]) -> str:
    found = re.search(r"near variable\s+(\d+)", message)
    if found is None:
        return f"singular to working precision ({message.strip().splitlines()[0]})"
    return f"singular to working precision near {name(int(found[1]))}"
