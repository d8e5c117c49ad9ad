"""Truncated squares of a graph with any keys, by graduated non-convexity from where the search starts.

Yang, Antonante, Tzoumas, Carlone, RA-L 2020, Algorithm 1. It begins with the weights of the start, not as
gtsam's with a solve that trusts everything: where most loops are wrong that is lost, however good the start.
What has weight zero plays no part in a step, so steps get cheaper as wrong loops go.
"""

import numpy as np
from jaxtyping import Float, Int

from wifipgo.graph.losses import truncated_weight, truncation_chi2
from wifipgo.graph.posegraph import PoseGraph
from wifipgo.graph.residuals import chi_squares
from wifipgo.graph.solvers._elimination import parameters, searched
from wifipgo.graph.solvers._keyed_factors import factors_of, rows_of, values_of

GROWTH = 1.4  # of the control parameter
MAX_SOLVES = 100
TOLERANCE, ITERATIONS = 1e-5, 20  # of each solve: weights move on before poses have settled
NOTHING = 1e-8  # a weight that counts as none


def truncated_squares(
    graph: PoseGraph, rows: Float[np.ndarray, "poses dims"], fixed: Int[np.ndarray, " fixed"] | None
) -> tuple[Float[np.ndarray, "poses dims"], Float[np.ndarray, " edges"]]:
    """Poses, and 0 to 1 for each measurement; odometry is trusted."""
    limit, doubted = truncation_chi2(graph.freedom), ~graph.odometry & (graph.weight > 0.0)
    weight, chi2 = np.ones(len(graph.tail)), _chi2(graph, rows)
    mu = limit / max(2.0 * float(chi2[doubted].max(initial=0.0)) - limit, 1e-9)
    for solves in range(MAX_SOLVES):
        weight[doubted] = truncated_weight(chi2[doubted], limit=limit, mu=mu)
        weight[weight < NOTHING] = 0.0
        if solves and np.isin(weight, (0.0, 1.0)).all():
            break
        rows = _solved(graph.with_weight(graph.weight * weight), rows, fixed)
        chi2, mu = _chi2(graph, rows), mu * GROWTH
    return rows, weight


def _solved(
    graph: PoseGraph, rows: Float[np.ndarray, "poses dims"], fixed: Int[np.ndarray, " fixed"] | None
) -> Float[np.ndarray, "poses dims"]:
    """A few steps of weighted squares."""
    factors, _ = factors_of(graph, rows, fixed, huber=False)
    params = parameters(tolerance=TOLERANCE, max_iterations=ITERATIONS)
    return rows_of(searched(factors, values_of(rows), params).values, graph.freedom)


def _chi2(graph: PoseGraph, rows: Float[np.ndarray, "poses dims"]) -> Float[np.ndarray, " edges"]:
    """Squared distances, finite: of poses far off they may overflow."""
    most = np.finfo(np.float64).max / 4.0
    with np.errstate(over="ignore", invalid="ignore"):
        return np.nan_to_num(chi_squares(graph, rows), nan=most, posinf=most)
