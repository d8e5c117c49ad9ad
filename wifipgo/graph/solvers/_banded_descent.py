"""Gauss-Newton on groups whose normal equations are narrow bands, side by side."""

from collections.abc import Sequence
from itertools import pairwise
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
NEW = Descent()


class Factors(NamedTuple):
    """Cholesky's factors of each group's normal equations, and the headings where they hold."""

    bands: list[Float[np.ndarray, "_ _"] | None]
    yaw_rad: Float[np.ndarray, " poses"]


class BandedOptimum(NamedTuple):
    """Where searches ended, by which factors, how each did, and half the chi-squares before: one a group."""

    squares: Squares
    at: Linearisation
    factors: Factors
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
    sq, poses = squares(problem.chains, edges)
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


def descended(sq: Squares, start: Linearisation, rule: Descent = NEW) -> BandedOptimum:
    """Go down in all groups at once, in each until its own search ends; all begin with the same rule."""
    searches = tuple(rule.again() for _ in sq.blocks.below)
    factors, at = Factors([None] * len(searches), start.poses.yaw_rad[: len(sq.order)].copy()), start
    while moving := [g for g, search in enumerate(searches) if not search.ended]:
        stepped, foreseen = _stepped(sq, at, factors, searches)
        falls = list(zip(at.error.tolist(), stepped.error.tolist(), foreseen.tolist(), strict=True))
        stay = [g for g in moving if searches[g].ended or not searches[g].judge(*falls[g])]
        at = _kept(sq, at, stepped, stay) if stay else stepped
    return BandedOptimum(sq, at, factors, searches, start.error)


def _kept(sq: Squares, at: Linearisation, stepped: Linearisation, stay: list[int]) -> Linearisation:
    """Where some groups stay and the others go."""
    if len(stay) == len(sq.blocks):
        return at
    p_m, yaw_rad = stepped.poses.p_m.copy(), stepped.poses.yaw_rad.copy()
    for group in stay:
        own = sq.blocks.poses(group)
        p_m[own], yaw_rad[own] = at.poses.p_m[own], at.poses.yaw_rad[own]
    return linearised(sq, Poses(p_m, yaw_rad))


def _stepped(
    sq: Squares, at: Linearisation, factors: Factors, searches: Sequence[Descent]
) -> tuple[Linearisation, Float[np.ndarray, " groups"]]:
    """A step of each group that has not ended, by factors that serve again or by new ones.

    Each pose goes along an arc. Factors of a system nearby are taken along with the poses: they hold in
    the axes of each.

    Returns:
        Where it leads, and the fall of each error that the linear model foresees.
    """
    slope, n = slopes(sq, at), len(sq.order)
    pull = gradient(sq, at, slope).reshape(-1, 3)
    _factor_anew(sq, at, slope, factors, searches)
    reused = any(search.reuses and not search.ended for search in searches)
    turned = np.exp(1j * (at.poses.yaw_rad[:n] - factors.yaw_rad)) if reused else None
    if turned is not None:
        _rotate(pull, turned.conj())
    down = _solved(sq, factors, pull, searches)
    foreseen = 0.5 * np.add.reduceat((pull * down).sum(axis=1), sq.blocks.begin[:-1])
    if turned is not None:
        _rotate(down, turned)
    p_m, yaw_rad = at.poses.p_m.copy(), at.poses.yaw_rad.copy()
    p_m[:n] -= left_jacobian_times(-down[:, 2], down[:, 0] + 1j * down[:, 1])
    yaw_rad[:n] -= down[:, 2]
    return linearised(sq, Poses(p_m, yaw_rad)), foreseen


def _factor_anew(
    sq: Squares, at: Linearisation, slope: Slopes, factors: Factors, searches: Sequence[Descent]
) -> None:
    """Replace factors that do not serve again, in place; a search ends where there are none."""
    anew = [g for g, search in enumerate(searches) if not (search.ended or search.reuses)]
    bands = normal_equations(sq, at, slope) if anew else []
    begin = sq.blocks.begin.tolist()
    for group in anew:
        own = slice(begin[group], begin[group + 1])
        factors.yaw_rad[own] = at.poses.yaw_rad[own]
        try:
            factors.bands[group] = cholesky(bands[group])
        except SingularError:
            searches[group].give_up()


def _solved(
    sq: Squares, factors: Factors, pull: Float[np.ndarray, "poses 3"], searches: Sequence[Descent]
) -> Float[np.ndarray, "poses 3"]:
    """Steps of groups whose search goes on; others stand still."""
    down, right, ends = np.zeros(pull.size), pull.reshape(-1), (3 * sq.blocks.begin).tolist()
    for band, search, (begin, end) in zip(factors.bands, searches, pairwise(ends), strict=True):
        if not search.ended:
            down[begin:end] = lapack.dpbtrs(band, right[begin:end], lower=1)[0]
    return down.reshape(-1, 3)


def _rotate(rows: Float[np.ndarray, "poses 3"], turn: Complex[np.ndarray, " poses"]) -> None:
    """Turn the positions of some rows, in place."""
    xy = (rows[:, 0] + 1j * rows[:, 1]) * turn
    rows[:, 0], rows[:, 1] = xy.real, xy.imag
