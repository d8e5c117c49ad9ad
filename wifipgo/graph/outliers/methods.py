"""Outlier methods by name, and poses solved for under one of them.

A method is at most one gate, at most one loss, and bearings or none. A name joins its
parts with ``+``; ``bearing`` alone is the default, Huber on poses and bearings of their own.
A gate more is a row of `GATES`, a loss more one of `wifipgo.graph.losses.LOSSES`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from types import MappingProxyType
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float

from wifipgo.errors import pick
from wifipgo.graph.bearings import Bearings, heard_along
from wifipgo.graph.edges import Edges, select
from wifipgo.graph.losses import LOSSES
from wifipgo.graph.outliers.aoa_weights import (
    PAPER_GATE_RAD,
    PAPER_SIGMA_RAD,
    bearing,
    paper_weights,
    range_aware_weights,
)
from wifipgo.graph.outliers.pcm import consistent
from wifipgo.graph.solvers import KNOWN_START, Downweighted, Report, solve
from wifipgo.se2 import wrap_angle


@runtime_checkable
class DirectionGate(Protocol):
    """Weights of relative poses, each from the peak closest to where it was reported."""

    def __call__(
        self,
        z: Float[np.ndarray, "edges 3"],
        sigma: Float[np.ndarray, "edges 2"],
        peak_rad: Float[np.ndarray, " edges"],
        *,
        sigma_rad: float,
        gate_rad: float,
    ) -> Float[np.ndarray, " edges"]:
        """Weights in [0, 1]; see `wifipgo.graph.outliers.aoa_weights`."""


@runtime_checkable
class AgreementGate(Protocol):
    """Measurements to keep, by how far they agree with each other."""

    def __call__(self, edges: Edges, *, n_robots: int) -> Bool[np.ndarray, " edges"]:
        """Whether to keep each of the measurements, all of them known to who decides."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Gate:
    """What weighs relative poses between robots before a solve.

    Attributes:
        name: Part of a method's name, and of a report.
        by_direction: Compares each measurement, as it comes, with the direction its signal came from.
        by_agreement: Compares measurements with each other, when robots meet.
    """

    name: str
    by_direction: DirectionGate | None = None
    by_agreement: AgreementGate | None = None


def _paper(
    z: Float[np.ndarray, "edges 3"],
    sigma: Float[np.ndarray, "edges 2"],
    peak_rad: Float[np.ndarray, " edges"],
    *,
    sigma_rad: float,
    gate_rad: float,
) -> Float[np.ndarray, " edges"]:
    """Eq. 11, which knows no range."""
    return paper_weights(bearing(z), peak_rad, sigma_rad=sigma_rad, gate_rad=gate_rad)


def _range_aware(
    z: Float[np.ndarray, "edges 3"],
    sigma: Float[np.ndarray, "edges 2"],
    peak_rad: Float[np.ndarray, " edges"],
    *,
    sigma_rad: float,
    gate_rad: float,
) -> Float[np.ndarray, " edges"]:
    """Eq. 11 with a gate as wide as the direction of a good measurement is uncertain."""
    return range_aware_weights(z, sigma[:, 0], peak_rad, sigma_rad=sigma_rad, gate_rad=gate_rad)


