"""Gtsam's Gauss-Newton, and Levenberg-Marquardt to fall back on."""

from functools import partial
from typing import NamedTuple

import gtsam
import numpy as np
from jaxtyping import Float, Int

from wifipgo.graph.covariance import in_world_axes
from wifipgo.graph.solvers._elimination import (
    MAX_ITERATIONS,
    marginals,
    parameters,
    searched,
)
from wifipgo.graph.solvers._gauss_newton import descend

TOLERANCE = 1e-8  # on the relative and absolute fall of the error: poses within about 0.1 mm of the optimum


class SearchOptimum(NamedTuple):
    """Where a search ended. Errors are gtsam's, half a chi-square; weights are GNC's, one an edge used.

    Settled is a search that ended before it had to.
    """

    graph: gtsam.NonlinearFactorGraph
    values: gtsam.Values
    iterations: int
    before: float
    after: float
    weight: Float[np.ndarray, " rows"] | None = None
    settled: bool = True

    @property
    def poses(self) -> Float[np.ndarray, "poses 3"]:
        """Poses by key."""
        return poses_of(self.values)

    def covariances(self, rows: Int[np.ndarray, " some"]) -> Float[np.ndarray, "some 3 3"]:
        """Covariances of some poses, along the axes of the world."""
        return covariances_of(self.graph, self.values, rows)


def covariances_of(
    graph: gtsam.NonlinearFactorGraph, values: gtsam.Values, rows: Int[np.ndarray, " some"]
) -> Float[np.ndarray, "some 3 3"]:
    """Covariances of some poses, from the axes of each pose, where gtsam has them, to the world's."""
    own_axes = marginals(graph, values, rows.tolist())
    yaw_rad = np.array([values.atPose2(key).theta() for key in rows.tolist()])
    return in_world_axes(own_axes, yaw_rad)


def as_values(start: Float[np.ndarray, "poses 3"]) -> gtsam.Values:
    """Poses as gtsam's; keys are rows."""
    values = gtsam.Values()
    for key, pose in enumerate(start.tolist()):
        values.insert(key, pose2=gtsam.Pose2(*pose))  # the name spares a search among 50 types
    return values


def poses_of(values: gtsam.Values) -> Float[np.ndarray, "poses 3"]:
    """Poses by key."""
    found: np.ndarray = gtsam.utilities.extractPose2(values)
    return found


def optimise(
    graph: gtsam.NonlinearFactorGraph, values: gtsam.Values, most: int = MAX_ITERATIONS
) -> SearchOptimum:
    """Run Levenberg-Marquardt, ``most`` iterations at most."""
    return _damped(graph, values, before=graph.error(values), spent=0, most=most)


class _At(NamedTuple):
    """Poses as gtsam's, and half the chi-square there."""

    values: gtsam.Values
    error: float


def least_squares(
    graph: gtsam.NonlinearFactorGraph, values: gtsam.Values, most: int = MAX_ITERATIONS
) -> SearchOptimum:
    """Gauss-Newton while the error falls; Levenberg-Marquardt from the best poses once it does not.

    One order of elimination serves all steps.
    """
    ordering = gtsam.Ordering.ColamdNonlinearFactorGraph(graph)
    start = _At(values, graph.error(values))
    at, search = descend(partial(_step, graph, ordering), start)
    if not search.settled:
        return _damped(graph, at.values, before=start.error, spent=search.steps, most=most)
    return SearchOptimum(graph, at.values, search.steps, start.error, at.error)


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


def _damped(
    graph: gtsam.NonlinearFactorGraph, values: gtsam.Values, *, before: float, spent: int, most: int
) -> SearchOptimum:
    """Levenberg-Marquardt after some steps without it."""
    params = parameters(tolerance=TOLERANCE, max_iterations=most)
    found = searched(graph, values, params)
    return SearchOptimum(
        graph, found.values, spent + found.iterations, before, found.after, settled=found.settled
    )
