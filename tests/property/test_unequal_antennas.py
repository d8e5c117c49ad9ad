"""Robots with unequal antennas hear what robots hear that all have those antennas."""

from typing import Any

import numpy as np
import pytest

from wifipgo.loop import start
from wifipgo.scenarios import Scenario, scenario_named
from wifipgo.streams import Streams

QUIET = {"noise_floor": False, "common_phase": False, "timing_jitter_s": 0.0}
PLACES = ((0.1, 0.0), (-0.1, 0.0), (0.0, 0.08))


def profiles(scenario: Scenario, seed: int = 5) -> np.ndarray:
    return start(scenario, Streams.for_episode(seed, 0))[1].belief.radio.profile


def team(**changes: Any) -> Scenario:
    return scenario_named("paper-sim-2", n_robots=4, n_slots=3, size_m=9, n_obstacles=2, **changes)


@pytest.mark.parametrize("antennas_m", [(), PLACES])
def test_each_robot_hears_with_its_own_antennas(antennas_m: tuple[tuple[float, float], ...]) -> None:
    scale = (1.0, 0.25, 2.0, 0.25)
    mixed = profiles(team(antenna_scale=scale, antennas_m=antennas_m, **QUIET))
    for robot, factor in enumerate(scale):
        places_m = tuple((factor * x, factor * y) for x, y in antennas_m)
        alike = profiles(team(antenna_gap_m=0.22 * factor, antennas_m=places_m, **QUIET))
        np.testing.assert_allclose(mixed[robot], alike[robot], atol=1e-5)
        assert alike[robot].max() > 0.5


def test_a_factor_of_one_changes_nothing() -> None:
    np.testing.assert_array_equal(profiles(team()), profiles(team(antenna_scale=(1.0,) * 4)))


def test_antennas_further_apart_make_sharper_profiles() -> None:
    """Half the gap, lobes twice as wide: a share of the grid above half of the peak that grows."""
    mixed = profiles(team(antenna_scale=(0.25, 1.0, 1.0, 1.0), max_order=0, **QUIET))
    share = (mixed > 0.5 * mixed.max(axis=-1, keepdims=True)).mean(axis=(1, 2))
    assert share[0] > 1.5 * share[1:].max()


@pytest.mark.parametrize(
    ("scale", "message"),
    [
        ((1.0, 2.0), r"antenna_scale must be empty or 4 long"),
        ((1.0, 1.0, 0.0, 1.0), r"antenna_scale must be all in 0.01..100"),
        ((1.0, 1.0, "2", 1.0), r"antenna_scale\[2\] must be of type float, got '2'"),
    ],
)
def test_antennas_that_cannot_be(scale: tuple[object, ...], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        team(antenna_scale=scale)
