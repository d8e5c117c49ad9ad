"""How well robots know where they are: covariances of their last poses (inverse information of Eq. 3)."""

from collections.abc import Sequence
from functools import partial

import numpy as np
from jaxtyping import Float, Int

from wifipgo.arithmetic import harmless_underflow
from wifipgo.graph.edges import Edges
from wifipgo.graph.solvers._banded_cholesky import group_covariances
from wifipgo.graph.solvers._banded_descent import start_of
from wifipgo.graph.solvers._elimination import named
from wifipgo.graph.solvers._gtsam_search import as_values, covariances_of
from wifipgo.graph.solvers._problem import KNOWN_START, REPORTED_SIGMA, Problem, build, name_of, posed


@harmless_underflow
def last_pose_covariances(
    poses: Float[np.ndarray, "robots times 3"],
    edges: Edges,
    *,
    robots: Sequence[int],
    third_party: str = "fixed_told",
    told_sigma: Float[np.ndarray, "#edges 2"] | tuple[float, float] = REPORTED_SIGMA,
    start_sigma: Float[np.ndarray, "#robots 2"] | tuple[float, float] = KNOWN_START,
) -> Float[np.ndarray, "team 3 3"]:
    """Covariance of the last pose of each participant, given what they measured and were told.

    It is the block of the inverse of the information matrix of all their poses, linearised at
    ``poses``: the optimum, normally. All squares; `wifipgo.graph.solve` with ``covariances``
    gives them under a loss and with bearings, without building the problem again.

    Args:
        poses: Estimates, world frame.
        edges: See `wifipgo.graph.solve`, as for all that is not named here.
        robots: Who takes part.
        third_party: What an edge to a robot outside does.
        told_sigma: Uncertainty of told poses.
        start_sigma: How well first poses are known.

    Returns:
        One matrix a participant, in the order of ``robots``, over ``(x_m, y_m, yaw_rad)`` along the axes
        of the world: the upper left block is the covariance of the position, m^2.

    Raises:
        ValueError: As `wifipgo.graph.solve`.
        NumericalError: Beyond working precision; says at which pose and measurement.
    """
    problem = posed(
        poses,
        edges,
        groups=[robots],
        third_party=third_party,
        told_sigma=told_sigma,
        start_sigma=start_sigma,
    )
    rows, begin = last_rows(problem, robots), start_of(problem, edges)
    if begin is not None:
        (found,) = group_covariances(*begin, [rows])
        if found is not None:  # else gtsam says which pose it is
            return found
    graph = build(problem, edges, huber=False)
    with named("end covariances", partial(name_of, problem, edges)):
        return covariances_of(graph, as_values(problem.start), rows)


def last_rows(problem: Problem, robots: Sequence[int]) -> Int[np.ndarray, " robots"]:
    """Rows of the robots' last poses in the problem."""
    return problem.first_key[list(robots)] + len(problem.start) // len(problem.team) - 1
