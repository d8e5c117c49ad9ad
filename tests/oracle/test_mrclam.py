"""Runs in the format of MRCLAM, held against circles known in closed form, and the refusal of bad files."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from support.data_dir import data_dir
from support.mrclam_folder import BEGIN_S, SPEED_M_S, circle, seen_by, write_run, write_table

from wifipgo.datasets import known_ate, read_mrclam
from wifipgo.datasets.interpolated_truth import truth_at
from wifipgo.datasets.noise import fitted_odometry
from wifipgo.datasets.wheel_path import Steps, steps_between, wheel_path
from wifipgo.errors import BadInputError, TextFileError
from wifipgo.graph.bearings import bearing_residuals
from wifipgo.graph.ranges import range_residuals
from wifipgo.se2 import compose


def test_exact_wheels_lead_along_the_circle(tmp_path: Path) -> None:
    run = read_mrclam(write_run(tmp_path))
    exact = np.stack([circle(n, run.time_s) for n in run.robots])
    assert run.robots == (1, 2, 3)
    np.testing.assert_allclose(run.time_s, BEGIN_S + np.arange(120))
    np.testing.assert_allclose(run.start, exact, atol=1e-6)
    np.testing.assert_allclose(run.truth, exact, atol=1e-6)
    assert known_ate(run.start, run.truth)[0].max() < 1e-12


def test_a_sighting_belongs_to_the_nearest_poses_and_turns_with_the_observer(tmp_path: Path) -> None:
    """What is left is the way that both drove in half a step, and nothing of the turn."""
    run = read_mrclam(write_run(tmp_path), step_s=2.0)
    off_rad, off_m = bearing_residuals(run.truth, run.bearings), range_residuals(run.truth, run.ranges)
    moved_m = 2.0 * SPEED_M_S
    assert np.abs(off_m).max() <= moved_m
    assert (np.abs(off_rad) <= moved_m / run.ranges.range_m).all()
    late_s = BEGIN_S + 6.5 - run.time_s[3]
    distance, azimuth = seen_by(1, 2, BEGIN_S + 6.5)
    row = np.flatnonzero((run.ranges.observer == [0, 3]).all(axis=1) & (run.ranges.target[:, 0] == 1))
    assert run.ranges.range_m[row] == pytest.approx(distance)
    assert run.bearings.azimuth_rad[row, 0] == pytest.approx(azimuth + 0.05 * late_s)


def test_every_sighting_is_counted_under_one_name(tmp_path: Path) -> None:
    folder = write_run(tmp_path, robots=(1, 2, 3))
    rows = [(BEGIN_S + 3.0, code, 1.0, 0.1) for code in (99.0, 5.0, 14.0, 41.0, 63.0)]
    write_table(folder / "Robot1_Measurement.dat", [*rows, (BEGIN_S + 500.0, 14.0, 1.0, 0.1)])
    (folder / "Robot2_Measurement.dat").unlink()
    run = read_mrclam(folder, robots=(1, 2))
    named = {name.removeprefix("sightings "): n for name, n in run.counts.items()}
    assert named["of unknown barcodes"] == named["of the robot itself"] == named["of robots left out"] == 1
    assert named["of robots"] == named["of landmarks"] == named["outside the time of the poses"] == 1
    assert run.landmarks.seen.tolist() == [6]
    assert run.landmarks.subject.tolist() == [6, 7]


def test_gaps_in_the_truth_stay_gaps(tmp_path: Path) -> None:
    folder = write_run(tmp_path)
    times = np.concatenate([np.arange(0.3, 40.0, 0.1), np.arange(60.0, 100.0, 0.1)]) + BEGIN_S
    rows = zip(times.tolist(), circle(2, times).tolist(), strict=True)
    write_table(folder / "Robot2_Groundtruth.dat", [(t, *pose) for t, pose in rows])
    (folder / "Robot3_Groundtruth.dat").unlink()
    run = read_mrclam(folder)
    assert run.time_s[0] == BEGIN_S + 1.0  # the first with a truth of both that have one
    known = run.known
    later_s = run.time_s - BEGIN_S
    np.testing.assert_array_equal(
        known[1], (later_s < 40.0) & (later_s > 0.2) | (later_s > 59.9) & (later_s < 100.0)
    )
    assert known[0].all()
    assert not known[2].any()
    assert run.counts["poses without truth"] == int((~known).sum())
    assert np.isfinite(known_ate(run.start, run.truth)[0]).tolist() == [True, True, False]
    assert run.start[2, 0].tolist() == [0.0, 0.0, 0.0]


def test_truth_is_interpolated_the_short_way_round() -> None:
    log = np.array([[0.0, 0.0, 0.0, 3.1], [0.4, 1.0, 2.0, -3.1], [2.0, 5.0, 5.0, 0.0]])
    found = truth_at(log, np.array([-0.1, 0.0, 0.2, 0.4, 1.0, 2.0, 2.1]))
    np.testing.assert_allclose(found[[1, 3, 5]], log[:, 1:], atol=1e-12)
    np.testing.assert_allclose(found[2, :2], [0.5, 1.0])
    assert np.abs(found[2, 2]) == pytest.approx(np.pi)
    assert np.isnan(found[[0, 4, 6]]).all()


def test_a_velocity_holds_until_the_next_row() -> None:
    """Forward, a turn on the spot, forward; the last of two rows with one stamp holds."""
    log = np.array(
        [[0.0, 1.0, 0.0], [1.0, 9.0, 9.0], [1.0, 0.0, np.pi / 2], [2.0, 1.0, 0.0], [2.1, 1.0, 0.0]]
    )
    steps = steps_between(wheel_path(log), np.array([0.0, 1.0, 2.0, 3.0]))
    place = np.zeros((1, 3))
    for z in steps.z:
        place = compose(place, z[None])
    np.testing.assert_allclose(place[0], [1.0, 1.0, np.pi / 2], atol=1e-12)
    np.testing.assert_allclose(steps.turned_rad, [0.0, np.pi / 2, 0.0], atol=1e-12)
    np.testing.assert_allclose(steps.unheard_s[:2], 0.75)


def test_the_fitted_noise_is_that_of_the_walk() -> None:
    """Independent errors of known variance for a metre and a radian."""
    rng, n = np.random.default_rng(5), 10_000
    driven, turned = rng.uniform(0.0, 0.2, n), np.repeat(rng.uniform(0.0, 0.4, n // 20), 20)
    sigma = np.sqrt([0.01 * driven + 0.002 * turned, 0.02 * driven + 0.05 * turned])
    error = rng.standard_normal((n, 3)) * sigma[[0, 0, 1]].T
    true = np.column_stack([driven, np.zeros(n), turned])
    truth = np.zeros((n + 1, 3))
    for k in range(n):
        truth[k + 1] = compose(truth[[k]], true[[k]])[0]
    found = fitted_odometry([Steps(true + error, driven, turned, np.ones(n), np.zeros(n))], truth[None])
    assert found is not None
    assert found[2:4] == pytest.approx([0.02, 0.05], rel=0.3)
    mean = found.t_m2_per_m * driven.mean() + found.t_m2_per_rad * turned.mean()
    assert mean == pytest.approx(float((sigma[0] ** 2).mean()), rel=0.1)


BAD: dict[str, tuple[Callable[[Path], object], str]] = {
    "unsorted": (
        lambda f: write_table(f / "Robot1_Odometry.dat", [(2.0, 0, 0), (1.0, 0, 0)]),
        r"Robot1_Odometry.dat:6: expected time stamps in ascending order, after 2, got 1 0 0",
    ),
    "unsorted truth": (
        lambda f: write_table(f / "Robot2_Groundtruth.dat", [(2.0, 0, 0, 0), (1.0, 0, 0, 0)]),
        r"Robot2_Groundtruth.dat:6: expected time stamps in ascending order",
    ),
    "unsorted sightings": (
        lambda f: write_table(f / "Robot2_Measurement.dat", [(2.0, 5, 1, 0), (1.0, 5, 1, 0)]),
        r"Robot2_Measurement.dat:6: expected time stamps in ascending order",
    ),
    "two truths": (
        lambda f: write_table(f / "Robot2_Groundtruth.dat", [(2.0, 0, 0, 0), (2.0, 1, 0, 0)]),
        r"Robot2_Groundtruth.dat:6: expected one pose at a time",
    ),
    "no odometry": (
        lambda f: (f / "Robot3_Odometry.dat").unlink(),
        r"Robot3_Odometry.dat: expected odometry of robot 3; robots= leaves robots out, got no such file",
    ),
    "one row": (
        lambda f: write_table(f / "Robot3_Odometry.dat", [(1.0, 0, 0)]),
        r"Robot3_Odometry.dat: expected two or more times of odometry, got 1 rows",
    ),
    "a word": (
        lambda f: (f / "Robot1_Odometry.dat").write_text("# t\n1 0 0\n\n2 zero 0\n"),
        r"Robot1_Odometry.dat:4: expected a number, got 'zero'",
    ),
    "a column": (
        lambda f: (f / "Robot1_Groundtruth.dat").write_text("1 0 0 0\n2 0 0\n"),
        r"Robot1_Groundtruth.dat:2: expected 4 numbers: time \(s\), x \(m\), y \(m\), orientat.*, got 3",
    ),
    "not finite": (
        lambda f: (f / "Robot1_Groundtruth.dat").write_text("1 0 0 0\n2 nan 0 0\n"),
        r"Robot1_Groundtruth.dat:2: expected finite numbers",
    ),
    "no range": (
        lambda f: write_table(f / "Robot1_Measurement.dat", [(1.0, 5, 0.0, 0)]),
        r"Robot1_Measurement.dat:5: expected a range > 0 m",
    ),
    "barcode twice": (
        lambda f: (f / "Barcodes.dat").write_text("1 5\n2 5\n"),
        r"Barcodes.dat:2: expected each barcode once, got 2 5",
    ),
    "no barcodes": (
        lambda f: (f / "Barcodes.dat").unlink(),
        r"Barcodes.dat: expected subject numbers of barcodes, got no such file",
    ),
    "no time in common": (
        lambda f: write_table(f / "Robot3_Odometry.dat", [(1.0, 0, 0), (2.0, 0, 0)]),
        r"odometry must be shared by all robots for 1 s or more, got",
    ),
    "no truth in common": (
        lambda f: write_table(f / "Robot3_Groundtruth.dat", [(1.0, 0, 0, 0), (2.0, 0, 0, 0)]),
        r"truth must be there at one time for all robots that have any",
    ),
}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A short run without fault."""
    return write_run(tmp_path_factory.mktemp("run"), lasts_s=12.0)


