"""Folders in the format of UTIAS MRCLAM, of robots that drive circles, known in closed form."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np
from jaxtyping import Float

BEGIN_S = 1_000.0
SPEED_M_S, TURN_RAD_S = 0.1, 0.05
BARCODES = {1: 5, 2: 14, 3: 41, 6: 63, 7: 81}  # robots 1 to 3, landmarks 6 and 7


def circle(robot: int, time_s: Float[np.ndarray, " times"]) -> Float[np.ndarray, "times 3"]:
    """Pose of a robot: on a circle of 2 m, by the integral of its velocities."""
    yaw0 = 0.7 * robot
    yaw = yaw0 + TURN_RAD_S * (time_s - BEGIN_S)
    radius = SPEED_M_S / TURN_RAD_S
    x = 3.0 * robot + radius * (np.sin(yaw) - np.sin(yaw0))
    y = -radius * (np.cos(yaw) - np.cos(yaw0))
    return np.stack([x, y, np.remainder(yaw + np.pi, 2.0 * np.pi) - np.pi], axis=-1)


def seen_by(robot: int, other: int, time_s: float) -> tuple[float, float]:
    """Distance and direction of another robot."""
    here, there = (circle(n, np.array([time_s]))[0] for n in (robot, other))
    dx, dy = there[:2] - here[:2]
    return float(np.hypot(dx, dy)), float(
        np.remainder(np.arctan2(dy, dx) - here[2] + np.pi, 2 * np.pi) - np.pi
    )


def write_table(path: Path, rows: Iterable[tuple[float, ...]]) -> None:
    """Write a file as the data set has them: four comment lines, then numbers between blanks and tabs."""
    lines = ["# UTIAS", "# produced", "# Format:", "# columns"]
    lines += [" \t ".join(f"{value:.9f}" for value in row) + " " for row in rows]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def write_run(
    folder: Path,
    *,
    lasts_s: float = 120.0,
    robots: tuple[int, ...] = (1, 2, 3),
    every_s: float = 5.3,
    wheels_err: tuple[float, float] = (0.0, 0.0),
) -> Path:
    """Write odometry, exact unless wheels err (m/s and rad/s), truth, and sightings of each other robot."""
    rng = np.random.default_rng(0)
    folder.mkdir(parents=True, exist_ok=True)
    table = [f"{subject} \t {code}" for subject, code in BARCODES.items()]
    (folder / "Barcodes.dat").write_text("# subject barcode\n" + "\n".join(table) + "\n", encoding="utf-8")
    write_table(
        folder / "Landmark_Groundtruth.dat", [(6.0, 1.0, 2.0, 1e-4, 1e-4), (7.0, 3.0, 4.0, 1e-4, 1e-4)]
    )
    for robot in robots:
        driven = np.arange(0.0, lasts_s, 0.05) + BEGIN_S
        errs = (rng.standard_normal((len(driven), 2)) * wheels_err).tolist()
        write_table(
            folder / f"Robot{robot}_Odometry.dat",
            [(t, SPEED_M_S + dv, TURN_RAD_S + dw) for t, (dv, dw) in zip(driven.tolist(), errs, strict=True)],
        )
        times = np.arange(0.0, lasts_s, 0.1) + BEGIN_S
        poses = zip(times.tolist(), circle(robot, times).tolist(), strict=True)
        write_table(folder / f"Robot{robot}_Groundtruth.dat", [(t, *pose) for t, pose in poses])
        seen = [
            (t, float(BARCODES[other]), *seen_by(robot, other, t))
            for t in (np.arange(1.2, lasts_s - 2.0, every_s) + BEGIN_S).tolist()
            for other in robots
            if other != robot
        ]
        write_table(folder / f"Robot{robot}_Measurement.dat", seen)
    return folder
