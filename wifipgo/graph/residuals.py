"""How far measurements of a graph with any keys disagree with its poses."""

import numpy as np
from jaxtyping import Float

from wifipgo import se2, se3
from wifipgo.arithmetic import harmless_underflow
from wifipgo.graph.posegraph import PoseGraph


@harmless_underflow
def tangent_errors(
    graph: PoseGraph, poses: Float[np.ndarray, "poses dims"]
) -> Float[np.ndarray, "edges freedom"]:
    """Residuals ``Log(z^-1 T_i^-1 T_j)``, translation (m) first, then rotation (rad).

    In the plane too the logarithm is the full one, as in gtsam's factors.
    """
    between = se2.between if graph.freedom == 3 else se3.between
    return tangent_difference(graph.z, between(poses[graph.tail], poses[graph.head]))


def tangent_difference(
    T_a_b: Float[np.ndarray, "n dims"], T_a_c: Float[np.ndarray, "n dims"]
) -> Float[np.ndarray, "n freedom"]:
    """``Log(T_a_b^-1 T_a_c)``: how far c is from b, in b's frame."""
    if T_a_b.shape[1] == 3:
        return se2.log(se2.between(T_a_b, T_a_c))
    return se3.log(se3.between(T_a_b, T_a_c))


@harmless_underflow
def chi_squares(graph: PoseGraph, poses: Float[np.ndarray, "poses dims"]) -> Float[np.ndarray, " edges"]:
    """Squared residual of each measurement in units of its noise, times its weight.

    The sum is twice what gtsam calls the error of the graph.
    """
    off = tangent_errors(graph, poses)
    return graph.weight * np.einsum("ea,eab,eb->e", off, graph.information, off)
