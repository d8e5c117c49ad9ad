"""What each robot believes that it has seen of the room, and how surely it has it in place.

The room is cut into ``N_BINS`` by ``N_BINS`` squares in the robot's own estimate of the world.
Each holds the greatest probability, over the poses from which it was in range, that the pose put
it within `wifipgo.world.coverage.TOLERANCE_M` of the truth; 0 where it was not seen. Robots know
neither obstacles nor the truth, so a square behind an obstacle counts as seen here.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int

from wifipgo.se2 import length
from wifipgo.world.coverage import inside, window

N_BINS = 16
# Bytes of a survey as sent: one for each square.
BYTES_PER_COVERAGE = N_BINS**2


class CoverageBelief(NamedTuple):
    """Probabilities in [0, 1], square by square; x grows along the first axis of a map, y along the second.

    Attributes:
        own: From the robot's own trajectory, as it now believes that.
        received: Greatest of what others sent when they met, as they then had it.
    """

    own: Float[np.ndarray, "rows bins bins"]
    received: Float[np.ndarray, "rows bins bins"]

    @property
    def known(self) -> Float[np.ndarray, "rows bins bins"]:
        """Both together."""
        return np.maximum(self.own, self.received)


def no_coverage(n_robots: int) -> CoverageBelief:
    """Nothing was seen yet."""
    nothing = np.zeros((n_robots, N_BINS, N_BINS), dtype=np.float32)
    return CoverageBelief(nothing, nothing)


def covered(
    own: Float[np.ndarray, "rows bins bins"],
    robot: Int[np.ndarray, " poses"],
    p_m: Float[np.ndarray, "poses 2"],
    in_place: Float[np.ndarray, " poses"],
    *,
    size_m: float,
    range_m: float,
) -> Float[np.ndarray, "rows bins bins"]:
    """Add what is seen from some poses: squares whose middle is in range, and the one that one stands in.

    Args:
        own: Map of each robot.
        robot: Rows of whose poses.
        p_m: Where they believe that they stood.
        in_place: Probability that what they saw there is put in place.
        size_m: Width of the room.
        range_m: How far they see.
    """
    width_m = size_m / N_BINS
    here = np.floor(p_m / width_m)
    nearest = np.minimum(np.maximum(here, 0.0), N_BINS - 1.0)  # a belief may be far outside
    offset = window(int(min(np.ceil(range_m / width_m), N_BINS)))
    index = nearest.astype(np.int64)[:, None] + offset
    near = length(width_m * (index + 0.5) - p_m[:, None]) <= range_m
    near[:, len(offset) // 2] |= (here == nearest).all(axis=1)
    near &= inside(index, N_BINS)
    pose, place = near.nonzero()
    x, y = index[pose, place].T
    out = own.copy()
    np.maximum.at(out.reshape(-1), (robot[pose] * N_BINS + x) * N_BINS + y, in_place[pose].astype(np.float32))
    return out


def team_share(survey: CoverageBelief, n_worlds: int = 1) -> Float[np.ndarray, " worlds"]:
    """Mean over the room of the surest that any robot's own map is: the mapped share as robots can tell."""
    surest = survey.own.reshape(n_worlds, -1, N_BINS**2).max(axis=1)
    return surest.sum(axis=1).astype(np.float64) / N_BINS**2
