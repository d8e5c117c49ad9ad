"""Directions of robots that are too far away to be measured, and where these said they were."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int


class Pings(NamedTuple):
    """Bearings to places that others told: one row each.

    Attributes:
        observer: (robot, index) of the pose in whose frame the direction is; that robot heard.
        sender: The robot that it heard.
        azimuth_rad: The direction.
        sigma_rad: Its standard deviation where it is that of the direct path.
        point_m: Where the other then thought it was, in the world.
        covariance_m2: How well it knew, times how many pings of it the observer had by then.
    """

    observer: Int[np.ndarray, "pings 2"]
    sender: Int[np.ndarray, " pings"]
    azimuth_rad: Float[np.ndarray, " pings"]
    sigma_rad: Float[np.ndarray, " pings"]
    point_m: Float[np.ndarray, "pings 2"]
    covariance_m2: Float[np.ndarray, "pings 2 2"]


NO_PINGS = Pings(
    np.zeros((0, 2), dtype=np.int64),
    np.zeros(0, dtype=np.int64),
    np.zeros(0),
    np.zeros(0),
    np.zeros((0, 2)),
    np.zeros((0, 2, 2)),
)


def extended_pings(pings: Pings, more: Pings) -> Pings:
    """Append pings."""
    if not len(more.observer):
        return pings
    both = (np.concatenate(columns) for columns in zip(pings, more, strict=True))
    return Pings(*both)


def select_pings(pings: Pings, rows: Bool[np.ndarray, " pings"] | Int[np.ndarray, " rows"]) -> Pings:
    """Keep the rows of a mask, or those listed."""
    return Pings(*(column[rows] for column in pings))
