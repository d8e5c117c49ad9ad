"""A run of UTIAS MRCLAM: dead reckoning, and poses by the directions in which robots saw each other.

Run: python examples/11_real_robots.py FOLDER, of a run of the public set. Without FOLDER, two robots that are
made up here drive circles for two minutes, with wheels and cameras that err.
"""

import sys
from pathlib import Path

import numpy as np

from wifipgo.datasets import known_ate, read_mrclam
from wifipgo.graph.solvers.sightings import solve_sightings


def made_up(folder: Path) -> Path:
    """Write a run in the format of the set: circles of 2 m, odometry at 20 Hz, a sighting every second."""
    folder.mkdir(exist_ok=True)
    (folder / "Barcodes.dat").write_text("# subject, barcode\n1 5\n2 14\n")
    rng, time_s = np.random.default_rng(0), np.arange(0.0, 120.0, 0.05)
    yaw = 0.05 * time_s
    x, y = 2.0 * np.sin(yaw), 2.0 * (1.0 - np.cos(yaw))
    for robot, x0 in ((1, 0.0), (2, 5.0)):
        noise = rng.normal(0.0, 0.02, (2, len(time_s)))
        wheels = np.stack([time_s, 0.1 + noise[0], 0.05 + noise[1] + 0.01 * (-1) ** robot], axis=1)
        at = slice(10, -20, 20)
        bearing = (0.0 if robot == 1 else np.pi) - yaw[at] + rng.normal(0.0, 0.01, len(yaw[at]))
        code = np.full(len(bearing), 14.0 if robot == 1 else 5.0)
        seen = np.stack([time_s[at], code, np.full(len(bearing), 5.0), bearing], axis=1)
        np.savetxt(folder / f"Robot{robot}_Odometry.dat", wheels)
        np.savetxt(folder / f"Robot{robot}_Measurement.dat", seen)
        np.savetxt(folder / f"Robot{robot}_Groundtruth.dat", np.stack([time_s, x0 + x, y, yaw], axis=1))
    return folder


run = read_mrclam(Path(sys.argv[1]) if len(sys.argv) > 1 else made_up(Path("made_up_run")))
for what, n in run.counts.items():
    print(f"{n:7d} {what}")
print(f"bearings: {np.rad2deg(run.noise.bearing_sigma_rad):.2f} deg; ranges: {run.noise.range_sigma_m:.3f} m")

solved, report = solve_sightings(
    run.start, run.odometry, bearings=run.bearings, robots=range(len(run.robots)), loss="huber"
)
print(f"{report.n_used} measurements, {report.iterations} iterations, converged: {report.converged}")
for what, poses in (("dead reckoning", run.start), ("bearings only", solved)):
    print(f"{what}: mean square position error (Eq. 12) {np.nanmean(known_ate(poses, run.truth)[0]):.3f} m2")
