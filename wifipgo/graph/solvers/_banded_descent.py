"""Gauss-Newton on groups whose normal equations are narrow bands, side by side."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Complex, Float, Int
from scipy.linalg import lapack

from wifipgo.graph.edges import Edges
from wifipgo.graph.solvers._banded_cholesky import (
    Linearisation,
    Slopes,
    cholesky,
    gradient,
    group_covariances,
    linearised,
    normal_equations,
    rows_of,
    slopes,
)
from wifipgo.graph.solvers._gauss_newton import Descent, SingularError
from wifipgo.graph.solvers._linearised import Poses, Squares, squares
from wifipgo.graph.solvers._problem import Problem
from wifipgo.se2 import left_jacobian_times

WIDEST = 4e7  # unknowns times squared width: beyond, gtsam's order of elimination is faster
MOST_POSES = 1000  # more are never narrow enough


class Factors(NamedTuple):
    """Cholesky's factors of each group's normal equations, and the headings where they hold."""

    bands: list[Float[np.ndarray, "_ _"] | None]
    yaw_rad: Float[np.ndarray, " poses"]


class BandedOptimum(NamedTuple):
    """Where searches ended, how each did, and half the chi-squares before: one a group."""

    squares: Squares
    at: Linearisation
    searches: tuple[Descent, ...]
    errors_before: Float[np.ndarray, " groups"]

    @property
    def iterations(self) -> int:
        """Steps of the only group."""
        return self.searches[0].steps

    @property
    def before(self) -> float:
        """Half the chi-square of the only group where its search began."""
        return float(self.errors_before[0])

    @property
    def after(self) -> float:
        """Half the chi-square of the only group where its search ended."""
        return float(self.at.error[0])

    @property
    def settled(self) -> bool:
        """Whether the only group's search ended at the bottom."""
        return self.searches[0].settled

    @property
    def poses(self) -> Float[np.ndarray, "poses 3"]:
        """Poses in the order of the problem."""
        return rows_of(self.squares, self.at.poses)

    def covariances(self, rows: Int[np.ndarray, " some"]) -> Float[np.ndarray, "some 3 3"]:
        """Covariances of some poses of the only group, along the axes of the world.

        Raises:
            SingularError: Measurements do not say where a pose is, to working precision.
        """
        (found,) = group_covariances(self.squares, self.at, [rows])
        if found is None:
            raise SingularError
        return found


def start_of(problem: Problem, edges: Edges) -> tuple[Squares, Linearisation] | None:
    """A problem where its search starts; nothing where a band is too wide to be fast."""
    if len(problem.start) > MOST_POSES:
        return None
    sq, poses = squares(problem, edges)
    return (sq, linearised(sq, poses)) if fast(sq).all() else None


def fast(sq: Squares) -> Bool[np.ndarray, " groups"]:
    """Which groups have bands so narrow that gtsam's order of elimination is not faster."""
    n_poses = np.diff(sq.blocks.begin)
    return (n_poses <= MOST_POSES) & (3.0 * n_poses * sq.blocks.below**2 <= WIDEST)


def banded_optimum(problem: Problem, edges: Edges) -> BandedOptimum | None:
    """Least squares; nothing where the band is too wide, or where Gauss-Newton does not come down."""
    begin = start_of(problem, edges)
    found = begin and descended(*begin)
    return found if found and found.settled else None


def descended(sq: Squares, start: Linearisation) -> BandedOptimum:
    """Go down in all groups at once, in each until its own search ends."""
    searches = tuple(Descent() for _ in range(len(sq.blocks)))
    factors, at = Factors([None] * len(searches), start.poses.yaw_rad[: len(sq.order)].copy()), start
    while moving := [g for g, search in enumerate(searches) if not search.ended]:
        stepped = _stepped(sq, at, factors, searches)
        errors = np.stack([at.error, stepped.error], axis=1).tolist()
        stay = [g for g in moving if searches[g].ended or not searches[g].judge(*errors[g])]
        at = _kept(sq, at, stepped, stay) if stay else stepped
    return BandedOptimum(sq, at, searches, start.error)


def _kept(sq: Squares, at: Linearisation, stepped: Linearisation, stay: list[int]) -> Linearisation:
    """Where some groups stay and the others go."""
    if len(stay) == len(sq.blocks):
        return at
    p_m, yaw_rad = stepped.poses.p_m.copy(), stepped.poses.yaw_rad.copy()
    for group in stay:
        own = sq.blocks.poses(group)
        p_m[own], yaw_rad[own] = at.poses.p_m[own], at.poses.yaw_rad[own]
    return linearised(sq, Poses(p_m, yaw_rad))


def _stepped(sq: Squares, at: Linearisation, factors: Factors, searches: Sequence[Descent]) -> Linearisation:
    """A step of each group that has not ended, by factors that serve again or by new ones.

    Each pose goes along an arc. Factors of a system nearby are taken along with the poses: they hold in
    the axes of each.
    """
    slope, n = slopes(sq, at), len(sq.order)
    pull = gradient(sq, at, slope).reshape(-1, 3)
    _factor_anew(sq, at, slope, factors, searches)
    reused = any(search.reuses and not search.ended for search in searches)
    turned = np.exp(1j * (at.poses.yaw_rad[:n] - factors.yaw_rad)) if reused else None
    if turned is not None:
        _rotate(pull, turned.conj())
    down = _solved(sq, factors, pull, searches)
    if turned is not None:
        _rotate(down, turned)
    p_m, yaw_rad = at.poses.p_m.copy(), at.poses.yaw_rad.copy()
    p_m[:n] -= left_jacobian_times(-down[:, 2], down[:, 0] + 1j * down[:, 1])
    yaw_rad[:n] -= down[:, 2]
    return linearised(sq, Poses(p_m, yaw_rad))


def _factor_anew(
    sq: Squares, at: Linearisation, slope: Slopes, factors: Factors, searches: Sequence[Descent]
) -> None:
    """Replace factors that do not serve again, in place; a search ends where there are none."""
    anew = [g for g, search in enumerate(searches) if not (search.ended or search.reuses)]
    bands = normal_equations(sq, at, slope) if anew else []
    for group in anew:
        own = sq.blocks.poses(group)
        factors.yaw_rad[own] = at.poses.yaw_rad[own]
        try:
            factors.bands[group] = cholesky(bands[group])
        except SingularError:
            searches[group].give_up()


def _solved(
    sq: Squares, factors: Factors, pull: Float[np.ndarray, "poses 3"], searches: Sequence[Descent]
) -> Float[np.ndarray, "poses 3"]:
    """Steps of groups whose search goes on; others stand still."""
    down, right = np.zeros_like(pull), pull.reshape(-1)
    for group, (band, search) in enumerate(zip(factors.bands, searches, strict=True)):
        if not search.ended:
            poses = sq.blocks.poses(group)
            own = right[3 * poses.start : 3 * poses.stop]
            down[poses] = lapack.dpbtrs(band, own, lower=1, overwrite_b=1)[0].reshape(-1, 3)
    return down


def _rotate(rows: Float[np.ndarray, "poses 3"], turn: Complex[np.ndarray, " poses"]) -> None:
    """Turn the positions of some rows, in place."""
    xy = (rows[:, 0] + 1j * rows[:, 1]) * turn
    rows[:, 0], rows[:, 1] = xy.real, xy.imag
