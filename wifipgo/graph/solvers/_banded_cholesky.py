"""Banded Cholesky: normal equations in the plane that are a narrow band.

Residuals are gtsam's, the logarithms of ``z^-1 T_tail_head``, and so are the steps: both ways go through the
same poses, but for the digits that gtsam 4.3 loses in the slopes of logarithms of turns below 1e-3 rad. Its
objects are made one by one through Python, which takes longer than the search itself for the 60 poses of
two robots that meet. Groups that share nothing are side by side: what is done to arrays is done to all at
once, and LAPACK gets the band of each, so that a group's answer is what it is alone, to the bit.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from jaxtyping import Complex, Float, Int
from scipy.linalg import lapack

from wifipgo.graph.solvers._gauss_newton import SingularError
from wifipgo.graph.solvers._linearised import Poses, Squares
from wifipgo.se2 import inverse_left_jacobian, inverse_left_jacobian_slope, wrap_angle

_PIVOT = 1e-13  # least share of a diagonal that elimination leaves: less is rounding


class Linearisation(NamedTuple):
    """Measurements about some poses: residuals, and what their Jacobians are made of.

    Attributes:
        poses: In elimination order.
        error: Half the chi-square of each group.
        toward: From axes of the world into measured axes of each head.
        apart_m: From tail to head.
        away_m: Where the head is off its measured place.
        away_rad: Heading off the measured one.
        inverse_jacobian: Inverse left Jacobian of the turn that is off, a factor on ``away_m``.
        off_m: Residual of the position.
    """

    poses: Poses
    error: Float[np.ndarray, " groups"]
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
    each = info_m * _square(off_m) + info_rad * (away_rad * away_rad)
    error = 0.5 * np.bincount(sq.blocks.of_row, each, minlength=len(sq.blocks))
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


def normal_equations(sq: Squares, at: Linearisation, slope: Slopes) -> list[Float[np.ndarray, "_ _"]]:
    """Information of the poses of each group, the diagonal and those below it."""
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
    blocks = sq.blocks
    flat = np.bincount(sq.place, np.concatenate([*tails, *heads, *cross]), minlength=int(blocks.cells[-1]))
    cuts = zip(pairwise(blocks.cells.tolist()), (blocks.below + 1).tolist(), strict=True)
    return [flat[begin:end].reshape(-1, width).T for (begin, end), width in cuts]


def gradient(sq: Squares, at: Linearisation, slope: Slopes) -> Float[np.ndarray, " unknowns"]:
    """Slope of half the chi-square by each pose: x, y, yaw."""
    pull, turn = sq.information[0] * at.off_m, sq.information[1] * at.away_rad
    force = slope.by_p.conj() * pull
    tails = [-force.real, -force.imag, _dot(slope.by_tail, pull) - turn]
    heads = [force.real, force.imag, _dot(slope.by_head, pull) + turn]
    by_pose = np.bincount(sq.slope_place, np.concatenate([*tails, *heads]))
    return by_pose[: 3 * len(sq.order)]


def cholesky(band: Float[np.ndarray, "diagonals unknowns"]) -> Float[np.ndarray, "diagonals unknowns"]:
    """Factors of normal equations, in their place.

    Raises:
        SingularError: Measurements do not say where the poses are.
    """
    diagonal = band[0].copy()
    factors, failed = lapack.dpbtrf(band, lower=1, overwrite_ab=1)
    if failed or (factors[0] ** 2 < _PIVOT * diagonal).any():
        raise SingularError
    return factors


def group_covariances(
    sq: Squares, at: Linearisation, rows: Sequence[Int[np.ndarray, " _"]]
) -> list[Float[np.ndarray, "_ 3 3"] | None]:
    """Covariances of some poses of each group, along the axes of the world; none beyond working precision."""
    place = np.empty(len(sq.order), dtype=np.int64)
    place[sq.order] = np.arange(len(sq.order))
    bands, begin = normal_equations(sq, at, slopes(sq, at)), sq.blocks.begin.tolist()
    found: list[np.ndarray | None] = []
    for band, asked, first in zip(bands, rows, begin[:-1], strict=True):
        try:
            found.append(_inverse_blocks(cholesky(band), place[asked] - first))
        except SingularError:
            found.append(None)
    return found


def _inverse_blocks(
    factors: Float[np.ndarray, "diagonals unknowns"], places: Int[np.ndarray, " some"]
) -> Float[np.ndarray, "some 3 3"]:
    """Blocks of the inverse of a system on its diagonal."""
    unknown = (3 * places[:, None] + np.arange(3)).ravel()
    unit = np.zeros((factors.shape[1], len(unknown)), order="F")
    unit[unknown, np.arange(len(unknown))] = 1.0
    half, _ = lapack.dtbtrs(factors, unit, uplo="L", overwrite_b=1)
    every = (half.T @ half).reshape(len(places), 3, len(places), 3)
    each = np.arange(len(places))
    return every[each, :, each]


def rows_of(sq: Squares, poses: Poses) -> Float[np.ndarray, "poses 3"]:
    """Poses solved for, in the order of the problem."""
    n = len(sq.order)
    out = np.empty((n, 3))
    p_m, yaw_rad = poses.p_m[:n], poses.yaw_rad[:n]
    out[sq.order, 0], out[sq.order, 1] = p_m.real, p_m.imag
    out[sq.order, 2] = np.arctan2(np.sin(yaw_rad), np.cos(yaw_rad))
    return out
