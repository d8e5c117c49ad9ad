"""Banded Cholesky: Gauss-Newton in the plane on normal equations that are a narrow band.

Residuals are gtsam's, the logarithms of ``z^-1 T_tail_head``, and so are the steps: both ways go through the
same poses, but for the digits that gtsam 4.3 loses in the slopes of logarithms of turns below 1e-3 rad. Its
objects are made one by one through Python, which takes longer than the search itself for the 60 poses of
two robots that meet.
"""

from functools import partial
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float, Int
from scipy.linalg import lapack

from wifipgo.graph.edges import Edges
from wifipgo.graph.solvers._gauss_newton import SingularError, descend
from wifipgo.graph.solvers._linearised import Poses, Squares, squares
from wifipgo.graph.solvers._problem import Problem
from wifipgo.se2 import inverse_left_jacobian, inverse_left_jacobian_slope, left_jacobian_times, wrap_angle

WIDEST = 4e7  # unknowns times squared width: beyond, gtsam's order of elimination is faster
MOST_POSES = 1000  # more are never narrow enough
_PIVOT = 1e-13  # least share of a diagonal that elimination leaves: less is rounding


class Linearisation(NamedTuple):
    """Measurements about some poses: residuals, and what their Jacobians are made of.

    Attributes:
        poses: In elimination order.
        error: Half the chi-square.
        toward: From axes of the world into measured axes of each head.
        apart_m: From tail to head.
        away_m: Where the head is off its measured place.
        away_rad: Heading off the measured one.
        inverse_jacobian: Inverse left Jacobian of the turn that is off, a factor on ``away_m``.
        off_m: Residual of the position.
    """

    poses: Poses
    error: float
    toward: Complex[np.ndarray, " rows"]
    apart_m: Complex[np.ndarray, " rows"]
    away_m: Complex[np.ndarray, " rows"]
    away_rad: Float[np.ndarray, " rows"]
    inverse_jacobian: Complex[np.ndarray, " rows"]
    off_m: Complex[np.ndarray, " rows"]


class Slopes(NamedTuple):
    """Derivatives of the residual of the position; that of the heading has -1 and 1.

    Attributes:
        by_p: By where the head is; by where the tail is, the opposite.
        by_tail: By the heading of the tail.
        by_head: By the heading of the head.
    """

    by_p: Complex[np.ndarray, " rows"]
    by_tail: Complex[np.ndarray, " rows"]
    by_head: Complex[np.ndarray, " rows"]


class Factors(NamedTuple):
    """Cholesky's factors of the normal equations, and the headings where they hold."""

    band: Float[np.ndarray, "diagonals unknowns"]
    yaw_rad: Float[np.ndarray, " poses"]


class BandedOptimum(NamedTuple):
    """Where a search ended, how many steps it took, and half the chi-square before and after."""

    squares: Squares
    at: Linearisation
    iterations: int
    before: float
    settled: bool = True

    @property
    def after(self) -> float:
        """Half the chi-square where the search ended."""
        return self.at.error

    @property
    def poses(self) -> Float[np.ndarray, "poses 3"]:
        """Poses in the order of the problem."""
        return rows_of(self.squares, self.at.poses)

    def covariances(self, rows: Int[np.ndarray, " some"]) -> Float[np.ndarray, "some 3 3"]:
        """Covariances of some poses, along the axes of the world."""
        return covariances(self.squares, self.at, rows)


def linearised_start(problem: Problem, edges: Edges) -> tuple[Squares, Linearisation] | None:
    """A problem where its search starts; nothing where the band is too wide to be fast."""
    if len(problem.start) > MOST_POSES:
        return None
    sq, poses = squares(problem, edges)
    return (sq, linearised(sq, poses)) if 3.0 * len(sq.order) * sq.below**2 <= WIDEST else None


def banded_optimum(problem: Problem, edges: Edges) -> BandedOptimum | None:
    """Least squares; nothing where the band is too wide, or where Gauss-Newton does not come down."""
    begin = linearised_start(problem, edges)
    if begin is None:
        return None
    sq, start = begin
    at, steps, settled = descend(partial(step, sq), start)
    return BandedOptimum(sq, at, steps, start.error) if settled else None


def linearised(sq: Squares, poses: Poses) -> Linearisation:
    """How far off the measurements are."""
    p_m, yaw_rad = poses
    toward = np.exp(-1j * yaw_rad)[sq.tail] * sq.turn
    apart_m = p_m[sq.head] - p_m[sq.tail]
    away_m = toward * apart_m - sq.z_m
    away_rad = wrap_angle(yaw_rad[sq.head] - yaw_rad[sq.tail] - sq.z_rad)
    inverse_jacobian = inverse_left_jacobian(away_rad)
    off_m = inverse_jacobian * away_m - sq.shift_m * away_rad
    info_m, info_rad = sq.information
    error = 0.5 * float(np.vdot(off_m, info_m * off_m).real + away_rad @ (info_rad * away_rad))
    return Linearisation(poses, error, toward, apart_m, away_m, away_rad, inverse_jacobian, off_m)


def slopes(sq: Squares, at: Linearisation) -> Slopes:
    """Derivatives of the residuals."""
    by_p = at.inverse_jacobian * at.toward
    by_head = inverse_left_jacobian_slope(at.inverse_jacobian) * at.away_m - sq.shift_m
    return Slopes(by_p, -by_head - 1j * by_p * at.apart_m, by_head)


def _square(a: Complex[np.ndarray, " rows"]) -> Float[np.ndarray, " rows"]:
    return a.real**2 + a.imag**2


