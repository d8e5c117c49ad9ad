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
from wifipgo.graph.distributed.two_level import TwoLevelConfig
from wifipgo.graph.edges import Edges, known_to
from wifipgo.graph.outliers.methods import OutlierMethod, gate_weights, solve_robust
from wifipgo.graph.solvers import last_pose_covariances
from wifipgo.graph.solvers.groups import solve_groups

# Robots that solve for themselves stop when none moves further, in m.
_THRESHOLD_M = 0.01


class Solution(NamedTuple):
    """What a back-end found for a group.

    Attributes:
        poses: Of those that take part, in the order in which they were named.
        covariances: Of their last poses, along the axes of the world, if known.
    """

    poses: Float[np.ndarray, "group times 3"]
    covariances: Float[np.ndarray, "group 3 3"] | None


@runtime_checkable
class Solve(Protocol):
    """Poses of robots that meet, group by group; nothing where an answer is not to be believed."""

    def __call__(
        self,
        poses: Float[np.ndarray, "robots times 3"],
        edges: Edges,
        bearings: Bearings,
        *,
        groups: Sequence[Sequence[int]],
        method: OutlierMethod,
        third_party: str,
        channels: Sequence[Channel],
    ) -> Sequence[Solution | None]:
        """Solve for groups under an outlier method; nobody is in two, so none depends on another.

        A channel a group carries and counts what is sent.
        """


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
    groups: Sequence[Sequence[int]],
    method: OutlierMethod,
    third_party: str,
    channels: Sequence[Channel],
) -> Sequence[Solution | None]:
    """Let one robot of each group solve for all of it; nothing is sent meanwhile.

    Plain squares of all groups are one system.
    """
    found: Sequence[Solution | None] = [None] * len(groups)
    if method == OutlierMethod():
        optima = solve_groups(poses, edges, groups=groups, third_party=third_party)
        found = [low and Solution(*low) for low in optima]
    return [
        one
        or _searched(
            poses, known_to(edges, group), bearings, group=group, method=method, third_party=third_party
        )
        for one, group in zip(found, groups, strict=True)
    ]


def _searched(
    poses: Float[np.ndarray, "robots times 3"],
    edges: Edges,
    bearings: Bearings,
    *,
    group: Sequence[int],
    method: OutlierMethod,
    third_party: str,
) -> Solution | None:
    """One group's optimum under any method."""
    try:
        solved, report = solve_robust(
            poses,
            edges,
            bearings,
            robots=group,
            outliers=method,
            third_party=third_party,
            covariances=True,
        )
    except NumericalError:
        return None
    return Solution(solved[list(group)], report.last_pose_covariances)


def by_robots(config: DistributedConfig | TwoLevelConfig) -> Solve:
    """Let each robot solve for its own poses; what has not converged is not believed."""

    def solve_separately(
        poses: Float[np.ndarray, "robots times 3"],
        edges: Edges,
        bearings: Bearings,
        *,
        groups: Sequence[Sequence[int]],
        method: OutlierMethod,
        third_party: str,
        channels: Sequence[Channel],
    ) -> Sequence[Solution | None]:
        return [
            _agreed(
                poses,
                known_to(edges, group),
                group=group,
                method=method,
                third_party=third_party,
                by=(config, channel),
            )
            for group, channel in zip(groups, channels, strict=True)
        ]

    return solve_separately


def _agreed(
    poses: Float[np.ndarray, "robots times 3"],
    edges: Edges,
    *,
    group: Sequence[int],
    method: OutlierMethod,
    third_party: str,
    by: tuple[DistributedConfig | TwoLevelConfig, Channel],
) -> Solution | None:
    """What the robots of one group agree on."""
    edges = replace(edges, weight=edges.weight * gate_weights(edges, None, method.gate, group))
    try:
        solved, report = solve_by_robots(
            poses,
            edges,
            robots=group,
            loss=method.loss,
            third_party=third_party,
            config=by[0],
            channel=by[1],
        )
    except NumericalError:
        return None
    if not report.converged:
        return None
    known = None
    with suppress(NumericalError):  # then the last ones stay
        known = last_pose_covariances(solved, edges, robots=group, third_party=third_party)
    return Solution(solved[list(group)], known)


BACKENDS: Mapping[str, Backend] = MappingProxyType(
    {
        "gtsam": Backend(
            solve=solve_centrally,
            sends=False,
            bearings=True,
            meaning="one of those that meet solves for all",
        ),
        "distributed": Backend(
            solve=by_robots(DistributedConfig(threshold=_THRESHOLD_M)),
            sends=True,
            bearings=False,
            meaning="those that meet each solve for their own poses and exchange separators",
        ),
        "two_level": Backend(
            solve=by_robots(TwoLevelConfig()),
            sends=True,
            bearings=False,
            meaning="as distributed, by conjugate gradients: the same optimum as gtsam's, in fewer rounds",
        ),
    }
)