NO_GATE = Gate(name="none")
GATES = (
    NO_GATE,
    Gate(name="paper", by_direction=_paper),
    Gate(name="range_aware", by_direction=_range_aware),
    Gate(name="pcm", by_agreement=consistent),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class OutlierMethod:
    """What guards an optimisation against outliers.

    Attributes:
        gate: What weighs relative poses between robots beforehand.
        loss: Of all relative poses but odometry; a name in `wifipgo.graph.losses.LOSSES`.
        bearings: Whether directions of arrival are measurements of their own.
    """

    gate: Gate = NO_GATE
    loss: str = "none"
    bearings: bool = False

    @property
    def by_direction(self) -> bool:
        """Whether the gate judges each measurement by itself, as it comes."""
        return self.gate.by_direction is not None

    @property
    def listens(self) -> bool:
        """Whether directions of arrival are needed."""
        return self.bearings or self.by_direction

    @property
    def incremental(self) -> bool:
        """Whether a solution can grow with the measurements instead of being searched anew."""
        return self.gate.by_agreement is None and LOSSES[self.loss].incremental

    def at_rendezvous(self) -> "OutlierMethod":
        """What is left to do when robots meet: a gate on direction weighed measurements as they came."""
        return replace(self, gate=NO_GATE) if self.by_direction else self


def _methods() -> dict[str, OutlierMethod]:
    """All combinations of gates, losses and bearings by name."""
    found = {"bearing": OutlierMethod(loss="huber", bearings=True)}
    for gate, loss, bearings in product(GATES, LOSSES, (False, True)):
        parts = [part for part in (gate.name, loss) if part != "none"] + ["bearing"] * bearings
        found.setdefault("+".join(parts) or "none", OutlierMethod(gate=gate, loss=loss, bearings=bearings))
    return found


OUTLIER_METHODS: Mapping[str, OutlierMethod] = MappingProxyType(_methods())


def direction_weights(
    z: Float[np.ndarray, "edges 3"],
    sigma: Float[np.ndarray, "edges 2"],
    peaks_rad: Float[np.ndarray, "edges peaks"],
    *,
    gate: Gate,
    sigma_rad: float = PAPER_SIGMA_RAD,
    gate_rad: float = PAPER_GATE_RAD,
) -> Float[np.ndarray, " edges"]:
    """Weights of relative poses by a gate on direction, from the peak closest to each (Eq. 10); else 1."""
    if gate.by_direction is None:
        return np.ones(len(z))
    away = np.abs(wrap_angle(peaks_rad - bearing(z)[:, None]))
    closest = np.take_along_axis(peaks_rad, away.argmin(axis=1)[:, None], axis=1)[:, 0]
    return gate.by_direction(z, sigma, closest, sigma_rad=sigma_rad, gate_rad=gate_rad)


def solve_robust(
    poses: Float[np.ndarray, "robots times 3"],
    edges: Edges,
    bearings: Bearings | None = None,
    *,
    robots: Sequence[int],
    outliers: str | OutlierMethod = "bearing",
    third_party: str = "fixed_told",
    start_sigma: Float[np.ndarray, "#robots 2"] | tuple[float, float] = KNOWN_START,
    covariances: bool = False,
) -> tuple[Float[np.ndarray, "robots times 3"], Report]:
    """Solve (Eq. 3) under an outlier method.

    Args:
        poses: See `wifipgo.graph.solve`, as for all that is not named here.
        edges: All measurements; a gate multiplies their weights.
        bearings: Directions of arrival. A relative pose whose tail did not hear its head passes a gate
            on direction; a method that does without directions ignores them.
        robots: Who takes part.
        outliers: A name in `OUTLIER_METHODS`, or a combination of one's own.
        third_party: What an edge to a robot outside does.
        start_sigma: How well first poses are known.
        covariances: Whether the report has those of the last poses.

    Returns:
        New poses, and the report, which names the rows that the gate or the loss weighed down.

    Raises:
        ValueError: The method is unknown, or `wifipgo.graph.solve` refuses.
    """
    guard = pick(OUTLIER_METHODS, outliers, "outlier method") if isinstance(outliers, str) else outliers
    weight = gate_weights(edges, bearings, guard.gate, robots)
    solved, report = solve(
        poses,
        replace(edges, weight=edges.weight * weight),
        robots=robots,
        third_party=third_party,
        loss=guard.loss,
        bearings=bearings if guard.bearings else None,
        start_sigma=start_sigma,
        covariances=covariances,
        initial="near",
    )
    low = np.flatnonzero(weight < 1.0)
    gated = (Downweighted(guard.gate.name, low, weight[low]),) if len(low) else ()
    return solved, report._replace(downweighted=gated + report.downweighted)


def gate_weights(
    edges: Edges, bearings: Bearings | None, gate: Gate, robots: Sequence[int]
) -> Float[np.ndarray, " edges"]:
    """Weight of each edge by the gate; agreement knows of nothing outside the robots that take part."""
    weight = np.ones(len(edges))
    if gate.by_agreement is not None:
        inside = np.isin(edges.tail[:, 0], robots) & np.isin(edges.head[:, 0], robots)
        weight[inside] = gate.by_agreement(select(edges, inside), n_robots=1 + max(robots))
    if gate.by_direction is not None and bearings is not None:
        row = heard_along(edges, bearings)
        rows, edge = row[row >= 0], np.flatnonzero(row >= 0)
        z, sigma, peaks_rad = edges.z[edge], edges.sigma[edge], bearings.azimuth_rad[rows]
        weight[edge] *= direction_weights(z, sigma, peaks_rad, gate=gate)
    return weight
