"""Solvers of pose graphs. The only folder that imports gtsam, whose objects never leave it."""

from typing import TYPE_CHECKING

from wifipgo.former_names import of_face
from wifipgo.graph.losses import LOSSES
from wifipgo.graph.solvers._problem import (
    KNOWN_START,
    NOTHING,
    REPORTED_SIGMA,
    THIRD_PARTY,
    UNKNOWN_START,
    odometry,
)
from wifipgo.graph.solvers.incremental import IncrementalSmoothers, SmootherResult, SmootherUpdate
from wifipgo.graph.solvers.marginals import last_pose_covariances
from wifipgo.graph.solvers.planar import solve, solve_team
from wifipgo.graph.solvers.report import Downweighted, Report

__all__ = [
    "KNOWN_START",
    "LOSSES",
    "NOTHING",
    "REPORTED_SIGMA",
    "THIRD_PARTY",
    "UNKNOWN_START",
    "Downweighted",
    "IncrementalSmoothers",
    "Report",
    "SmootherResult",
    "SmootherUpdate",
    "last_pose_covariances",
    "odometry",
    "solve",
    "solve_team",
]

if not TYPE_CHECKING:
    __getattr__ = of_face(__name__)
