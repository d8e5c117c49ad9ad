"""Runs of UTIAS MRCLAM as `TeamRun`: robots with odometry, cameras and motion capture."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float

from wifipgo import se2
from wifipgo.datasets.interpolated_truth import LONGEST_GAP_S, truth_at
from wifipgo.datasets.mrclam_logs import Logs, read_logs
from wifipgo.datasets.mrclam_sightings import Sightings, sightings_of
from wifipgo.datasets.noise import USUAL, Noise, fitted_odometry, middle_sigma
from wifipgo.datasets.team_run import Landmarks, TeamRun
from wifipgo.datasets.wheel_path import Steps, steps_between, wheel_path
from wifipgo.errors import require
from wifipgo.graph.bearings import Bearings
from wifipgo.graph.edges import Edges, extended
from wifipgo.graph.ranges import Ranges
from wifipgo.threads import one_thread


@one_thread
def read_mrclam(
    folder: str | Path,
    *,
    step_s: float = 1.0,
    robots: Sequence[int] | None = None,
    longest_gap_s: float = LONGEST_GAP_S,
) -> TeamRun:
    """Read a run of UTIAS MRCLAM.

    Poses are ``step_s`` apart: from the first such time, counted from when the last robot's odometry begins,
    at which every robot that has any truth has a true pose, to when the first robot's odometry ends. A
    sighting belongs to the pose nearest in time, its direction turned by what the observer's odometry
    turned in between.

    Args:
        folder: Where the files ``RobotN_*.dat`` and ``Barcodes.dat`` are.
        step_s: Time between poses, s.
        robots: Subject numbers of the robots to read; all that have a file if left out.
        longest_gap_s: Longest gap in the truth that is bridged, s.

    Returns:
        The run; ``counts`` says what became of the sightings, how many stamps were there twice, and how many
        poses have no truth.

    Raises:
        BadInputError: A file is missing or says what cannot be; names the file and the line.
        OSError: A file cannot be read.
    """
    require(0.0 < step_s < np.inf, "step_s", "> 0 s", step_s)
    require(0.0 <= longest_gap_s < np.inf, "longest_gap_s", ">= 0 s", longest_gap_s)
    logs = read_logs(Path(folder), robots)
    time_s = _times(logs, step_s, longest_gap_s)
    truth = np.stack([truth_at(r.truth.rows, time_s, longest_gap_s=longest_gap_s) for r in logs.robots])
    paths = [wheel_path(log.odometry.rows) for log in logs.robots]
    steps = [steps_between(path, time_s) for path in paths]
    seen = sightings_of(logs, paths, time_s)
    noise = _noise(steps, seen, truth)
    bearings, ranges = _measured(seen, noise)
    return TeamRun(
        tuple(log.number for log in logs.robots),
        time_s,
        truth,
        _dead_reckoned(steps, truth[:, 0]),
        _odometry(steps, noise),
        bearings,
        ranges,
        noise,
        _landmarks(logs, seen),
        seen.counts | _counts(logs, truth),
    )


def _times(logs: Logs, step_s: float, longest_gap_s: float) -> Float[np.ndarray, " times"]:
    """Times of the poses.

    Raises:
        BadInputError: There are no two of them.
    """
    spans = {log.number: tuple(log.odometry.rows[[0, -1], 0].tolist()) for log in logs.robots}
    begin_s, end_s = max(begin for begin, _ in spans.values()), min(end for _, end in spans.values())
    require(end_s - begin_s >= step_s, "odometry", f"shared by all robots for {step_s:g} s or more", spans)
    times = begin_s + step_s * np.arange(int((end_s - begin_s) / step_s + 1e-9) + 1)
    known = np.ones(len(times), dtype=bool)
    for log in logs.robots:
        if len(log.truth.rows):
            known &= np.isfinite(truth_at(log.truth.rows, times, longest_gap_s=longest_gap_s)[:, 0])
    rule = "there at one time for all robots that have any, while all have odometry"
    require(bool(known[:-1].any()), "truth", rule, [log.truth.source for log in logs.robots])
    return times[int(np.argmax(known)) :]


def _noise(steps: Sequence[Steps], seen: Sightings, truth: Float[np.ndarray, "robots times 3"]) -> Noise:
    """What the truth says of the errors; the usual where it says nothing."""
    azimuth_rad, range_m = seen.errors(truth)
    odometry, bearing, far = fitted_odometry(steps, truth), middle_sigma(azimuth_rad), middle_sigma(range_m)
    found = dict(zip(Noise._fields, (odometry, bearing, far), strict=False))
    return Noise(
        odometry or USUAL.odometry,
        bearing or USUAL.bearing_sigma_rad,
        far or USUAL.range_sigma_m,
        tuple(name for name, value in found.items() if value is not None),
    )


def _measured(seen: Sightings, noise: Noise) -> tuple[Bearings, Ranges]:
    """Sightings of robots as measurements of the library."""
    ends = {"observer": seen.observer, "target": seen.target}
    bearings = Bearings.measured(
        **ends, azimuth_rad=seen.azimuth_rad[:, None], sigma_rad=noise.bearing_sigma_rad
    )
    return bearings, Ranges.measured(**ends, range_m=seen.range_m, sigma_m=noise.range_sigma_m)


def _dead_reckoned(
    steps: Sequence[Steps], first: Float[np.ndarray, "robots 3"]
) -> Float[np.ndarray, "robots times 3"]:
    """Odometry from the first poses, or from zero where these are not known."""
    return se2.chained(np.where(np.isfinite(first), first, 0.0), np.stack([of.z for of in steps]))


def _odometry(steps: Sequence[Steps], noise: Noise) -> Edges:
    """Steps as measurements of the library."""
    return extended(*(_chain(robot, of, noise.odometry.sigma(of)) for robot, of in enumerate(steps)))


def _chain(robot: int, steps: Steps, sigma: Float[np.ndarray, "steps 2"]) -> Edges:
    """Steps of one robot."""
    index = np.arange(len(steps.z))
    at = np.full(len(index), robot)
    tail, head = np.stack([at, index], axis=1), np.stack([at, index + 1], axis=1)
    return Edges.measured(tail=tail, head=head, z=steps.z, sigma=sigma)


def _landmarks(logs: Logs, seen: Sightings) -> Landmarks:
    """Surveyed landmarks, and the sightings of what is no robot."""
    table = logs.landmarks.rows
    return Landmarks(table[:, 0].astype(np.int64), table[:, 1:3], *seen.of_landmarks)


def _counts(logs: Logs, truth: Float[np.ndarray, "robots times 3"]) -> dict[str, int]:
    """What else was found in the files."""
    odometry, true = np.sum([log.n_twice for log in logs.robots], axis=0).tolist()
    unknown = int((~np.isfinite(truth[..., 0])).sum())
    return {
        "odometry rows with the stamp of the row before": odometry,
        "truth rows that say the same twice": true,
        "poses without truth": unknown,
    }
