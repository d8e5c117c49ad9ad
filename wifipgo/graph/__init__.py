"""Graph wing: pose graphs, their solvers, outliers and metrics.

A team's graph in the plane is `Edges` with dense poses and is solved by `solve`; any graph, in the plane
or in space, is a `PoseGraph`, solved by `solve_graph` or, each robot its own block, by
`solve_distributed`.
"""

from typing import TYPE_CHECKING

from wifipgo.former_names import of_face
from wifipgo.graph.distributed import DistributedConfig, solve_distributed
from wifipgo.graph.edges import Edges, extended
from wifipgo.graph.files.g2o import read_g2o, write_g2o
from wifipgo.graph.metrics import ate_rot, ate_trans, residual_error
from wifipgo.graph.outliers.methods import OUTLIER_METHODS, solve_robust
from wifipgo.graph.posegraph import PoseGraph, pose_graph
from wifipgo.graph.solvers import last_pose_covariances, solve
from wifipgo.graph.solvers.spatial import marginal_covariances, solve_graph

__all__ = [
    "OUTLIER_METHODS",
    "DistributedConfig",
    "Edges",
    "PoseGraph",
    "ate_rot",
    "ate_trans",
    "extended",
    "last_pose_covariances",
    "marginal_covariances",
    "pose_graph",
    "read_g2o",
    "residual_error",
    "solve",
    "solve_distributed",
    "solve_graph",
    "solve_robust",
    "write_g2o",
]

if not TYPE_CHECKING:
    __getattr__ = of_face(__name__)
