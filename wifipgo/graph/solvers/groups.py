"""Groups of robots that share nothing, solved at once, each as if it were alone (paper Eq. 3)."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from wifipgo.arithmetic import harmless_underflow
from wifipgo.graph.edges import Edges
from wifipgo.graph.solvers._banded_cholesky import group_covariances, linearised
from wifipgo.graph.solvers._banded_descent import MOST_POSES, BandedOptimum, descended, fast
from wifipgo.graph.solvers._linearised import squares
from wifipgo.graph.solvers._problem import KNOWN_START, REPORTED_SIGMA, Problem, posed
from wifipgo.graph.solvers.planar import put_back
from wifipgo.threads import one_thread

Group = Sequence[int]


class GroupOptimum(NamedTuple):
    """Poses of a group, and covariances of the last ones along the axes of the world, if known."""

    poses: Float[np.ndarray, "group times 3"]
    covariances: Float[np.ndarray, "group 3 3"] | None


@one_thread
@harmless_underflow
def solve_groups(
    poses: Float[np.ndarray, "robots times 3"],
    edges: Edges,
    *,
    groups: Sequence[Group],
    third_party: str = "fixed_told",
) -> list[GroupOptimum | None]:
    """Least squares of several groups at once, each to the bit what `wifipgo.graph.solve` finds for it.

    Args:
        poses: Current estimates.
        edges: All measurements.
        groups: Who solves with whom; nobody is in two.
        third_party: See `wifipgo.graph.solve`.

    Returns:
        One optimum a group; nothing where this way does not lead down, as in a large group, or where
        measurements differ too much in their information: `wifipgo.graph.solve` knows more ways.

    Raises:
        ValueError: As `wifipgo.graph.solve`.
    """
    small = [len(group) * poses.shape[1] <= MOST_POSES for group in groups]
    return _of_chosen(poses, edges, groups, third_party, small)


def _of_chosen(
    poses: Float[np.ndarray, "robots times 3"],
    edges: Edges,
    groups: Sequence[Group],
    third_party: str,
    chosen: list[bool],
) -> list[GroupOptimum | None]:
    """Optima of some of the groups."""
    found = iter(_solved(poses, edges, [g for g, ok in zip(groups, chosen, strict=True) if ok], third_party))
    return [next(found) if ok else None for ok in chosen]


def _solved(
    poses: Float[np.ndarray, "robots times 3"], edges: Edges, groups: Sequence[Group], third_party: str
) -> list[GroupOptimum | None]:
    """Optima of groups that are small; those whose bands turn out to be wide are left out."""
    if not groups:
        return []
    problem = posed(
        poses,
        edges,
        groups=groups,
        third_party=third_party,
        told_sigma=REPORTED_SIGMA,
        start_sigma=KNOWN_START,
    )
    sq, start = squares(problem.chains, edges)
    narrow = fast(sq).tolist()
    if not all(narrow):
        return _of_chosen(poses, edges, groups, third_party, narrow)
    return _optima(poses, descended(sq, linearised(sq, start)), problem, groups)


def _optima(
    poses: Float[np.ndarray, "robots times 3"],
    found: BandedOptimum,
    problem: Problem,
    groups: Sequence[Group],
) -> list[GroupOptimum | None]:
    """What each group found, in the order of its robots."""
    times = poses.shape[1]
    first = [problem.first_key[list(group)] for group in groups]
    known = group_covariances(found.squares, found.at, [rows + times - 1 for rows in first])
    solved = put_back(poses, found.poses, problem)
    each = zip(found.searches, first, known, strict=True)
    return [
        GroupOptimum(solved[rows // times], covariance) if search.settled else None
        for search, rows, covariance in each
    ]
