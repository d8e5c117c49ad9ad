"""What is true of a robot, for critics: no robot knows it, and policies are not shown it."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from jaxtyping import Float

# Entries of infos that it is read from.
TRUTHS = ("mapped_share_truth", "coverage_truth", "ate_trans_truth", "ate_rot_truth")
N_TRUTH = 5


def truth_of(told: Mapping[str, Any]) -> Float[np.ndarray, "*robots truths"]:
    """Mapped share, what was seen, what of it is not mapped, and errors of the trajectory, float32.

    Args:
        told: Of each of `TRUTHS` the numbers of the robots, in arrays of one shape.
    """
    mapped, seen, trans, rot = (np.asarray(told[name], dtype=np.float32) for name in TRUTHS)
    return np.stack([mapped, seen, seen - mapped, np.log1p(trans), np.log1p(10.0 * rot)], axis=-1)
