"""Gtsam's Gauss-Newton, Levenberg-Marquardt to fall back on, and truncated squares around the latter."""

from functools import partial
from typing import NamedTuple

import gtsam
import numpy as np
from jaxtyping import Float, Int

from wifipgo.graph.growth import in_world_axes
from wifipgo.graph.solvers._descent import descend

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

    @property
    def poses(self) -> Float[np.ndarray, "poses 3"]:
        """Poses by key."""
        found: np.ndarray = gtsam.utilities.extractPose2(self.values)
        return found

    def covariances(self, rows: Int[np.ndarray, " some"]) -> Float[np.ndarray, "some 3 3"]:
        """Covariances of some poses, along the axes of the world."""
        return covariances_of(self.graph, self.values, rows)


def covariances_of(
    graph: gtsam.NonlinearFactorGraph, values: gtsam.Values, rows: Int[np.ndarray, " some"]
) -> Float[np.ndarray, "some 3 3"]:
    """Covariances of some poses, from the axes of each pose, where gtsam has them, to the world's."""
    marginals = gtsam.Marginals(graph, values)
    own_axes = np.array([marginals.marginalCovariance(key) for key in rows.tolist()])
    yaw_rad = np.array([values.atPose2(key).theta() for key in rows.tolist()])
    return in_world_axes(own_axes, yaw_rad)


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


class _At(NamedTuple):
    """Poses as gtsam's, and half the chi-square there."""

    values: gtsam.Values
    error: float


def least_squares(graph: gtsam.NonlinearFactorGraph, values: gtsam.Values) -> Found:
    """Gauss-Newton while the error falls; Levenberg-Marquardt from the best poses once it does not.

    One order of elimination serves all steps.
    """
    ordering = gtsam.Ordering.ColamdNonlinearFactorGraph(graph)
    start = _At(values, graph.error(values))
    at, steps, settled = descend(partial(_step, graph, ordering), start)
    if not settled:
        return _damped(graph, at.values, start.error, steps)
    return Found(graph, at.values, steps, start.error, at.error)


def _step(
    graph: gtsam.NonlinearFactorGraph,
    ordering: gtsam.Ordering,
    at: _At,
    factors: gtsam.GaussianBayesNet | None,
) -> tuple[_At, gtsam.GaussianBayesNet]:
    """A step by the factors given, with the slope of the system itself, or by those of the system."""
    linear = graph.linearize(at.values)
    if factors is None:
        factors = linear.eliminateSequential(ordering)
        delta = factors.optimize()
    else:
        slope = linear.gradientAtZero()
        delta = factors.backSubstitute(factors.backSubstituteTranspose(slope)).scale(-1.0)
    values = at.values.retract(delta)
    return _At(values, graph.error(values)), factors


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