def _dot(a: Complex[np.ndarray, " rows"], b: Complex[np.ndarray, " rows"]) -> Float[np.ndarray, " rows"]:
    return a.real * b.real + a.imag * b.imag


def normal_equations(
    sq: Squares, at: Linearisation, slope: Slopes
) -> Float[np.ndarray, "diagonals unknowns"]:
    """Information of all poses, the diagonal and those below it."""
    info_m, info_rad = sq.information
    n = len(sq.head) - (len(at.poses.p_m) - len(sq.order))  # rows between poses that are solved for
    pull = info_m * slope.by_p.conj()
    near, tail, head = (
        info_m * _square(at.inverse_jacobian),
        pull * slope.by_tail,
        pull[:n] * slope.by_head[:n],
    )
    tails = [near, near, -tail.real, -tail.imag, info_m * _square(slope.by_tail) + info_rad]
    heads = [head.real, head.imag, info_m[:n] * _square(slope.by_head[:n]) + info_rad[:n]]
    turns = info_m[:n] * _dot(slope.by_tail[:n], slope.by_head[:n]) - info_rad[:n]
    near, tail = near[:n], tail[:n]
    heads, cross = [near, near, *heads], [-near, -near, tail.real, tail.imag, -head.real, -head.imag, turns]
    size = 3 * len(sq.order) * (sq.below + 1)
    flat = np.bincount(sq.place, np.concatenate([*tails, *heads, *cross]), minlength=size)
    return flat.reshape(-1, sq.below + 1).T


def gradient(sq: Squares, at: Linearisation, slope: Slopes) -> Float[np.ndarray, " unknowns"]:
    """Slope of half the chi-square by each pose: x, y, yaw."""
    pull, turn = sq.information[0] * at.off_m, sq.information[1] * at.away_rad
    force = slope.by_p.conj() * pull
    tails = [-force.real, -force.imag, _dot(slope.by_tail, pull) - turn]
    heads = [force.real, force.imag, _dot(slope.by_head, pull) + turn]
    by_pose = np.bincount(sq.slope_place, np.concatenate([*tails, *heads]))
    return by_pose[: 3 * len(sq.order)]


def factored(sq: Squares, at: Linearisation, slope: Slopes) -> Factors:
    """Cholesky's factors.

    Raises:
        SingularError: Measurements do not say where the poses are.
    """
    band = normal_equations(sq, at, slope)
    diagonal = band[0].copy()
    factors, failed = lapack.dpbtrf(band, lower=1, overwrite_ab=1)
    if failed or (factors[0] ** 2 < _PIVOT * diagonal).any():
        raise SingularError
    return Factors(factors, at.poses.yaw_rad[: len(sq.order)])


def step(sq: Squares, at: Linearisation, factors: Factors | None) -> tuple[Linearisation, Factors]:
    """A step by the factors given, or by those of the system itself; each pose goes along an arc.

    Factors of a system nearby are taken along with the poses: they hold in the axes of each.
    """
    slope, n = slopes(sq, at), len(sq.order)
    down = gradient(sq, at, slope).reshape(-1, 3)
    turned = None if factors is None else np.exp(1j * (at.poses.yaw_rad[:n] - factors.yaw_rad))
    if turned is not None:
        _rotate(down, turned.conj())
    factors = factored(sq, at, slope) if factors is None else factors
    down = lapack.dpbtrs(factors.band, down.ravel(), lower=1, overwrite_b=1)[0].reshape(-1, 3)
    if turned is not None:
        _rotate(down, turned)
    p_m, yaw_rad = at.poses.p_m.copy(), at.poses.yaw_rad.copy()
    p_m[:n] -= left_jacobian_times(-down[:, 2], down[:, 0] + 1j * down[:, 1])
    yaw_rad[:n] -= down[:, 2]
    return linearised(sq, Poses(p_m, yaw_rad)), factors


def _rotate(rows: Float[np.ndarray, "poses 3"], turn: Complex[np.ndarray, " poses"]) -> None:
    """Turn the positions of some rows, in place."""
    xy = (rows[:, 0] + 1j * rows[:, 1]) * turn
    rows[:, 0], rows[:, 1] = xy.real, xy.imag


def covariances(
    sq: Squares, at: Linearisation, rows: Int[np.ndarray, " some"]
) -> Float[np.ndarray, "some 3 3"]:
    """Covariances of some poses, along the axes of the world."""
    place = np.empty(len(sq.order), dtype=np.int64)
    place[sq.order] = np.arange(len(sq.order))
    unknown = (3 * place[rows][:, None] + np.arange(3)).ravel()
    unit = np.zeros((3 * len(place), len(unknown)), order="F")
    unit[unknown, np.arange(len(unknown))] = 1.0
    half, _ = lapack.dtbtrs(factored(sq, at, slopes(sq, at)).band, unit, uplo="L", overwrite_b=1)
    every = (half.T @ half).reshape(len(rows), 3, len(rows), 3)
    each = np.arange(len(rows))
    return every[each, :, each]


def rows_of(sq: Squares, poses: Poses) -> Float[np.ndarray, "poses 3"]:
    """Poses solved for, in the order of the problem."""
    n = len(sq.order)
    out = np.empty((n, 3))
    p_m, yaw_rad = poses.p_m[:n], poses.yaw_rad[:n]
    out[sq.order] = np.stack([p_m.real, p_m.imag, np.arctan2(np.sin(yaw_rad), np.cos(yaw_rad))], axis=1)
    return out