@pytest.mark.parametrize("fault", BAD)
def test_what_cannot_be_is_named_by_file_and_line(fault: str, whole: Path, tmp_path: Path) -> None:
    spoil, message = BAD[fault]
    for path in whole.iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    spoil(tmp_path)
    with pytest.raises(BadInputError, match=message):
        read_mrclam(tmp_path)


def test_folders_and_options_are_checked(whole: Path, tmp_path: Path) -> None:
    for arguments, message in (
        ({"folder": tmp_path}, "a folder with files RobotN_Odometry.dat"),
        ({"folder": tmp_path / "none"}, "folder must be a folder with the .dat files"),
        ({"folder": whole, "robots": (1, 9)}, r"robots must be some of \[1, 2, 3\], each once, got \(1, 9\)"),
        ({"folder": whole, "step_s": 0.0}, "step_s must be > 0 s, got 0.0"),
    ):
        with pytest.raises(BadInputError, match=message):
            read_mrclam(**arguments)
    assert issubclass(TextFileError, BadInputError)


def test_the_public_run_has_what_its_description_says() -> None:
    run = read_mrclam(data_dir("mrclam6"))
    sightings = sum(n for name, n in run.counts.items() if name.startswith("sightings"))
    assert len(run.bearings) == run.counts["sightings of robots"]
    assert sightings == 1942 + 4031 + 5627 + 2399 + 5378  # lines of the files that are no comments
    assert run.counts["sightings of unknown barcodes"] == 6
    assert known_ate(run.start, run.truth)[0].mean() > 5.0
    assert np.rad2deg(run.noise.bearing_sigma_rad) < 1.5
