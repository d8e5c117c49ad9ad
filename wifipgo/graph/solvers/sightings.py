"""Most likely poses where robots saw each other in a direction, at a distance, or both (paper Eq. 3).

Unlike `wifipgo.graph.solvers.planar.solve`, which adds bearings to a solution by relative poses, this one
begins with the sightings: odometry may be all else that there is.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from types import MappingProxyType

import gtsam
import numpy as np
from jaxtyping import Float, Int

from wifipgo.arithmetic import harmless_underflow
from wifipgo.errors import pick
from wifipgo.graph.bearings import Bearings, select_bearings
from wifipgo.graph.edges import Edges
from wifipgo.graph.ranges import Ranges, select_ranges
from wifipgo.graph.solvers._elimination import named
from wifipgo.graph.solvers._factors import add, keys
from wifipgo.graph.solvers._gtsam_search import as_values, optimise
from wifipgo.graph.solvers._losses import geman_mcclure_of, huber
from wifipgo.graph.solvers._problem import KNOWN_START, Problem, build, name_of, posed
from wifipgo.graph.solvers.planar import put_back
from wifipgo.graph.solvers.report import Report
from wifipgo.threads import one_thread

Robust = Callable[[gtsam.noiseModel.Base], gtsam.noiseModel.Base]

SIGHTING_LOSSES: Mapping[str, Robust] = MappingProxyType(
    {"none": lambda noise: noise, "huber": huber, "geman_mcclure": geman_mcclure_of}
)


@one_thread
@harmless_underflow
def solve_sightings(
    poses: Float[np.ndarray, "robots times 3"],
    edges: Edges,
    *,
    bearings: Bearings | None = None,
    ranges: Ranges | None = None,
    robots: Sequence[int],
    loss: str = "huber",
    start_sigma: Float[np.ndarray, "#robots 2"] | tuple[float, float] = KNOWN_START,
) -> tuple[Float[np.ndarray, "robots times 3"], Report]:
    """Poses of some robots that make odometry, relative poses and sightings most likely.

    Args:
        poses: Current estimates, world frame: where the search starts.
        edges: Odometry, and relative poses if there are any; all by squares. What was measured of robots that
            do not take part is left out.
        bearings: Directions in which robots saw each other; the highest peak of each is used.
        ranges: Distances at which they did.
        robots: Who takes part.
        loss: Of sightings, one of `SIGHTING_LOSSES`. Geman-McClure's lets go of what does not fit
            where the search starts: begin it at a solution by Huber's.
        start_sigma: How well first poses are known, (m, rad), for all robots or one row each.

    Returns:
        New poses, those of other robots unchanged, and the report; it counts edges and sightings used.

    Raises:
        NumericalError: No step can be found; says at which pose and measurement.
        ValueError: As of `wifipgo.graph.solve`.
    """
    robust = pick(SIGHTING_LOSSES, loss, "loss of sightings")
    problem = posed(
        poses,
        edges,
        groups=[robots],
        third_party="ignore",
        told_sigma=KNOWN_START,
        start_sigma=start_sigma,
    )
    graph, sightings = build(problem, edges, huber=False), _sightings(bearings, ranges, problem, robust)
    add(graph, sightings)
    with named("solve_sightings", partial(name_of, problem, edges)):
        found = optimise(graph, as_values(problem.start))
    solved = poses.copy()
    solved[problem.team] = put_back(poses, found.poses, problem)
    doubt = "" if found.settled else f"cut after {found.iterations} iterations"
    chi2, used = (2.0 * found.before, 2.0 * found.after), len(problem.rows) + len(sightings)
    given = sum(len(rows) for rows in (edges, bearings, ranges) if rows is not None)
    return solved, Report(found.iterations, *chi2, used, given - used, (), None, not doubt, doubt)


def _sightings(
    bearings: Bearings | None, ranges: Ranges | None, problem: Problem, robust: Robust
) -> list[gtsam.NonlinearFactor]:
    """A factor for each bearing and each range between those who take part."""
    factors: list[gtsam.NonlinearFactor] = []
    if bearings is not None:
        rows = _inside(bearings.observer, bearings.target, bearings.azimuth_rad[:, 0], problem)
        ours = select_bearings(bearings, rows)
        directions = [gtsam.Rot2(azimuth_rad) for azimuth_rad in ours.azimuth_rad[:, 0].tolist()]
        columns = _keys(ours.observer, ours.target, problem), directions, _models(ours.sigma_rad, robust)
        factors += [
            gtsam.BearingFactorPose2(i, j, z, noise) for (i, j), z, noise in zip(*columns, strict=True)
        ]
    if ranges is not None:
        measured = select_ranges(ranges, _inside(ranges.observer, ranges.target, ranges.range_m, problem))
        ends_of = _keys(measured.observer, measured.target, problem)
        far = measured.range_m.tolist(), _models(measured.sigma_m, robust)
        factors += [
            gtsam.RangeFactorPose2(i, j, z, noise) for (i, j), z, noise in zip(ends_of, *far, strict=True)
        ]
    return factors


def _inside(
    observer: Int[np.ndarray, "rows 2"],
    target: Int[np.ndarray, "rows 2"],
    value: Float[np.ndarray, " rows"],
    problem: Problem,
) -> Int[np.ndarray, " inside"]:
    """Rows between those who take part, in an order that does not depend on that of the rows."""
    first = problem.first_key
    rows = np.flatnonzero((first[observer[:, 0]] >= 0) & (first[target[:, 0]] >= 0))
    return rows[np.lexsort((value[rows], *target[rows].T[::-1], *observer[rows].T[::-1]))]


def _keys(
    observer: Int[np.ndarray, "rows 2"], target: Int[np.ndarray, "rows 2"], problem: Problem
) -> list[tuple[int, int]]:
    """Variables of both ends."""
    return list(zip(keys(observer, problem.first_key), keys(target, problem.first_key), strict=True))


def _models(sigma: Float[np.ndarray, " rows"], robust: Robust) -> list[gtsam.noiseModel.Base]:
    """The noise of each row; equal deviations share one model."""
    models = {s: robust(gtsam.noiseModel.Isotropic.Sigma(1, s)) for s in set(sigma.tolist())}
    return [models[s] for s in sigma.tolist()]
