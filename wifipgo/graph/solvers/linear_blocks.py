"""Measurements of a graph with any keys, linearised: what each says of its two poses, in sigmas."""

from typing import NamedTuple

import gtsam
import numpy as np
from jaxtyping import Float, Int

from wifipgo import se2, se3
from wifipgo.graph.posegraph import PoseGraph
from wifipgo.graph.solvers._keyed_factors import ORDER, factors_of, values_of


class LinearBlocks(NamedTuple):
    """Rows ``J_tail d_tail + J_head d_head = off`` of measurements of positive weight.

    Unknowns are twists in each pose's own axes, translation first.

    Attributes:
        tail: Row of the pose at the tail of each.
        head: Row of the pose at its head.
        J_tail: Slope over the tail's twist.
        J_head: Slope over the head's twist.
        off: What is to be gained.
    """

    tail: Int[np.ndarray, " links"]
    head: Int[np.ndarray, " links"]
    J_tail: Float[np.ndarray, "links d d"]
    J_head: Float[np.ndarray, "links d d"]
    off: Float[np.ndarray, "links d"]


def linear_blocks(graph: PoseGraph, rows: Float[np.ndarray, "poses dims"]) -> LinearBlocks:
    """Gtsam's slopes at ``rows``."""
    d, order = graph.freedom, np.argsort(ORDER[graph.freedom])
    factors, used = factors_of(graph, rows, None, huber=False)
    linear = factors.linearize(values_of(rows))
    first = linear.size() - len(used)
    both = [_jacobian(linear.at(first + k)) for k in range(len(used))]
    J = np.array([A for A, _ in both]).reshape(len(used), d, 2, d)[..., order]
    off = np.array([b for _, b in both]).reshape(len(used), d)
    return LinearBlocks(graph.tail[used], graph.head[used], J[:, :, 0], J[:, :, 1], off)


def _jacobian(factor: gtsam.GaussianFactor) -> tuple[np.ndarray, np.ndarray]:
    A, b = factor.jacobian()
    return A, b


def stepped(
    rows: Float[np.ndarray, "poses dims"], twist: Float[np.ndarray, "poses d"]
) -> Float[np.ndarray, "poses dims"]:
    """Poses after a twist in the axes of each."""
    space = se2 if rows.shape[1] == 3 else se3
    moved: np.ndarray = space.compose(rows, space.exp(twist))
    return moved
