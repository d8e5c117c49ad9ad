"""Gauss-Newton with Levenberg-Marquardt to fall back on, and truncated squares around the latter."""

from typing import NamedTuple

import gtsam
import numpy as np
from jaxtyping import Float

TOLERANCE = 1e-8  # on the relative and absolute fall of the error: poses within about 0.1 mm of the optimum
SLACK, ROUNDING = 1e-9, 1e-13  # of squares, absolute and relative: within 1e-4 sigmas, all poses together
NEAR = 1.0  # fall of the error below which the factors serve again, while each step's fall is
SHRINKING = 0.1  # of the last one's at most
MAX_STEPS = 20  # of Gauss-Newton; where it is of use it needs 2 to 8
GNC_CONFIDENCE = 0.99  # share of good measurements that truncation keeps


class Found(NamedTuple):
    """Where a search ended. Errors are gtsam's, half a chi-square; weights are GNC's, one an edge used."""

    graph: gtsam.NonlinearFactorGraph
    values: gtsam.Values
    iterations: int
    before: float
    after: float
    weight: Float[np.ndarray, " rows"] | None = None


def as_values(start: Float[np.ndarray, "poses 3"]) -> gtsam.Values:
    """Poses as gtsam's; keys are rows."""
    values = gtsam.Values()
    for key, pose in enumerate(start.tolist()):
        values.insert(key, pose2=gtsam.Pose2(*pose))  # the name spares a search among 50 types
    return values


def _parameters() -> gtsam.LevenbergMarquardtParams:
    params = gtsam.LevenbergMarquardtParams()
    params.setRelativeErrorTol(TOLERANCE)
    params.setAbsoluteErrorTol(TOLERANCE)
    return params


def optimise(graph: gtsam.NonlinearFactorGraph, values: gtsam.Values) -> Found:
    """Run Levenberg-Marquardt."""
    return _damped(graph, values, graph.error(values), 0)


def least_squares(graph: gtsam.NonlinearFactorGraph, values: gtsam.Values) -> Found:
    """Gauss-Newton while the error falls; Levenberg-Marquardt from the best poses once it does not.

    One order of elimination serves all steps, and near the optimum one factorisation serves several. Falls
    shrink at least geometrically there, so the search ends when the next one would be below the tolerance,
    without a step to see it.
    """
    ordering = gtsam.Ordering.ColamdNonlinearFactorGraph(graph)
    before = error = graph.error(values)
    factored, last_fall = None, 0.0
    for iteration in range(1, MAX_STEPS + 1):
        try:
            delta, factors = _step(graph.linearize(values), ordering, factored)
        except RuntimeError:  # singular to working precision
            break
        stepped, slack = values.retract(delta), SLACK + ROUNDING * error
        fall = error - graph.error(stepped)
        if factored is None and not fall >= -slack:  # downhill, yet not down; or not a number
            break
        if fall > 0.0:
            values, error = stepped, error - fall
        shrinking = abs(fall) / last_fall if last_fall > 0.0 else 1.0
        if abs(fall) * min(1.0, shrinking) <= slack:
            return Found(graph, values, iteration, before, error)
        again = 0.0 < fall < NEAR and (factored is None or shrinking < SHRINKING)
        factored, last_fall = factors if again else None, fall
    return _damped(graph, values, before, iteration)


def _step(
    linear: gtsam.GaussianFactorGraph, ordering: gtsam.Ordering, factored: gtsam.GaussianBayesNet | None
) -> tuple[gtsam.VectorValues, gtsam.GaussianBayesNet]:
    """A step and the factors behind it: of the system itself, or of one nearby with the slope of this."""
    if factored is None:
        factored = linear.eliminateSequential(ordering)
        return factored.optimize(), factored
    slope = linear.gradientAtZero()
    return factored.backSubstitute(factored.backSubstituteTranspose(slope)).scale(-1.0), factored


def _damped(graph: gtsam.NonlinearFactorGraph, values: gtsam.Values, before: float, spent: int) -> Found:
    """Levenberg-Marquardt after some steps without it."""
    optimiser = gtsam.LevenbergMarquardtOptimizer(graph, values, _parameters())
    found = optimiser.optimize()
    return Found(graph, found, spent + optimiser.iterations(), before, optimiser.error())


def truncate(
    graph: gtsam.NonlinearFactorGraph, values: gtsam.Values, *, trusted: list[int]
) -> tuple[gtsam.Values, Float[np.ndarray, " factors"]]:
    """Truncated squares by graduated non-convexity: solution, and 0 to 1 for each factor."""
    gnc = gtsam.GncLMParams(_parameters())
    gnc.setLossType(gtsam.GncLossType.TLS)
    gnc.setKnownInliers(trusted)
    optimiser = gtsam.GncLMOptimizer(graph, values, gnc)
    optimiser.setInlierCostThresholdsAtProbability(GNC_CONFIDENCE)
    return optimiser.optimize(), optimiser.getWeights()
