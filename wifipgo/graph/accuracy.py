"""Accuracy of trajectories against the truth, as trajectory tools count it: RMSE, RPE, NEES.

Rows are poses in the plane or in space; ``group`` says whose each row is. Paper Eqs. 12 and 13,
mean squares without alignment, are in `wifipgo.graph.metrics`.
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np
from jaxtyping import Float, Int

from wifipgo import se2, se3
from wifipgo.arithmetic import harmless_underflow
from wifipgo.errors import pick, require
from wifipgo.graph.chordal import Poses, matrices, nearest_rotations, pose_rows
from wifipgo.graph.residuals import tangent_difference

Rows = Float[np.ndarray, "poses dims"]


@harmless_underflow
def aligned(estimate: Rows, reference: Rows, *, alignment: str = "rigid") -> Rows:
    """The estimate, moved as a whole to where it fits the reference best.

    Args:
        estimate: Poses of all robots.
        reference: The truth, row by row.
        alignment: "none"; "first": the first poses coincide; "rigid": least squares of the positions
            by a turn and a shift (Umeyama, PAMI 1991); "similar": with a scale too.
    """
    return pick(ALIGNMENTS, alignment, "alignment")(estimate, reference)


def rmse_trans(
    estimate: Rows, reference: Rows, group: Int[np.ndarray, " poses"] | None = None
) -> Float[np.ndarray, " groups"]:
    """Root mean squared position error of each group, m: the absolute trajectory error."""
    d = matrices(estimate[:0]).t_m.shape[1]
    return _rms(((estimate - reference)[:, :d] ** 2).sum(axis=1), group)


def rmse_rot(
    estimate: Rows, reference: Rows, group: Int[np.ndarray, " poses"] | None = None
) -> Float[np.ndarray, " groups"]:
    """Root mean squared angle between estimated and true orientation of each group, rad."""
    off = tangent_difference(reference, estimate)
    d = matrices(estimate[:0]).t_m.shape[1]
    return _rms((off[:, d:] ** 2).sum(axis=1), group)


def rpe(
    estimate: Rows, reference: Rows, group: Int[np.ndarray, " poses"] | None = None, *, delta: int = 1
) -> tuple[Float[np.ndarray, " groups"], Float[np.ndarray, " groups"]]:
    """Relative pose error: RMSE, in m and rad, of the motion over ``delta`` poses of one group.

    Groups with no more than ``delta`` poses have none: nan.
    """
    require(delta >= 1, "delta", ">= 1", delta)
    label = _labels(estimate, group)
    between = se2.between if estimate.shape[1] == 3 else se3.between
    first = np.concatenate([np.flatnonzero(label == g)[:-delta] for g in np.unique(label)])
    last = np.concatenate([np.flatnonzero(label == g)[delta:] for g in np.unique(label)])
    motion = [between(rows[first], rows[last]) for rows in (estimate, reference)]
    off, d = tangent_difference(motion[1], motion[0]), matrices(estimate[:0]).t_m.shape[1]
    n = int(label.max(initial=-1)) + 1
    counts = np.bincount(label[first], minlength=n).astype(np.float64)
    squares = [(off[:, axes] ** 2).sum(axis=1) for axes in (slice(None, d), slice(d, None))]
    sums = [np.bincount(label[first], square, minlength=n) for square in squares]
    safe = np.where(counts > 0.0, counts, np.nan)
    return np.sqrt(sums[0] / safe), np.sqrt(sums[1] / safe)


@harmless_underflow
def nees(
    estimate: Rows, reference: Rows, covariance: Float[np.ndarray, "poses freedom freedom"]
) -> Float[np.ndarray, " poses"]:
    """Normalised estimation error squared of each pose; its mean is the degrees of freedom if all is right.

    Args:
        estimate: Optimised poses.
        reference: The truth, in the same frame: no alignment, which would hide errors.
        covariance: Of each pose in its own frame, see `marginal_covariances`.
    """
    off = tangent_difference(estimate, reference)
    return (off * np.linalg.solve(covariance, off[..., None])[..., 0]).sum(axis=1)


def _labels(rows: Rows, group: Int[np.ndarray, " poses"] | None) -> Int[np.ndarray, " poses"]:
    """Groups counted from 0 in ascending order; one for all if none are given."""
    if group is None:
        return np.zeros(len(rows), dtype=np.int64)
    return np.unique(group, return_inverse=True)[1]


def _rms(
    square: Float[np.ndarray, " poses"], group: Int[np.ndarray, " poses"] | None
) -> Float[np.ndarray, " groups"]:
    label = _labels(square[:, None], group)
    return np.sqrt(np.bincount(label, square) / np.bincount(label))


def _first(estimate: Rows, reference: Rows) -> Rows:
    """Move so that the first poses coincide."""
    space = se2 if estimate.shape[1] == 3 else se3
    return space.compose(space.compose(reference[:1], space.inverse(estimate[:1])), estimate)


def _umeyama(estimate: Rows, reference: Rows, *, scaled: bool) -> Rows:
    """Least squares of the positions by a turn, a shift and, if wanted, a scale."""
    poses, truth = matrices(estimate), matrices(reference).t_m
    mean, centre = poses.t_m.mean(axis=0), truth.mean(axis=0)
    here, there = poses.t_m - mean, truth - centre
    moment = there.T @ here
    R = nearest_rotations(moment[None])[0]
    spread = float((here**2).sum())
    scale = float((R * moment).sum()) / spread if scaled and spread > 0.0 else 1.0
    return pose_rows(Poses(R @ poses.R, centre + scale * here @ R.T))


ALIGNMENTS: Mapping[str, Callable[[Rows, Rows], Rows]] = MappingProxyType(
    {
        "none": lambda estimate, _: estimate,
        "first": _first,
        "rigid": lambda estimate, reference: _umeyama(estimate, reference, scaled=False),
        "similar": lambda estimate, reference: _umeyama(estimate, reference, scaled=True),
    }
)
