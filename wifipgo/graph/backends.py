"""Back-ends by name: who optimises at a rendezvous, and how.

The table stands in the graph wing, beside the configuration that names its rows: a back-end
takes arrays of poses and measurements and knows nothing of a loop or of a scenario.
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from wifipgo.errors import NumericalError
from wifipgo.graph.bearings import Bearings
from wifipgo.graph.distributed import Channel, DistributedConfig
from wifipgo.graph.distributed.simulated_team import solve_by_robots
from wifipgo.graph.edges import Edges
from wifipgo.graph.outliers.methods import OutlierMethod, gate_weights, solve_robust
from wifipgo.graph.solvers import last_pose_covariances

# Robots that solve for themselves stop when none moves further, in m.
_THRESHOLD_M = 0.01


class Solution(NamedTuple):
    """What a back-end found.

    Attributes:
        poses: Of all robots; those that take no part are as they were.
        covariances: Of the last poses of those that take part, along the axes of the world, if known.
    """

    poses: Float[np.ndarray, "robots times 3"]
    covariances: Float[np.ndarray, "group 3 3"] | None


@runtime_checkable
class Solve(Protocol):
    """Poses of robots that meet; nothing where the answer is not to be believed."""

    def __call__(
        self,
        poses: Float[np.ndarray, "robots times 3"],
        edges: Edges,
        bearings: Bearings,
        *,
        robots: Sequence[int],
        method: OutlierMethod,
        third_party: str,
        channel: Channel,
    ) -> Solution | None:
        """Solve for ``robots`` under an outlier method; ``channel`` carries and counts what is sent."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Backend:
    """One way for robots that meet to optimise (paper Eq. 3).

    Attributes:
        solve: Does it.
        sends: Whether the robots send messages while they solve, which may be lost; else they send each
            other their graphs before.
        bearings: Whether it takes directions as measurements of their own.
        meaning: In words.
    """

    solve: Solve
    sends: bool
    bearings: bool
    meaning: str


def solve_centrally(
    poses: Float[np.ndarray, "robots times 3"],
    edges: Edges,
    bearings: Bearings,
    *,
    robots: Sequence[int],
    method: OutlierMethod,
    third_party: str,
    channel: Channel,
) -> Solution | None:
    """Let one of the robots solve for all; nothing is sent meanwhile."""
    try:
        solved, report = solve_robust(
            poses,
            edges,
            bearings,
            robots=robots,
            outliers=method,
            third_party=third_party,
            covariances=True,
        )
    except NumericalError:
        return None
    return Solution(solved, report.last_pose_covariances)


def solve_separately(
    poses: Float[np.ndarray, "robots times 3"],
    edges: Edges,
    bearings: Bearings,
    *,
    robots: Sequence[int],
    method: OutlierMethod,
    third_party: str,
    channel: Channel,
) -> Solution | None:
    """Let each robot solve for its own poses; what has not converged is not believed."""
    weight = gate_weights(edges, None, method.gate, robots)
    edges = replace(edges, weight=edges.weight * weight)
    try:
        solved, report = solve_by_robots(
            poses,
            edges,
            robots=robots,
            loss=method.loss,
            third_party=third_party,
            config=DistributedConfig(threshold=_THRESHOLD_M),
            channel=channel,
        )
    except NumericalError:
        return None
    if not report.converged:
        return None
    known = None
    with suppress(NumericalError):  # then the last ones stay
        known = last_pose_covariances(solved, edges, robots=robots, third_party=third_party)
    return Solution(solved, known)


BACKENDS: Mapping[str, Backend] = MappingProxyType(
    {
        "gtsam": Backend(
            solve=solve_centrally,
            sends=False,
            bearings=True,
            meaning="one of those that meet solves for all",
        ),
        "distributed": Backend(
            solve=solve_separately,
            sends=True,
            bearings=False,
            meaning="those that meet each solve for their own poses and exchange separators",
        ),
    }
)
