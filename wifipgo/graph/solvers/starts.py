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

SAME_OPTIMUM = 1e-4  # of a cost
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
    return first_guess(graph, held(graph, fixed))


def _frames(graph: PoseGraph, fixed: Fixed) -> Rows:
    try:
        rows = _placed(aligned_chains(graph), graph, held(graph, fixed), components(graph))
    except np.linalg.LinAlgError as error:
        raise NumericalError("frames of robots: noise of loops is singular to working precision") from error
    return rows if fixed is None else _placed(rows, graph, fixed, graph.robot)


def _placed(
    rows: Rows, graph: PoseGraph, known: Int[np.ndarray, " known"], part: Int[np.ndarray, " poses"]
) -> Rows:
    """Move each part as a whole to where its first known pose is; the other known ones go there alone."""
    space, moved = se2 if graph.freedom == 3 else se3, rows.copy()
    names, first = np.unique(part[known], return_index=True)
    T = space.compose(graph.poses[known[first]], space.inverse(rows[known[first]]))
    inside = np.isin(part, names)
    moved[inside] = space.compose(T[np.searchsorted(names, part[inside])], rows[inside])
    moved[known] = graph.poses[known]
    return moved


def misfit(graph: PoseGraph, rows: Rows) -> float:
    """Cost of a start: squares of odometry, and logarithms of all else, of which much may be wrong."""
    with np.errstate(over="ignore", invalid="ignore"):
        chi2, limit = chi_squares(graph, rows), truncation_chi2(graph.freedom)
        total = float(np.where(graph.odometry, chi2, limit * np.log1p(chi2 / limit)).sum())
    return total if np.isfinite(total) else np.inf


def of_robots(graph: PoseGraph, fixed: Fixed = None, *, graduated: bool = False) -> Rows:
    """Where robots begin that solve by themselves: poses as given, or their odometry, which fits better.

    Under a loss that lets measurements go their frames are first aligned by votes, see `STARTS`.
    """
    try:
        own = STARTS["frames" if graduated and graph.between_robots.any() else "odometry"].rows(graph, fixed)
    except NumericalError:
        return graph.poses
    return own if misfit(graph, own) < misfit(graph, graph.poses) else graph.poses


def same(a: float, b: float) -> bool:
    """Whether two searches that ended at these costs have found the same minimum."""
    return abs(a - b) <= SAME_OPTIMUM * (min(abs(a), abs(b)) + SAME_OPTIMUM)


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
