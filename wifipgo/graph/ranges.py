"""Distances between robots as measurements of their own: one row each, beside bearings and relative poses."""

from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Bool, Float, Int

from wifipgo.errors import require
from wifipgo.se2 import length


@dataclass(frozen=True, slots=True, kw_only=True)
class Ranges:
    """How far robots were from each other.

    Attributes:
        observer: (robot, index) of the pose that measured.
        target: (robot, index) of the pose that it measured.
        range_m: The distance.
        sigma_m: Its standard deviation.
    """

    observer: Int[np.ndarray, "ranges 2"]
    target: Int[np.ndarray, "ranges 2"]
    range_m: Float[np.ndarray, " ranges"]
    sigma_m: Float[np.ndarray, " ranges"]

    def __len__(self) -> int:
        """Return the number of ranges."""
        return len(self.observer)

    @classmethod
    def measured(
        cls,
        *,
        observer: Int[np.ndarray, "ranges 2"],
        target: Int[np.ndarray, "ranges 2"],
        range_m: Float[np.ndarray, " ranges"],
        sigma_m: Float[np.ndarray, " ranges"] | float,
    ) -> "Ranges":
        """Check new ranges; see the class for the arguments, one ``sigma_m`` may serve all.

        Raises:
            ValueError: A sigma or a range is not > 0 and finite, or a robot measured itself.
        """
        sigmas = np.broadcast_to(np.asarray(sigma_m, dtype=np.float64), (len(observer),))
        for name, column in (("sigma_m", sigmas), ("range_m", range_m)):
            good = np.isfinite(column) & (column > 0.0)
            require(bool(good.all()), f"Ranges.{name}", "> 0 and finite", column[~good])
        alone = observer[:, 0] == target[:, 0]
        require(not alone.any(), "Ranges.target", "another robot", target[alone])
        return cls(observer=observer, target=target, range_m=range_m, sigma_m=sigmas)


def select_ranges(ranges: Ranges, rows: Bool[np.ndarray, " ranges"] | Int[np.ndarray, " rows"]) -> Ranges:
    """Keep the rows of a mask, or those listed, in the order listed."""
    return Ranges(**{f.name: getattr(ranges, f.name)[rows] for f in fields(Ranges)})


def range_residuals(
    poses: Float[np.ndarray, "robots times 3"], ranges: Ranges
) -> Float[np.ndarray, " ranges"]:
    """By how much the poses put each target further away than it was measured, m."""
    observer = poses[ranges.observer[:, 0], ranges.observer[:, 1], :2]
    target = poses[ranges.target[:, 0], ranges.target[:, 1], :2]
    return length(target - observer) - ranges.range_m
