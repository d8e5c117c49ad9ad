"""What an optimisation did, and the table that the command prints of it."""

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from wifipgo.errors import require
from wifipgo.graph.accuracy import aligned, rmse_rot, rmse_trans
from wifipgo.graph.chordal import chordal_cost, links, matrices
from wifipgo.graph.files.g2o import Reading
from wifipgo.graph.posegraph import PoseGraph
from wifipgo.graph.residuals import chi_squares
from wifipgo.graph.solvers.spatial import FULL_WEIGHT
from wifipgo.graph.subgraphs import components

STEPS: Mapping[str, str] = MappingProxyType(
    {"gtsam": "iterations", "distributed": "rounds", "two_level": "rounds"}
)

# Row of the table, and above which value of it noise is no explanation.
PER_FREEDOM, _MUCH = "chi-square per degree of freedom", 10.0
_NOBODY: Mapping[int, float] = {}  # a plain table, which can go from process to process


class Gated(NamedTuple):
    """What a gate left of each measurement before the search, and what it says of itself.

    Attributes:
        weight: Of each measurement.
        unproven: Pairs of robots of whose measurements PCM may have kept fewer than it could.
        heard: Measurements for which a direction was known.
    """

    weight: Float[np.ndarray, " edges"]
    unproven: tuple[tuple[int, int], ...] = ()
    heard: int = 0


class Outcome(NamedTuple):
    """What an optimisation did. Errors are half the chi-square, as gtsam counts, costs are chordal.

    Attributes:
        poses: Optimised rows.
        weight: What the robust method left of each measurement's information.
        steps: Iterations of the search, or rounds of each stage.
        converged: Whether it ended because there was nothing to gain, here or from another start.
        bytes_sent: Between robots; none with one computer.
        seconds: Without reading and writing.
        doubt: What speaks against the result, in a sentence; nothing if it has converged.
        gated: What a gate did before.
        sve: Disagreement of robots on poses that several hold, m and rad; zero with one computer, nothing
            where the method does not tell.
        seconds_each: That each robot computed, by its number; with one computer nobody's.
    """

    poses: Float[np.ndarray, "poses dims"]
    weight: Float[np.ndarray, " edges"]
    steps: tuple[int, ...]
    converged: bool
    bytes_sent: int
    seconds: float
    doubt: str
    gated: Gated
    sve: tuple[float, float] | None = (0.0, 0.0)
    seconds_each: Mapping[int, float] = _NOBODY


def figures(reading: Reading, outcome: Outcome, *, backend: str, robust: str) -> dict[str, object]:
    """What the table shows, by name; the errors are of the measurements as they were given."""
    graph = reading.graph
    part, edges = components(graph), links(graph)
    return {
        "backend": backend,
        "robust": robust,
        "robots": len(graph.robots),
        "poses": len(graph.poses),
        "edges": len(graph.tail),
        "edges between robots": int(graph.between_robots.sum()),
        "components": int(part.max()) + 1,
        "poses outside the largest": len(part) - int(np.bincount(part).max()),
        **_errors(reading, outcome, part),
        "chordal cost before": chordal_cost(matrices(graph.poses), edges),
        "chordal cost after": chordal_cost(matrices(outcome.poses), edges),
        **_moved(outcome.poses, graph),
        "edges weighed down": int((outcome.weight < FULL_WEIGHT).sum()),
        STEPS[backend]: sum(outcome.steps),
        "bytes sent": outcome.bytes_sent,
        "converged": outcome.converged,
        "disagreement on shared poses, m": outcome.sve[0] if outcome.sve else {},
        "disagreement on shared poses, deg": float(np.rad2deg(outcome.sve[1])) if outcome.sve else {},
        "PCM not proven largest": outcome.gated.unproven or {},
        "edges with a direction": outcome.gated.heard or {},
        "seconds": outcome.seconds,
        "seconds of the busiest robot": max(outcome.seconds_each.values(), default={}),
        **_of_files(reading),
    }


def _errors(reading: Reading, outcome: Outcome, part: Int[np.ndarray, " poses"]) -> dict[str, object]:
    """Half the chi-squares before and after, and that of what was believed per degree of freedom.

    That is near 1 where noise is what was stated. A measurement counts as much as the robust method left of
    it; each part of the graph has a pose that is held, if no other is.
    """
    graph, weight = reading.graph, outcome.weight
    squares = chi_squares(graph.with_weight(graph.weight * weight), outcome.poses).sum()
    n_free = len(part) - len(reading.fixed) - (int(part.max()) + 1 - len(np.unique(part[reading.fixed])))
    freedoms = graph.information.shape[-1] * (float(weight[graph.weight > 0.0].sum()) - n_free)
    return {
        "error before": 0.5 * float(chi_squares(graph, graph.poses).sum()),
        "error after": 0.5 * float(chi_squares(graph, outcome.poses).sum()),
        "error after, weighed": 0.5 * float(squares),
        PER_FREEDOM: float(squares) / freedoms if freedoms >= 1.0 else {},
    }


def contradiction(table: Mapping[str, object]) -> str:
    """What a fit says that no noise explains, where nothing guards against outliers; else nothing."""
    found = table[PER_FREEDOM]
    if table["robust"] != "none" or not isinstance(found, float) or found < _MUCH:
        return ""
    return (
        f"measurements contradict each other: chi-square {found:.3g} per degree of freedom, where noise as "
        "it is stated gives 1: outliers (try --robust gnc), or noise that is larger"
    )


def _of_files(reading: Reading) -> dict[str, object]:
    """What the files were, and what of them plays no part."""
    return {
        "format": reading.format,
        "poses known by FIX": len(reading.fixed),
        "first poses": "from the measurements, the files have none" if reading.guessed else "of the files",
        "lines of landmarks, kept as they are": len(reading.landmarks),
        "files of no robot": ", ".join(reading.left_out) or "none",
        "lines skipped": reading.skipped,
    }


def _moved(poses: Float[np.ndarray, "poses dims"], graph: PoseGraph) -> dict[str, object]:
    """How far poses moved from those of the graph, all of them aligned as one rigid body."""
    fitted = aligned(poses, graph.poses)
    return {
        "moved in shape, RMS m": float(rmse_trans(fitted, graph.poses)[0]),
        "moved in shape, RMS deg": float(np.rad2deg(rmse_rot(fitted, graph.poses)[0])),
    }


def check_heard(outcome: Outcome, bearings: Path | None) -> None:
    """Refuse directions none of which is between poses that a measurement is between."""
    rule = "directions between poses that a measurement is between"
    require(bearings is None or outcome.gated.heard > 0, "bearings", rule, str(bearings))


def seconds_each(outcome: Outcome) -> dict[str, object]:
    """What the report has of each robot's computing."""
    return {"seconds by robot": {str(robot): spent for robot, spent in outcome.seconds_each.items()}}
