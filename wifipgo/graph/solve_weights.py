"""Weights of relative poses in Eq. 3: true information, or the unit weights that Err has in Eq. 4."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from types import MappingProxyType

import numpy as np
from jaxtyping import Float

from wifipgo.errors import NumericalError
from wifipgo.graph.backends import Solution, Solve
from wifipgo.graph.bearings import Bearings
from wifipgo.graph.distributed import Channel
from wifipgo.graph.edges import Edges, known_to
from wifipgo.graph.outliers.methods import OutlierMethod
from wifipgo.graph.solvers import last_pose_covariances


def counted_alike(edges: Edges) -> Edges:
    """The same measurements with equal information matrices: a metre and a radian off count alike."""
    return replace(edges, sigma=np.ones_like(edges.sigma))


def with_true_weights(solve: Solve) -> Solve:
    """A back-end as it is: every measurement by its information."""
    return solve


def with_unit_weights(solve: Solve) -> Solve:
    """A back-end to which a metre and a radian off count alike, whoever measured.

    Eq. 4 has the omegas of Eq. 3; this minimises what Err_i sums. Robots know their noise all the same, so
    the covariances that they state are those of the true weights, linearised at the poses found: less than
    the error of poses under other weights really is.
    """

    def solved(
        poses: Float[np.ndarray, "robots times 3"],
        edges: Edges,
        bearings: Bearings,
        *,
        groups: Sequence[Sequence[int]],
        method: OutlierMethod,
        third_party: str,
        channels: Sequence[Channel],
    ) -> Sequence[Solution | None]:
        alike = counted_alike(edges)
        found = solve(
            poses,
            alike,
            bearings,
            groups=groups,
            method=method,
            third_party=third_party,
            channels=channels,
        )
        return [
            one and one._replace(covariances=_stated(one, poses, edges, group, third_party))
            for group, one in zip(groups, found, strict=True)
        ]

    return solved


def _stated(
    found: Solution,
    poses: Float[np.ndarray, "robots times 3"],
    edges: Edges,
    group: Sequence[int],
    third_party: str,
) -> Float[np.ndarray, "group 3 3"] | None:
    """Covariances of last poses by the true noise; none where they cannot be computed."""
    at = poses.copy()
    at[list(group)] = found.poses
    with suppress(NumericalError):  # then those before stay
        return last_pose_covariances(at, known_to(edges, group), robots=group, third_party=third_party)
    return None


SOLVE_WEIGHTS: Mapping[str, Callable[[Solve], Solve]] = MappingProxyType(
    {"information": with_true_weights, "unit": with_unit_weights}
)
