"""Robust losses for the distributed method, by weights that each robot finds for its own measurements.

After each solution a measurement's weight follows from its own residual alone, so the
robots need nobody for it, and the next solution starts warm. Huber's weights are those of
iterated least squares; truncated squares come by graduated non-convexity (Yang, Antonante,
Tzoumas, Carlone, RA-L 2020, Algorithm 1 and Eq. 14). Odometry is trusted.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float, Int
from scipy.special import chdtri

from wifipgo.arithmetic import harmless_underflow
from wifipgo.graph.distributed import Channel, DistributedConfig, DistributedReport, solve_distributed
from wifipgo.graph.posegraph import PoseGraph
from wifipgo.graph.residuals import chi_squares

HUBER_KNEE = 1.345  # in sigmas
GNC_CONFIDENCE, GNC_FACTOR = 0.99, 1.4  # share of good measurements kept; growth of the control parameter
MAX_SOLUTIONS = 60
SAME_WEIGHT = 1e-2  # weights that change by less are taken for final


@harmless_underflow
def solve_reweighted(
    graph: PoseGraph,
    *,
    robust: str,
    config: DistributedConfig,
    channel: Channel,
    fixed: Int[np.ndarray, " fixed"] | None = None,
) -> tuple[Float[np.ndarray, "poses dims"], DistributedReport, Float[np.ndarray, " edges"]]:
    """Distributed solution under a robust loss, "huber" or "gnc".

    Poses in the rows ``fixed`` are known and stay, as does the first of each part without any.

    Returns:
        Pose rows; the report of the last solution, with all rounds, and whether the weights settled;
        and the last weights.
    """
    poses, report = solve_distributed(graph, fixed=fixed, config=config, channel=channel)
    rounds, weight = report.rounds, np.ones(len(graph.tail))
    limit = float(chdtri(graph.freedom, 1.0 - GNC_CONFIDENCE))
    chi2 = np.where(graph.odometry, 0.0, chi_squares(graph, poses))
    mu = limit / max(2.0 * float(chi2.max(initial=0.0)) - limit, 1e-9)
    settled = False
    for _ in range(MAX_SOLUTIONS):
        last = weight
        weight = _huber(chi2) if robust == "huber" else _truncated(chi2, limit, mu)
        sharp = robust == "huber" or bool(np.isin(weight, (0.0, 1.0)).all())
        settled = sharp and float(np.abs(weight - last).max(initial=0.0)) < SAME_WEIGHT
        if settled:
            break
        weighted = graph.with_weight(graph.weight * weight)
        warm = replace(config, warm=True)
        poses, report = solve_distributed(weighted, poses, fixed=fixed, config=warm, channel=channel)
        rounds += report.rounds
        chi2 = np.where(graph.odometry, 0.0, chi_squares(graph, poses))
        mu *= GNC_FACTOR
    return poses, report._replace(rounds=rounds, converged=report.converged and settled), weight


def _huber(chi2: Float[np.ndarray, " edges"]) -> Float[np.ndarray, " edges"]:
    return HUBER_KNEE / np.maximum(np.sqrt(chi2), HUBER_KNEE)


def _truncated(chi2: Float[np.ndarray, " edges"], limit: float, mu: float) -> Float[np.ndarray, " edges"]:
    """Weights of truncated squares at control parameter ``mu``: 1 far below the limit, 0 far above."""
    low, high = mu / (mu + 1.0) * limit, (mu + 1.0) / mu * limit
    between = np.sqrt(limit * mu * (mu + 1.0) / np.maximum(chi2, low)) - mu
    return np.where(chi2 <= low, 1.0, np.where(chi2 >= high, 0.0, np.clip(between, 0.0, 1.0)))
