"""Where a search of a graph with any keys begins; known poses are where they are known, from any start."""

from collections.abc import Callable, Mapping
from functools import partial
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from wifipgo import se2, se3
from wifipgo.graph.chordal import matrices, pose_rows, two_stage
from wifipgo.graph.first_guess import first_guess
from wifipgo.graph.posegraph import PoseGraph
from wifipgo.graph.solvers._elimination import named
from wifipgo.graph.solvers._keyed_factors import name_of
from wifipgo.graph.subgraphs import components, held

Rows = Float[np.ndarray, "poses dims"]
Fixed = Int[np.ndarray, " fixed"] | None


class Start(NamedTuple):
    """What is made of a graph and its poses before a search, and what that is in words."""

    rows: Callable[[PoseGraph, Fixed], Rows]
    meaning: str


def _chordal(graph: PoseGraph, fixed: Fixed) -> Rows:
    with named("chordal start", partial(name_of, graph)):
        return pose_rows(two_stage(graph, matrices(graph.poses), fixed))


def _odometry(graph: PoseGraph, fixed: Fixed) -> Rows:
    return _placed(first_guess(graph), graph, fixed)


def _placed(rows: Rows, graph: PoseGraph, fixed: Fixed) -> Rows:
    """Move each part as a whole to where its first known pose is; the other known ones go there alone."""
    space = se2 if graph.freedom == 3 else se3
    known, part = held(graph, fixed), components(graph)
    first = known[np.unique(part[known], return_index=True)[1]]
    T = space.compose(graph.poses[first], space.inverse(rows[first]))
    moved: Rows = space.compose(T[part], rows)
    moved[known] = graph.poses[known]
    return moved


STARTS: Mapping[str, Start] = MappingProxyType(
    {
        "given": Start(lambda graph, _: graph.poses, "the poses as they are"),
        "chordal": Start(_chordal, "two linear problems, see wifipgo.graph.chordal"),
        "odometry": Start(
            _odometry, "along a tree of measurements, odometry first, see wifipgo.graph.first_guess"
        ),
    }
)
