"""Where a search of a graph with any keys begins; known poses are where they are known, from any start."""

from collections.abc import Callable, Mapping
from functools import partial
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from wifipgo import se2, se3
from wifipgo.errors import NumericalError
from wifipgo.graph.chordal import matrices, pose_rows, two_stage
from wifipgo.graph.first_guess import first_guess
from wifipgo.graph.losses import truncation_chi2
from wifipgo.graph.posegraph import PoseGraph
from wifipgo.graph.residuals import chi_squares
from wifipgo.graph.solvers._elimination import named
from wifipgo.graph.solvers._keyed_factors import name_of
from wifipgo.graph.subgraphs import components, held
from wifipgo.graph.team_frames import aligned_chains

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


def _frames(graph: PoseGraph, fixed: Fixed) -> Rows:
    try:
        return _placed(aligned_chains(graph), graph, fixed)
    except np.linalg.LinAlgError as error:
        raise NumericalError("frames of robots: noise of loops is singular to working precision") from error


def _placed(rows: Rows, graph: PoseGraph, fixed: Fixed) -> Rows:
    """Move each part as a whole to where its first known pose is; the other known ones go there alone."""
    space = se2 if graph.freedom == 3 else se3
    known, part = held(graph, fixed), components(graph)
    first = known[np.unique(part[known], return_index=True)[1]]
    T = space.compose(graph.poses[first], space.inverse(rows[first]))
    moved: Rows = space.compose(T[part], rows)
    moved[known] = graph.poses[known]
    return moved


def misfit(graph: PoseGraph, rows: Rows) -> float:
    """Cost of a start: squares of odometry, and logarithms of all else, of which much may be wrong."""
    with np.errstate(over="ignore", invalid="ignore"):
        chi2, limit = chi_squares(graph, rows), truncation_chi2(graph.freedom)
        total = float(np.where(graph.odometry, chi2, limit * np.log1p(chi2 / limit)).sum())
    return total if np.isfinite(total) else np.inf


STARTS: Mapping[str, Start] = MappingProxyType(
    {
        "given": Start(lambda graph, _: graph.poses, "the poses as they are"),
        "chordal": Start(_chordal, "two linear problems, see wifipgo.graph.chordal"),
        "odometry": Start(
            _odometry, "along a tree of measurements, odometry first, see wifipgo.graph.first_guess"
        ),
        "frames": Start(
            _frames,
            "robots' odometry, aligned by the loops that most agree with, see wifipgo.graph.team_frames",
        ),
    }
)
