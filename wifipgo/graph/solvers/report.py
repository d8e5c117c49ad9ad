"""What a solve says about itself."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int


class Downweighted(NamedTuple):
    """Measurements that an outlier method trusted less than their noise says.

    Attributes:
        method: Which method: a gate, a loss, or ``bearing`` for bearings' own loss.
        rows: Of the edges; of the bearings where the method is ``bearing``.
        weight: What was left of the information of each, in [0, 1).
    """

    method: str
    rows: Int[np.ndarray, " rows"]
    weight: Float[np.ndarray, " rows"]


class Report(NamedTuple):
    """What a solve did. A chi-square is the sum of squared residuals over sigma (twice gtsam's error).

    Where a loss stands in for the square, the chi-square has twice the loss; with GNC, the
    squares times their last weights. Before is where the last search began. Covariances of last
    poses, along the axes of the world, are there where they were asked for, in the order of the robots.
    Converged is a search that ended where nothing is to gain, and of which no other start that was tried
    led lower; if not, ``doubt`` says what speaks against it.
    """

    iterations: int
    chi2_before: float
    chi2_after: float
    n_used: int
    n_dropped: int
    downweighted: tuple[Downweighted, ...] = ()
    last_pose_covariances: Float[np.ndarray, "team 3 3"] | None = None
    converged: bool = True
    doubt: str = ""

    def weights(self, n_edges: int) -> Float[np.ndarray, " edges"]:
        """What is left of the information of each edge, bearings aside; 1 where nothing was taken."""
        left = np.ones(n_edges)
        for down in self.downweighted:
            if down.method != "bearing":
                left[down.rows] *= down.weight
        return left
