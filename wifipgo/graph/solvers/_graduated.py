"""Truncated squares by graduated non-convexity from where the search starts.

Yang, Antonante, Tzoumas, Carlone, RA-L 2020, Algorithm 1. It begins with the weights of the start, not as
gtsam's with a solve that trusts everything: where most loops are wrong that is lost, however good the start.
What has weight zero plays no part in a step, so steps get cheaper as wrong loops go.
"""

from collections.abc import Callable
from functools import partial

import gtsam
import numpy as np
from jaxtyping import Bool, Float, Int

from wifipgo.graph.losses import truncated_weight, truncation_chi2
from wifipgo.graph.posegraph import FREEDOM, PoseGraph
from wifipgo.graph.residuals import chi_squares
from wifipgo.graph.solvers._elimination import parameters, searched
from wifipgo.graph.solvers._keyed_factors import factors_of, rows_of, values_of

GROWTH = 1.4  # of the control parameter
MAX_SOLVES = 100
TOLERANCE, ITERATIONS = 1e-5, 20  # of each solve: weights move on before poses have settled
NOTHING = 1e-8  # a weight that counts as none


Rows = Float[np.ndarray, "poses dims"]
Weight = Float[np.ndarray, " edges"]


def graduated(
    rows: Rows,
    doubted: Bool[np.ndarray, " edges"],
    *,
    chi2: Callable[[Rows], Weight],
    solved: Callable[[Rows, Weight], Rows],
) -> tuple[Rows, Weight]:
    """Poses, and 0 to 1 for each measurement; what is not doubted is trusted.

    Args:
        rows: Where the search starts.
        doubted: Which measurements may be let go.
        chi2: Squared distances at some poses.
        solved: A few steps from some poses under some weights.
    """
    limit, weight, off = truncation_chi2(FREEDOM[rows.shape[1]]), np.ones(len(doubted)), _finite(chi2, rows)
    mu = limit / max(2.0 * float(off[doubted].max(initial=0.0)) - limit, 1e-9)
    for solves in range(MAX_SOLVES):
        weight[doubted] = truncated_weight(off[doubted], limit=limit, mu=mu)
        weight[weight < NOTHING] = 0.0
        if solves and np.isin(weight, (0.0, 1.0)).all():
            break
        rows = solved(rows, weight)
        off, mu = _finite(chi2, rows), mu * GROWTH
    return rows, weight


def truncated_squares(
    graph: PoseGraph, rows: Rows, fixed: Int[np.ndarray, " fixed"] | None
) -> tuple[Rows, Weight]:
    """Those of a graph with any keys, odometry trusted."""

    def solved(rows: Rows, weight: Weight) -> Rows:
        factors, _ = factors_of(graph.with_weight(graph.weight * weight), rows, fixed, huber=False)
        return rows_of(few_steps(factors, values_of(rows)), graph.freedom)

    doubted = ~graph.odometry & (graph.weight > 0.0)
    return graduated(rows, doubted, chi2=partial(chi_squares, graph), solved=solved)


def few_steps(factors: gtsam.NonlinearFactorGraph, values: gtsam.Values) -> gtsam.Values:
    """Weights move on before poses have settled."""
    return searched(factors, values, parameters(tolerance=TOLERANCE, max_iterations=ITERATIONS)).values


def _finite(chi2: Callable[[Rows], Weight], rows: Rows) -> Weight:
    """Squared distances, finite: of poses far off they may overflow."""
    most = np.finfo(np.float64).max / 4.0
    with np.errstate(over="ignore", invalid="ignore"):
        return np.nan_to_num(chi2(rows), nan=most, posinf=most)
