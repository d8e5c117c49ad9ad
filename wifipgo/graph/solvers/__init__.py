"""Solvers of pose graphs. The only folder that imports gtsam, whose objects never leave it."""

from wifipgo.graph.solvers._losses import LOSSES
from wifipgo.graph.solvers.planar import KNOWN_START, THIRD_PARTY, UNKNOWN_START, solve, solve_team
from wifipgo.graph.solvers.report import Report, WeighedDown

__all__ = [
    "KNOWN_START",
    "LOSSES",
    "THIRD_PARTY",
    "UNKNOWN_START",
    "Report",
    "WeighedDown",
    "solve",
    "solve_team",
]
