"""Levenberg-Marquardt, and truncated squares around it."""

from typing import NamedTuple

import gtsam
import numpy as np
from jaxtyping import Float

TOLERANCE = 1e-8  # on the relative and absolute fall of the error: poses within about 0.1 mm of the optimum
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
    optimiser = gtsam.LevenbergMarquardtOptimizer(graph, values, _parameters())
    before = optimiser.error()
    found = optimiser.optimize()
    return Found(graph, found, optimiser.iterations(), before, optimiser.error())


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
