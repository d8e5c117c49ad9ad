"""What the cameras of an MRCLAM run saw: whose barcode it was, and at which poses."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from wifipgo import se2
from wifipgo.datasets.mrclam_logs import Logs, RobotLog
from wifipgo.datasets.wheel_path import WheelPath, poses_at

_NOBODY = -1


class LandmarkSightings(NamedTuple):
    """Sightings of what is no robot: observer's (robot, index), subject number, distance and direction."""

    observer: Int[np.ndarray, "rows 2"]
    seen: Int[np.ndarray, " rows"]
    range_m: Float[np.ndarray, " rows"]
    azimuth_rad: Float[np.ndarray, " rows"]


class Sightings(NamedTuple):
    """Sightings of robots by robots.

    Attributes:
        observer: (robot, index) of the pose nearest in time.
        target: The same of who was seen.
        range_m: Measured distance.
        azimuth_rad: Measured direction, in the frame of the observer's pose.
        of_landmarks: The others.
        counts: How many sightings there are of each kind.
    """

    observer: Int[np.ndarray, "rows 2"]
    target: Int[np.ndarray, "rows 2"]
    range_m: Float[np.ndarray, " rows"]
    azimuth_rad: Float[np.ndarray, " rows"]
    of_landmarks: LandmarkSightings
    counts: dict[str, int]

    def errors(
        self, truth: Float[np.ndarray, "robots times 3"]
    ) -> tuple[Float[np.ndarray, " rows"], Float[np.ndarray, " rows"]]:
        """Error of each direction, rad, and distance, m; nan where there is no truth."""
        seen_from = se2.between(truth[tuple(self.observer.T)], truth[tuple(self.target.T)])
        true_rad = np.arctan2(seen_from[:, 1], seen_from[:, 0])
        off_rad = se2.wrap_angle(self.azimuth_rad - true_rad)
        return off_rad, self.range_m - se2.length(seen_from[:, :2])


class _Rows(NamedTuple):
    """Sightings of all robots one after the other, whatever they saw."""

    robot: Int[np.ndarray, " rows"]
    pose: Int[np.ndarray, " rows"]
    subject: Int[np.ndarray, " rows"]
    range_m: Float[np.ndarray, " rows"]
    azimuth_rad: Float[np.ndarray, " rows"]
    in_time: Bool[np.ndarray, " rows"]


def sightings_of(logs: Logs, paths: Sequence[WheelPath], time_s: Float[np.ndarray, " times"]) -> Sightings:
    """Sort the sightings of a run, each put to the poses nearest in time.

    Args:
        logs: The run.
        paths: Odometry of its robots.
        time_s: Times of the poses, evenly spaced.
    """
    parts = [
        _rows(robot, log, path, logs.subject_of, time_s)
        for robot, (log, path) in enumerate(zip(logs.robots, paths, strict=True))
    ]
    rows = _Rows(*map(np.concatenate, zip(*parts, strict=True)))
    row_of = {log.number: robot for robot, log in enumerate(logs.robots)}
    target = np.array([row_of.get(subject, _NOBODY) for subject in rows.subject.tolist()], dtype=np.int64)
    kind = _kinds(rows, target, logs.left_out)
    at = np.stack([rows.robot, rows.pose], axis=1)
    ours, rest = (kind[name] for name in ("sightings of robots", "sightings of landmarks"))
    return Sightings(
        at[ours],
        np.stack([target, rows.pose], axis=1)[ours],
        rows.range_m[ours],
        rows.azimuth_rad[ours],
        LandmarkSightings(at[rest], rows.subject[rest], rows.range_m[rest], rows.azimuth_rad[rest]),
        {name: int(mask.sum()) for name, mask in kind.items()},
    )


def _rows(
    robot: int,
    log: RobotLog,
    path: WheelPath,
    subject_of: Mapping[int, int],
    time_s: Float[np.ndarray, " times"],
) -> _Rows:
    """Sightings of one robot."""
    when_s, barcode, range_m, azimuth_rad = log.sightings.rows.T
    index = np.rint((when_s - time_s[0]) / (time_s[1] - time_s[0])).astype(np.int64)
    in_time = (index >= 0) & (index < len(time_s)) & (when_s <= path.time_s[-1])
    index = np.clip(index, 0, len(time_s) - 1)
    turned_rad = poses_at(path, when_s)[:, 2] - poses_at(path, time_s)[index, 2]
    return _Rows(
        np.full(len(index), robot),
        index,
        np.array([subject_of.get(int(code), _NOBODY) for code in barcode.tolist()], dtype=np.int64),
        range_m,
        se2.wrap_angle(azimuth_rad + turned_rad),
        in_time,
    )


def _kinds(
    rows: _Rows, target: Int[np.ndarray, " rows"], left_out: Sequence[int]
) -> dict[str, Bool[np.ndarray, " rows"]]:
    """Each sighting under one name."""
    left = np.ones(len(target), dtype=bool)
    kinds = {}
    for name, mask in {
        "sightings of unknown barcodes": rows.subject == _NOBODY,
        "sightings outside the time of the poses": ~rows.in_time,
        "sightings of the robot itself": target == rows.robot,
        "sightings of robots": target != _NOBODY,
        "sightings of robots left out": np.isin(rows.subject, left_out),
        "sightings of landmarks": left,
    }.items():
        kinds[name] = mask & left
        left = left & ~mask
    return kinds
