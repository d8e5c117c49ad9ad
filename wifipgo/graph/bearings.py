"""Directions of arrival as measurements of their own: one row each, beside the relative poses."""

from collections.abc import Iterable
from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Bool, Float, Int

from wifipgo.errors import require
from wifipgo.graph.edges import Edges
from wifipgo.se2 import rotate, wrap_angle

# m. Below, robots would stand in each other: the estimates are off by more than the range, and the direction
# from one to the other says little. A bearing's slope is 1 / range; here it is bounded.
NEAREST_M = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class Bearings:
    """Directions in which robots heard each other.

    Attributes:
        observer: (robot, index) of the pose in whose frame the direction is; that robot heard.
        target: (robot, index) of the pose that it heard.
        azimuth_rad: Peaks of the profile, highest first (Eq. 10); the first is the measurement.
        sigma_rad: Standard deviation of a peak that belongs to the direct path.
    """

    observer: Int[np.ndarray, "bearings 2"]
    target: Int[np.ndarray, "bearings 2"]
    azimuth_rad: Float[np.ndarray, "bearings peaks"]
    sigma_rad: Float[np.ndarray, " bearings"]

    def __len__(self) -> int:
        """Return the number of bearings."""
        return len(self.observer)

    @classmethod
    def empty(cls, n_peaks: int = 1) -> "Bearings":
        """Return no bearings."""
        pair = np.zeros((0, 2), dtype=np.int64)
        return cls(observer=pair, target=pair, azimuth_rad=np.zeros((0, n_peaks)), sigma_rad=np.zeros(0))

    @classmethod
    def measured(
        cls,
        *,
        observer: Int[np.ndarray, "bearings 2"],
        target: Int[np.ndarray, "bearings 2"],
        azimuth_rad: Float[np.ndarray, "bearings peaks"],
        sigma_rad: Float[np.ndarray, " bearings"] | float,
    ) -> "Bearings":
        """Check new bearings; see the class for the arguments, one ``sigma_rad`` may serve all.

        Raises:
            ValueError: A sigma is not > 0, an azimuth is not finite, or a robot heard itself.
        """
        sigmas = np.broadcast_to(np.asarray(sigma_rad, dtype=np.float64), (len(observer),))
        require(bool((sigmas > 0.0).all()), "Bearings.sigma_rad", "> 0", sigma_rad)
        require(bool(np.isfinite(azimuth_rad).all()), "Bearings.azimuth_rad", "finite", azimuth_rad)
        alone = observer[:, 0] == target[:, 0]
        require(not alone.any(), "Bearings.target", "another robot", target[alone])
        return cls(observer=observer, target=target, azimuth_rad=azimuth_rad, sigma_rad=sigmas)


def extended_bearings(bearings: Bearings, *more: Bearings) -> Bearings:
    """Append bearings; all have as many peaks."""
    parts = (bearings, *more)
    return _by_field(np.concatenate([getattr(part, f) for part in parts]) for f in _NAMES)


def select_bearings(
    bearings: Bearings, rows: Bool[np.ndarray, " bearings"] | Int[np.ndarray, " rows"]
) -> Bearings:
    """Keep the rows of a mask, or those listed, in the order listed."""
    return _by_field(getattr(bearings, f)[rows] for f in _NAMES)


def bearing_residuals(
    poses: Float[np.ndarray, "robots times 3"], bearings: Bearings
) -> Float[np.ndarray, " bearings"]:
    """How far each highest peak lies from where the poses put its target, rad in [-pi, pi).

    Of targets nearer than `NEAREST_M` only the share of `nearness` counts.
    """
    p_observer_m = _in_observer(poses, bearings)
    off_rad = wrap_angle(np.arctan2(p_observer_m[:, 1], p_observer_m[:, 0]) - bearings.azimuth_rad[:, 0])
    return off_rad * nearness(np.hypot(p_observer_m[:, 0], p_observer_m[:, 1]))


def ranges(poses: Float[np.ndarray, "robots times 3"], bearings: Bearings) -> Float[np.ndarray, " bearings"]:
    """How far from each observer the poses put its target, m."""
    p_observer_m = _in_observer(poses, bearings)
    return np.hypot(p_observer_m[:, 0], p_observer_m[:, 1])


def nearness(range_m: Float[np.ndarray, "*n"]) -> Float[np.ndarray, "*n"]:
    """Share of a residual in rad that counts: ``s (2 - s)`` at s times `NEAREST_M`, and 1 beyond."""
    share = np.minimum(range_m / NEAREST_M, 1.0)
    return share * (2.0 - share)


def _in_observer(
    poses: Float[np.ndarray, "robots times 3"], bearings: Bearings
) -> Float[np.ndarray, "bearings 2"]:
    """Where the poses put targets, in axes of those that heard them, m."""
    observer = poses[bearings.observer[:, 0], bearings.observer[:, 1]]
    target = poses[bearings.target[:, 0], bearings.target[:, 1]]
    return rotate(-observer[:, 2], target[:, :2] - observer[:, :2])


def heard_along(edges: Edges, bearings: Bearings) -> Int[np.ndarray, " edges"]:
    """Row of the bearing that the tail of each edge took of its head, -1 where it took none."""
    row_of = {
        (*observer, *target): row
        for row, (observer, target) in enumerate(
            zip(bearings.observer.tolist(), bearings.target.tolist(), strict=True)
        )
    }
    ends = zip(edges.tail.tolist(), edges.head.tolist(), strict=True)
    return np.array([row_of.get((*tail, *head), -1) for tail, head in ends], dtype=np.int64)


_NAMES = tuple(f.name for f in fields(Bearings))


def _by_field(columns: Iterable[np.ndarray]) -> Bearings:
    """Build bearings from one array per field, in the order of the fields."""
    return Bearings(**dict(zip(_NAMES, columns, strict=True)))
