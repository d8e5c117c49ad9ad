"""Graph wing: pose graphs, their solvers, outliers and metrics."""

from wifipgo.graph.anchor_bearings import NO_PINGS, Pings, extended_pings, select_pings
from wifipgo.graph.bearings import Bearings, extended_bearings, select_bearings
from wifipgo.graph.covariance import propagate_covariance
from wifipgo.graph.distributed import Channel, DistributedConfig, DistributedReport, solve_distributed
from wifipgo.graph.distributed.simulated_team import solve_by_robots
from wifipgo.graph.edges import Edges, extended, refresh_reported, select
from wifipgo.graph.files.g2o import read_g2o, write_g2o
from wifipgo.graph.metrics import ERR_WEIGHTS, ate_rot, ate_trans, residual_error
from wifipgo.graph.outliers.aoa_weights import bearing, paper_weights
from wifipgo.graph.outliers.methods import OUTLIER_METHODS, OutlierMethod, direction_weights, solve_robust
from wifipgo.graph.posegraph import PoseGraph, pose_graph
from wifipgo.graph.solvers import (
    REPORTED_SIGMA,
    THIRD_PARTY,
    Downweighted,
    IncrementalSmoothers,
    Report,
    SmootherResult,
    SmootherUpdate,
    last_pose_covariances,
    odometry,
    solve,
    solve_team,
)
from wifipgo.graph.solvers._problem import NOTHING
from wifipgo.graph.solvers.spatial import marginal_covariances, solve_graph
from wifipgo.graph.subgraphs import anchors, appended, components, from_team, of_robots

__all__ = [
    "ERR_WEIGHTS",
    "NOTHING",
    "NO_PINGS",
    "OUTLIER_METHODS",
    "REPORTED_SIGMA",
    "THIRD_PARTY",
    "Bearings",
    "Channel",
    "DistributedConfig",
    "DistributedReport",
    "Downweighted",
    "Edges",
    "IncrementalSmoothers",
    "OutlierMethod",
    "Pings",
    "PoseGraph",
    "Report",
    "SmootherResult",
    "SmootherUpdate",
    "anchors",
    "appended",
    "ate_rot",
    "ate_trans",
    "bearing",
    "components",
    "direction_weights",
    "extended",
    "extended_bearings",
    "extended_pings",
    "from_team",
    "last_pose_covariances",
    "marginal_covariances",
    "odometry",
    "of_robots",
    "paper_weights",
    "pose_graph",
    "propagate_covariance",
    "read_g2o",
    "refresh_reported",
    "residual_error",
    "select",
    "select_bearings",
    "select_pings",
    "solve",
    "solve_by_robots",
    "solve_distributed",
    "solve_graph",
    "solve_robust",
    "solve_team",
    "write_g2o",
]
