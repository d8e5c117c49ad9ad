"""Solvers of pose graphs. The only folder that imports gtsam, whose objects never leave it."""

from wifipgo.graph.solvers.planar import THIRD_PARTY, Report, solve, solve_team

__all__ = ["THIRD_PARTY", "Report", "solve", "solve_team"]
