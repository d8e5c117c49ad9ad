"""Graph wing: pose graphs, their solvers, outliers and metrics."""

from wifipgo.graph.bearings import Bearings, extended_bearings
from wifipgo.graph.metrics import ERR_WEIGHTS, ate_rot, ate_trans, residual_error
from wifipgo.graph.outliers import bearing, paper_weights
from wifipgo.graph.posegraph import Edges, extended, retold, select
from wifipgo.graph.robust import GUARDS, Guard, direction_weights, solve_guarded
from wifipgo.graph.solvers import THIRD_PARTY, Report, WeighedDown, solve, solve_team

__all__ = [
    "ERR_WEIGHTS",
    "GUARDS",
    "THIRD_PARTY",
    "Bearings",
    "Edges",
    "Guard",
    "Report",
    "WeighedDown",
    "ate_rot",
    "ate_trans",
    "bearing",
    "direction_weights",
    "extended",
    "extended_bearings",
    "paper_weights",
    "residual_error",
    "retold",
    "select",
    "solve",
    "solve_guarded",
    "solve_team",
]
