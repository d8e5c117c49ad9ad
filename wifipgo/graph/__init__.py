"""Graph wing: pose graphs, their solvers, outliers and metrics."""

from wifipgo.graph.anchor_bearings import NO_PINGS, Pings, extended_pings, select_pings
from wifipgo.graph.bearings import Bearings, extended_bearings, select_bearings
from wifipgo.graph.covariance import dead_reckoned
from wifipgo.graph.distributed import Channel, DistributedConfig, DistributedReport, solve_distributed
from wifipgo.graph.distributed.simulated_team import solve_by_robots
from wifipgo.graph.edges import Edges, extended, retold, select
from wifipgo.graph.files.g2o import read_g2o, write_g2o
from wifipgo.graph.metrics import ERR_WEIGHTS, ate_rot, ate_trans, residual_error
from wifipgo.graph.outliers.aoa_weights import bearing, paper_weights
from wifipgo.graph.outliers.methods import GUARDS, Guard, direction_weights, solve_guarded
from wifipgo.graph.posegraph import PoseGraph, pose_graph
from wifipgo.graph.solvers import (
    THIRD_PARTY,
    TOLD_SIGMA,
    Learned,
    News,
    Report,
    Smoothers,
    WeighedDown,
    end_covariances,
    odometry,
    solve,
    solve_team,
)
from wifipgo.graph.solvers._problem import NOTHING
from wifipgo.graph.solvers.spatial import marginal_covariances, solve_graph
from wifipgo.graph.subgraphs import anchors, appended, components, from_team, of_robots

__all__ = [
    "ERR_WEIGHTS",
    "GUARDS",
    "NOTHING",
    "NO_PINGS",
    "THIRD_PARTY",
    "TOLD_SIGMA",
    "Bearings",
    "Channel",
    "DistributedConfig",
    "DistributedReport",
    "Edges",
    "Guard",
    "Learned",
    "News",
    "Pings",
    "PoseGraph",
    "Report",
    "Smoothers",
    "WeighedDown",
    "anchors",
    "appended",
    "ate_rot",
    "ate_trans",
    "bearing",
    "components",
    "dead_reckoned",
    "direction_weights",
    "end_covariances",
    "extended",
    "extended_bearings",
    "extended_pings",
    "from_team",
    "marginal_covariances",
    "odometry",
    "of_robots",
    "paper_weights",
    "pose_graph",
    "read_g2o",
    "residual_error",
    "retold",
    "select",
    "select_bearings",
    "select_pings",
    "solve",
    "solve_by_robots",
    "solve_distributed",
    "solve_graph",
    "solve_guarded",
    "solve_team",
    "write_g2o",
]
