"""Gates on direction (paper Eqs. 7 to 11) for graphs with any keys, in the plane or in space."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from wifipgo import se2, se3
from wifipgo.graph.bearings import Bearings
from wifipgo.graph.outliers.methods import Gate, direction_weights
from wifipgo.graph.posegraph import PoseGraph, keys_of


class Heard(NamedTuple):
    """Measurements between robots one of which heard the other.

    Attributes:
        edge: Rows of these measurements.
        bearing: Row of the direction that belongs to each.
        z: What was measured, seen by the robot that heard.
    """

    edge: Int[np.ndarray, " heard"]
    bearing: Int[np.ndarray, " heard"]
    z: Float[np.ndarray, "heard dims"]


def graph_direction_weights(
    graph: PoseGraph, bearings: Bearings, gate: Gate
) -> tuple[Float[np.ndarray, " edges"], int]:
    """Weight of each measurement by a gate on direction, and of how many a direction is known.

    The azimuth is that in the plane of the robot that heard. What nobody heard passes.

    Args:
        graph: Poses and measurements.
        bearings: Directions between poses of the graph.
        gate: A row of `wifipgo.graph.outliers.methods.GATES`.
    """
    heard = _heard(graph, bearings)
    variance = np.diagonal(np.linalg.inv(graph.information[heard.edge]), axis1=1, axis2=2)
    sigma_m = np.sqrt(variance[:, :2].mean(axis=1))
    sigma = np.stack([sigma_m, sigma_m], axis=1)
    z = heard.z[:, :3] if graph.freedom == 3 else se3.project(heard.z)
    weight = np.ones(len(graph.tail))
    peaks_rad = bearings.azimuth_rad[heard.bearing]
    weight[heard.edge] = direction_weights(z, sigma, peaks_rad, gate=gate)
    return weight, len(heard.edge)


def _heard(graph: PoseGraph, bearings: Bearings) -> Heard:
    """Measurements with a direction: of the head from the tail or, without one, the other way."""
    place = [tuple(key) for key in keys_of(graph).tolist()]
    of = {
        (tuple(observer), tuple(target)): row
        for row, (observer, target) in enumerate(
            zip(bearings.observer.tolist(), bearings.target.tolist(), strict=True)
        )
    }
    ends = [(place[i], place[j]) for i, j in zip(graph.tail.tolist(), graph.head.tolist(), strict=True)]
    forth = np.array([of.get((i, j), -1) for i, j in ends], dtype=np.int64)
    back = np.array([of.get((j, i), -1) for i, j in ends], dtype=np.int64)
    edge = np.flatnonzero((forth >= 0) | (back >= 0))
    inverse = (se2 if graph.freedom == 3 else se3).inverse
    turned = np.where((forth >= 0)[edge, None], graph.z[edge], inverse(graph.z[edge]))
    return Heard(edge, np.where(forth >= 0, forth, back)[edge], turned)
