"""Graph wing: pose graphs, their solvers, outliers and metrics."""

from wifipgo.graph.metrics import ERR_WEIGHTS, ate_rot, ate_trans, residual_error
from wifipgo.graph.outliers import bearing, paper_weights
from wifipgo.graph.posegraph import Edges, extended, retold, select
from wifipgo.graph.solvers import THIRD_PARTY, Report, solve, solve_team

__all__ = [
    "ERR_WEIGHTS",
    "THIRD_PARTY",
    "Edges",
    "Report",
    "ate_rot",
    "ate_trans",
    "bearing",
    "extended",
    "paper_weights",
    "residual_error",
    "retold",
    "select",
    "solve",
    "solve_team",
]
