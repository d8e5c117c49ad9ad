"""Robust losses for the distributed method, by weights that each robot finds for its own measurements.

After each solution a measurement's weight follows from its own residual alone, so the
robots need nobody for it, and the next solution starts warm. Huber's weights are those of
iterated least squares; truncated squares come by graduated non-convexity (Yang, Antonante,
Tzoumas, Carlone, RA-L 2020, Algorithm 1 and Eq. 14). Odometry is trusted.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float, Int

from wifipgo.arithmetic import harmless_underflow
from wifipgo.graph.distributed import Channel, DistributedConfig, DistributedReport, solve_distributed
from wifipgo.graph.losses import LOSSES, truncation_chi2
from wifipgo.graph.posegraph import PoseGraph
from wifipgo.graph.residuals import chi_squares

GNC_FACTOR = 1.4  # growth of the control parameter
MAX_SOLUTIONS = 60
SAME_WEIGHT = 1e-2  # weights that change by less are taken for final


@harmless_underflow
def solve_reweighted(
    graph: PoseGraph,
    *,
    loss: str,
    config: DistributedConfig,
    channel: Channel,
    fixed: Int[np.ndarray, " fixed"] | None = None,
) -> tuple[Float[np.ndarray, "poses dims"], DistributedReport, Float[np.ndarray, " edges"]]:
    """Distributed solution under a loss, a name in `wifipgo.graph.losses.LOSSES`.

    Poses in the rows ``fixed`` are known and stay, as does the first of each part without any.

    Returns:
        Pose rows; the report of the last solution, with all rounds, and whether the weights settled;
        and the last weights.
    """
    poses, report = solve_distributed(graph, fixed=fixed, config=config, channel=channel)
    rounds, seconds, weight = report.rounds, dict(report.seconds), np.ones(len(graph.tail))
    limit, row = truncation_chi2(graph.freedom), LOSSES[loss]
    chi2 = np.where(graph.odometry, 0.0, chi_squares(graph, poses))
    mu = limit / max(2.0 * float(chi2.max(initial=0.0)) - limit, 1e-9)
    settled = False
    for _ in range(MAX_SOLUTIONS):
        last = weight
        weight = row.weight(chi2, limit, mu)
        sharp = not row.graduated or bool(np.isin(weight, (0.0, 1.0)).all())
        settled = sharp and float(np.abs(weight - last).max(initial=0.0)) < SAME_WEIGHT
        if settled:
            break
        weighted = graph.with_weight(graph.weight * weight)
        warm = replace(config, warm=True)
        poses, report = solve_distributed(weighted, poses, fixed=fixed, config=warm, channel=channel)
        rounds += report.rounds
        seconds = {robot: spent + report.seconds[robot] for robot, spent in seconds.items()}
        chi2 = np.where(graph.odometry, 0.0, chi_squares(graph, poses))
        mu *= GNC_FACTOR
    done = report.converged and settled
    return poses, report._replace(rounds=rounds, converged=done, seconds=seconds), weight
