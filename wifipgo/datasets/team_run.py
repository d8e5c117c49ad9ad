"""A team's recorded run in the library's own types: odometry, sightings of each other, and truth."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from wifipgo.datasets.noise import Noise
from wifipgo.graph.bearings import Bearings
from wifipgo.graph.edges import Edges
from wifipgo.graph.metrics import ate_rot, ate_trans
from wifipgo.graph.ranges import Ranges


class Landmarks(NamedTuple):
    """Landmarks, and when robots saw them; they are kept apart from what robots saw of each other.

    Attributes:
        subject: Subject number of each surveyed landmark.
        position_m: Where it is, in the world.
        observer: (robot, index) of the pose nearest in time to each sighting.
        seen: Subject number of what was seen.
        range_m: Measured distance.
        azimuth_rad: Measured direction, in the frame of that pose.
    """

    subject: Int[np.ndarray, " landmarks"]
    position_m: Float[np.ndarray, "landmarks 2"]
    observer: Int[np.ndarray, "sightings 2"]
    seen: Int[np.ndarray, " sightings"]
    range_m: Float[np.ndarray, " sightings"]
    azimuth_rad: Float[np.ndarray, " sightings"]


class TeamRun(NamedTuple):
    """A run of several robots, one pose of each at every time. Robots are rows 0, 1, ... everywhere.

    Attributes:
        robots: Number of each robot in the data set.
        time_s: Of each pose, as the data set counts.
        truth: True poses; nan where there is no truth.
        start: Odometry, chained from the true first poses (from zero where these are not known).
        odometry: Relative poses from each time to the next.
        bearings: Directions in which robots saw each other.
        ranges: Distances of the same sightings, row by row.
        noise: What the deviations of all these are made from.
        landmarks: Sightings of landmarks.
        counts: What became of the rows of the files.
    """

    robots: tuple[int, ...]
    time_s: Float[np.ndarray, " times"]
    truth: Float[np.ndarray, "robots times 3"]
    start: Float[np.ndarray, "robots times 3"]
    odometry: Edges
    bearings: Bearings
    ranges: Ranges
    noise: Noise
    landmarks: Landmarks
    counts: Mapping[str, int]

    @property
    def known(self) -> Bool[np.ndarray, "robots times"]:
        """Which poses have a truth."""
        return np.isfinite(self.truth).all(axis=2)


def known_ate(
    estimate: Float[np.ndarray, "robots times 3"], truth: Float[np.ndarray, "robots times 3"]
) -> tuple[Float[np.ndarray, " robots"], Float[np.ndarray, " robots"]]:
    """Eqs. 12 and 13 of each robot over the poses that have a truth; nan for a robot without any.

    Args:
        estimate: Poses, world frame.
        truth: True poses, nan in gaps.

    Returns:
        Mean squared position error, m^2, and mean squared chordal rotation error, unitless.
    """
    known = np.isfinite(truth).all(axis=2)
    pairs = [(estimate[[k]][:, rows], truth[[k]][:, rows]) for k, rows in enumerate(known)]
    trans, rot = (
        np.array([float(of(*pair)[0]) if pair[0].size else np.nan for pair in pairs])
        for of in (ate_trans, ate_rot)
    )
    return trans, rot
