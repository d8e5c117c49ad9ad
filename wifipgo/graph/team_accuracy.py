"""Figures of merit of teams as the field reports them: ATE and RPE by robot, iATE over time, SVE.

ATE, iATE and SVE are those of the benchmarks of McGann et al. (JRL's metrics, iMESA). Paper Eqs. 12 and 13,
mean squares without alignment, are among them.
"""

from collections.abc import Iterable, Mapping
from itertools import combinations
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from wifipgo.arithmetic import harmless_underflow
from wifipgo.errors import require
from wifipgo.graph.accuracy import Rows, aligned, rmse_rot, rmse_trans, rpe
from wifipgo.graph.metrics import chordal_square
from wifipgo.graph.residuals import tangent_difference

# What each robot holds: values of poses, its own and others', by (robot, index).
Held = Mapping[int, Mapping[tuple[int, int], list[float]]]


class Accuracy(NamedTuple):
    """Errors of one robot's poses, or of all.

    Attributes:
        poses: How many were compared.
        ate_m: Absolute trajectory error, RMSE of the positions.
        ate_rad: RMSE of the angle between orientations.
        rpe_m: Relative pose error, RMSE of the shift; nan without motions.
        rpe_rad: RMSE of the turn.
        ate_trans: Paper Eq. 12, m^2: mean squared position error.
        ate_rot: Paper Eq. 13: mean squared chordal distance of the rotations.
    """

    poses: int
    ate_m: float
    ate_rad: float
    rpe_m: float
    rpe_rad: float
    ate_trans: float
    ate_rot: float


class TeamAccuracy(NamedTuple):
    """Errors of each robot by its number, and of all poses together."""

    robots: dict[int, Accuracy]
    team: Accuracy

    def as_json(self) -> dict[str, object]:
        """Figures by robot, in their units."""
        robots = {str(robot): one._asdict() for robot, one in self.robots.items()}
        return {"team": self.team._asdict(), "robots": robots}


class OverTime(NamedTuple):
    """An error in m and rad as estimates grow: of each step, and the mean over steps."""

    steps_m: tuple[float, ...]
    steps_rad: tuple[float, ...]

    @property
    def trans_m(self) -> float:
        """IATE of the positions."""
        return float(np.mean(self.steps_m))

    @property
    def rot_rad(self) -> float:
        """IATE of the orientations."""
        return float(np.mean(self.steps_rad))


@harmless_underflow
def team_accuracy(
    estimate: Rows,
    reference: Rows,
    robot: Int[np.ndarray, " poses"],
    *,
    alignment: str = "none",
    delta: int = 1,
) -> TeamAccuracy:
    """Errors of a team against the truth, by robot and together.

    Args:
        estimate: Poses of all robots, each robot's in order.
        reference: The truth, row by row.
        robot: Whose each row is.
        alignment: See `wifipgo.graph.accuracy.aligned`; the team is moved as one.
        delta: Poses over which relative errors are taken.

    Raises:
        ValueError: There is no pose, or the alignment is unknown.
    """
    require(len(estimate) > 0, "estimate", "at least one pose", 0)
    fitted = aligned(estimate, reference, alignment=alignment)
    whose = np.unique(robot).tolist()
    steps_m, steps_rad = rpe(fitted, reference, robot, delta=delta)
    robots = {
        number: _accuracy(fitted[robot == number], reference[robot == number], steps_m[[k]], steps_rad[[k]])
        for k, number in enumerate(whose)
    }
    motions = np.array([max(robots[number].poses - delta, 0) for number in whose], dtype=np.float64)
    pooled = [_pooled(steps, motions) for steps in (steps_m, steps_rad)]
    return TeamAccuracy(robots, _accuracy(fitted, reference, *pooled))


def _accuracy(
    estimate: Rows, reference: Rows, rpe_m: Float[np.ndarray, "1"], rpe_rad: Float[np.ndarray, "1"]
) -> Accuracy:
    """Errors of some rows, as they are."""
    turn_rad = np.linalg.norm(_turns(estimate, reference), axis=1)
    ate_m, ate_rad = float(rmse_trans(estimate, reference)[0]), float(rmse_rot(estimate, reference)[0])
    chordal = float(chordal_square(turn_rad).mean())
    return Accuracy(len(estimate), ate_m, ate_rad, float(rpe_m[0]), float(rpe_rad[0]), ate_m**2, chordal)


def _pooled(
    rms: Float[np.ndarray, " robots"], motions: Float[np.ndarray, " robots"]
) -> Float[np.ndarray, "1"]:
    """Root mean square of all motions; nan if there are none."""
    moved = motions > 0.0
    mean = (motions[moved] @ rms[moved] ** 2) / motions.sum() if moved.any() else np.nan
    return np.sqrt(np.array([mean]))


def iate(steps: Iterable[tuple[Rows, Rows]], *, alignment: str = "none") -> OverTime:
    """Incremental ATE: the mean, over the steps of a run, of the ATE of all poses so far.

    Args:
        steps: After each step, the estimate of all poses so far and their truth, row by row.
        alignment: See `wifipgo.graph.accuracy.aligned`; anew at each step.

    Raises:
        ValueError: There is no step.
    """
    errors = [
        (float(rmse_trans(fitted, truth)[0]), float(rmse_rot(fitted, truth)[0]))
        for fitted, truth in ((aligned(here, there, alignment=alignment), there) for here, there in steps)
    ]
    require(len(errors) > 0, "steps", "at least one", 0)
    trans_m, rot_rad = zip(*errors, strict=True)
    return OverTime(trans_m, rot_rad)


@harmless_underflow
def shared_variable_error(held: Held) -> tuple[float, float]:
    """SVE: root mean squared disagreement, m and rad, on poses that several robots hold.

    The mean is over pairs of robots and the poses that both hold. No such pose: no disagreement, zero.

    Args:
        held: What each robot holds.
    """
    pairs = [(a[key], b[key]) for a, b in combinations(held.values(), 2) for key in a.keys() & b.keys()]
    if not pairs:
        return 0.0, 0.0
    one, other = (np.array(rows) for rows in zip(*pairs, strict=True))
    return float(rmse_trans(one, other)[0]), float(rmse_rot(one, other)[0])


def _turns(estimate: Rows, reference: Rows) -> Float[np.ndarray, "poses angles"]:
    """Rotation vectors from the reference's orientation to the estimate's."""
    return tangent_difference(reference, estimate)[:, 2 if estimate.shape[1] == 3 else 3 :]
