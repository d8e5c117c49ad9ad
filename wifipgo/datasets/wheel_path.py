"""Where wheels say that a robot is at any time: logged velocities, each held until the next row."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from wifipgo import se2

LONGEST_HOLD_S = 0.25  # a row that is held longer says nothing of the rest


class WheelPath(NamedTuple):
    """Odometry of a robot from its first row on.

    Attributes:
        time_s: Of each row.
        velocity: Forward, m/s, and angular, rad/s.
        poses: At the rows, in the frame of the first.
        driven_m: Way driven until each row.
        turned_rad: Sum of the turns, either way.
        unheard_s: Time until each row that a velocity was held longer than `LONGEST_HOLD_S`.
    """

    time_s: Float[np.ndarray, " rows"]
    velocity: Float[np.ndarray, "rows 2"]
    poses: Float[np.ndarray, "rows 3"]
    driven_m: Float[np.ndarray, " rows"]
    turned_rad: Float[np.ndarray, " rows"]
    unheard_s: Float[np.ndarray, " rows"]


def wheel_path(log: Float[np.ndarray, "rows 3"]) -> WheelPath:
    """Chain the arcs that a log of time, forward and angular velocity describes.

    Args:
        log: Rows in ascending order of time. Of rows with one stamp the last holds.
    """
    time_s, velocity = log[:, 0], log[:, 1:]
    held_s = np.diff(time_s)
    twist = _twist(held_s, velocity[:-1])
    yaw_rad = _summed(twist[:, 2])
    arc = se2.exp(twist)
    p_m = se2.rotate(yaw_rad[:-1], arc[:, :2])
    return WheelPath(
        time_s,
        velocity,
        np.column_stack([_summed(p_m[:, 0]), _summed(p_m[:, 1]), se2.wrap_angle(yaw_rad)]),
        _summed(np.abs(twist[:, 0])),
        _summed(np.abs(twist[:, 2])),
        _summed(np.maximum(held_s - LONGEST_HOLD_S, 0.0)),
    )


def poses_at(path: WheelPath, time_s: Float[np.ndarray, " times"]) -> Float[np.ndarray, "times 3"]:
    """Poses at times that the log covers."""
    row = np.maximum(np.searchsorted(path.time_s, time_s, side="right") - 1, 0)
    onward = se2.exp(_twist(time_s - path.time_s[row], path.velocity[row]))
    return se2.compose(path.poses[row], onward)


class Steps(NamedTuple):
    """Odometry between neighbouring times.

    Attributes:
        z: Motion, in the frame where each step begins.
        driven_m: Way driven.
        turned_rad: Sum of the turns, either way.
        lasted_s: Duration.
        unheard_s: The part of it without a row of odometry.
    """

    z: Float[np.ndarray, "steps 3"]
    driven_m: Float[np.ndarray, " steps"]
    turned_rad: Float[np.ndarray, " steps"]
    lasted_s: Float[np.ndarray, " steps"]
    unheard_s: Float[np.ndarray, " steps"]


def steps_between(path: WheelPath, time_s: Float[np.ndarray, " times"]) -> Steps:
    """Steps between each two neighbours of ascending times."""
    poses = poses_at(path, time_s)
    sums = (np.interp(time_s, path.time_s, of) for of in (path.driven_m, path.turned_rad, path.unheard_s))
    driven_m, turned_rad, unheard_s = map(np.diff, sums)
    return Steps(se2.between(poses[:-1], poses[1:]), driven_m, turned_rad, np.diff(time_s), unheard_s)


def _twist(held_s: Float[np.ndarray, " n"], velocity: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, "n 3"]:
    """Tangent vectors of arcs."""
    return np.column_stack([velocity[:, 0] * held_s, np.zeros(len(held_s)), velocity[:, 1] * held_s])


def _summed(x: Float[np.ndarray, " n"]) -> Float[np.ndarray, " more"]:
    """Sums of all before, from 0 on."""
    return np.append(0.0, np.cumsum(x))
