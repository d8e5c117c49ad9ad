"""True poses at any time, between those that were recorded; nothing is made up where nothing was."""

import numpy as np
from jaxtyping import Float

from wifipgo.se2 import wrap_angle

LONGEST_GAP_S = 0.5  # at 0.1 m/s and 0.5 rad/s a straight line is off by a centimetre and some degrees there


def truth_at(
    log: Float[np.ndarray, "rows 4"],
    time_s: Float[np.ndarray, " times"],
    *,
    longest_gap_s: float = LONGEST_GAP_S,
) -> Float[np.ndarray, "times 3"]:
    """Poses by straight lines and shortest turns between the rows before and after.

    Args:
        log: Rows of time, x, y and yaw, in strictly ascending order of time.
        time_s: Times.
        longest_gap_s: Rows that are further apart have nothing between them.

    Returns:
        Poses; nan in gaps, and before the first and after the last row.
    """
    poses = np.full((len(time_s), 3), np.nan)
    if not len(log):
        return poses
    after = np.searchsorted(log[:, 0], time_s, side="left")  # an exact stamp is its row's
    inside = (after < len(log)) & (time_s >= log[0, 0])
    after = np.minimum(after, len(log) - 1)
    before = np.maximum(after - 1, 0)
    gap_s, late_s = log[after, 0] - log[before, 0], time_s - log[before, 0]
    at_row = log[after, 0] == time_s
    known = inside & (at_row | (gap_s <= longest_gap_s))
    share = np.where(at_row, 1.0, np.divide(late_s, gap_s, out=np.ones(len(time_s)), where=gap_s > 0.0))
    way = log[after, 1:] - log[before, 1:]
    way[:, 2] = wrap_angle(way[:, 2])
    between = log[before, 1:] + share[:, None] * way
    between[:, 2] = wrap_angle(between[:, 2])
    poses[known] = between[known]
    return poses
