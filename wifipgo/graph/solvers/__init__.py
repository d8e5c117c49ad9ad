"""Solvers of pose graphs. The only folder that imports gtsam, whose objects never leave it."""

from wifipgo.graph.solvers._losses import LOSSES
from wifipgo.graph.solvers._problem import KNOWN_START, THIRD_PARTY, TOLD_SIGMA, UNKNOWN_START, odometry
from wifipgo.graph.solvers.incremental import Learned, News, Smoothers
from wifipgo.graph.solvers.marginals import end_covariances
from wifipgo.graph.solvers.planar import solve, solve_team
from wifipgo.graph.solvers.report import Report, WeighedDown

__all__ = [
    "KNOWN_START",
    "LOSSES",
    "THIRD_PARTY",
    "TOLD_SIGMA",
    "UNKNOWN_START",
    "Learned",
    "News",
    "Report",
    "Smoothers",
    "WeighedDown",
    "end_covariances",
    "odometry",
    "solve",
    "solve_team",
]
