"""What robots conclude about their own knowledge: covariances, surveys, what a camera sees."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from envs.rendezvous_v0 import layout, observe
from property.test_loop import episode
from wifipgo.graph.covariance import spread_m
from wifipgo.loop.uncertainty import probability_in_place
from wifipgo.scenarios import Scenario, scenario_named
from wifipgo.se2 import length
from wifipgo.state import Belief
from wifipgo.world.coverage import TOLERANCE_M
from wifipgo.world.coverage_belief import N_BINS, covered
from wifipgo.world.sensing import sight_robots

SMALL = scenario_named("paper-sim-2", size_m=9.0)


def own_map(belief: Belief, robot: int, scenario: Scenario) -> np.ndarray:
    """CoverageBelief of one robot, square by square and pose by pose."""
    range_m, width_m = scenario.sensing.sensor_range_m, scenario.arena.size_m / N_BINS
    out = np.zeros((N_BINS, N_BINS))
    chance = probability_in_place(belief.paths.covariance_history[robot], reach_m=range_m)
    for pose, sure in zip(belief.paths.estimate[robot], chance, strict=True):
        for x in range(N_BINS):
            for y in range(N_BINS):
                away_m = np.hypot((x + 0.5) * width_m - pose[0], (y + 0.5) * width_m - pose[1])
                stands = (int(pose[0] // width_m), int(pose[1] // width_m)) == (x, y)
                if away_m <= range_m or stands:
                    out[x, y] = max(out[x, y], float(sure))
    return out


@settings(max_examples=3)
@given(st.integers(0, 10_000))
def test_a_survey_is_what_the_trajectory_as_now_believed_saw(seed: int) -> None:
    """Also after poses were optimised: nothing stays where it was believed to be before."""
    last = episode(SMALL, seed, n_steps=20)[-1].belief
    for robot in range(2):
        np.testing.assert_allclose(last.coverage.own[robot], own_map(last, robot, SMALL), atol=1e-6)


@given(st.floats(-1e6, 1e6), st.floats(-30.0, 30.0), st.floats(0.0, 1e6), st.floats(2.0, 40.0))
def test_a_survey_of_any_range_from_anywhere(x_m: float, y_m: float, range_m: float, size_m: float) -> None:
    """A belief may be far outside the room, and a sensor may see further than the room is wide."""
    p_m, none = np.array([[x_m, y_m]]), np.zeros((1, N_BINS, N_BINS), dtype=np.float32)
    own = covered(none, np.zeros(1, dtype=int), p_m, np.ones(1), size_m=size_m, range_m=range_m)
    middle_m = (np.arange(N_BINS) + 0.5) * (size_m / N_BINS)
    away_m = length(np.stack(np.meshgrid(middle_m, middle_m, indexing="ij"), axis=-1) - p_m)
    seen = away_m <= range_m
    stands = np.floor(p_m[0] / (size_m / N_BINS))
    if ((stands >= 0) & (stands < N_BINS)).all():
        seen[tuple(stands.astype(int))] = True
    np.testing.assert_array_equal(own[0] > 0.0, seen)


def test_who_meets_knows_what_the_others_saw() -> None:
    for tick in episode(SMALL, 0, n_steps=30):
        for group in tick.belief.team.met:
            known = tick.belief.coverage.known[list(group)]
            np.testing.assert_array_equal(known, np.broadcast_to(known[0], known.shape))
            break
    assert (tick.belief.coverage.received > 0.0).any()


def test_recognised_places_count_in_what_is_recorded_and_a_meeting_makes_it_so() -> None:
    """``recorded`` falls where a place is measured again, and a meeting makes both the same."""
    ticks = episode(SMALL, 1, n_steps=30)
    dips = 0
    for before, after in itertools.pairwise(ticks):
        belief, was = after.belief, before.belief
        now, recorded = spread_m(belief.paths.covariance), spread_m(belief.paths.predicted_covariance[:, -1])
        met = np.isin([0, 1], [robot for group in belief.team.met for robot in group])
        np.testing.assert_allclose(now[met], recorded[met])
        dips += int((recorded < spread_m(was.paths.predicted_covariance[:, -1])).sum())
    assert dips > 0


@pytest.mark.parametrize(("spread", "chance"), [(1e-6, 1.0), (TOLERANCE_M, 1.0 - np.exp(-1.0)), (50.0, 0.0)])
def test_chance_to_be_in_place_is_rayleighs(spread: float, chance: float) -> None:
    covariance = np.diag([spread**2 / 2.0, spread**2 / 2.0, 0.0])
    assert probability_in_place(covariance[None], reach_m=2.0)[0] == pytest.approx(chance, abs=1e-3)


def test_a_camera_sees_the_nearest_robot_and_nothing_in_the_dark() -> None:
    poses = np.array([[0.0, 0.0, np.pi / 2.0], [0.0, 3.0, 0.0], [5.0, 0.0, 0.0]])
    none, box = np.zeros((0, 2, 2)), np.array([[[-1.0, 1.5], [1.0, 1.5]]])
    seen = sight_robots(poses, none, range_m=6.0, rng=np.random.default_rng(0))
    assert seen[0, 0] == pytest.approx(3.0, rel=0.25)
    assert abs(seen[0, 1]) < np.deg2rad(10.0)
    behind = sight_robots(poses, box, range_m=6.0, rng=np.random.default_rng(0))
    assert behind[0, 0] == pytest.approx(5.0, rel=0.25)
    assert behind[0, 1] == pytest.approx(-np.pi / 2.0, abs=np.deg2rad(10.0))
    assert not sight_robots(poses, none, range_m=0.0, rng=np.random.default_rng(0)).any()


def test_observations_say_what_the_belief_says() -> None:
    belief = episode(SMALL, 2, n_steps=12)[-1].belief
    rows = observe(belief, SMALL)
    blocks = {f.name: rows[:, f.where] for f in layout(SMALL)}
    np.testing.assert_allclose(blocks["own/spread"][:, 0], spread_m(belief.paths.covariance), rtol=1e-6)
    np.testing.assert_allclose(blocks["own/start"] * 9.0, belief.paths.estimate[:, 0, :2], rtol=1e-5)
    np.testing.assert_array_equal(blocks["survey"].reshape(2, N_BINS, N_BINS), belief.coverage.known)
    assert blocks["own/elapsed"][0, 0] == pytest.approx(12 / 50)
