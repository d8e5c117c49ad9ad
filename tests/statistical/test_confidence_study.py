"""The simulated recordings behind the confidence: their truth, their ghosts, and a short study."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np

from benchmarks.confidence_study import rejection_curve, study
from benchmarks.simulated_rooms import TIMING_S, WAVELENGTH_M, draw_link, draw_room, two_way_product
from wifipgo.radio.aoa.moving_aperture import aperture_profiles

ROOT = Path(__file__).resolve().parents[2]


def test_rooms_are_blocked_as_asked_and_repeat() -> None:
    for blocked in (False, True):
        room = draw_room(np.random.default_rng(3), blocked=blocked)
        again = draw_room(np.random.default_rng(3), blocked=blocked)
        np.testing.assert_array_equal(room.position_m, again.position_m)
        way_m = np.linspace(room.transmitter_m, room.position_m.mean(axis=0), 2000)[:, None]
        low, high = room.boxes_m[:, :2], room.boxes_m[:, 2:]
        assert np.any(np.all((way_m > low) & (way_m < high), axis=2)) == blocked
        extent_m = np.ptp(room.position_m, axis=0)
        assert 0.5 < np.hypot(*extent_m) < 0.9


def test_timing_and_noise_are_what_the_estimator_removes() -> None:
    """The profiles of a recorded product are nearly those of the squared channel itself."""
    rng = np.random.default_rng(5)
    room, channel = draw_link(rng, blocked=False)
    position_m = np.pad(room.position_m, ((0, 0), (0, 1)))
    clean = (channel / np.abs(channel).mean()).astype(np.complex64) ** 2
    profiles = [
        aperture_profiles(product, position_m, wavelength_m=WAVELENGTH_M)[0]
        for product in (clean, two_way_product(channel, rng))
    ]
    assert min(TIMING_S) > 0.0
    assert profiles[0].argmax() == profiles[1].argmax()
    np.testing.assert_allclose(profiles[1], profiles[0], atol=0.1)


def test_links_in_sight_are_found() -> None:
    errors = [study((7, number), blocked=False).errors_deg["mean"] for number in range(8)]
    assert np.median(errors) < 2.0


def test_a_rejection_curve_ends_at_the_mean() -> None:
    errors = np.array([4.0, 1.0, 7.0])
    np.testing.assert_allclose(rejection_curve(errors, errors), [1.0, 2.5, 4.0])
    np.testing.assert_allclose(rejection_curve(-errors, errors), [7.0, 5.5, 4.0])


def test_the_command_writes_tables_and_picture(tmp_path: Path) -> None:
    written, picture = tmp_path / "new" / "study.json", tmp_path / "study.png"
    command = [sys.executable, "-m", "benchmarks.confidence_study", "--links", "20"]
    command += ["--json", str(written), "--picture", str(picture)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    content = json.loads(written.read_text("utf-8"))
    ratios = {row["confidence"]: row["ratio"] for row in content["ranking"]}
    assert min(ratios.values()) == ratios["an oracle"]
    assert {row["profile"] for row in content["accuracy"]} == {"two-way", "one-way", "mean"}
    assert picture.stat().st_size > 10_000
