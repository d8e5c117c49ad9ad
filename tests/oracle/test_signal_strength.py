"""What robots make of the strength of a signal: courses that turn when it falls, distances, places."""

from typing import Any

import numpy as np
import pytest

from baselines.policies import make_policy
from baselines.policies.exploration import MIDDLES
from baselines.policies.observation_view import Columns, View
from baselines.policies.signal_strength import PingDistance
from baselines.policies.wiser_x import HeardShare
from envs.rendezvous_v0 import layout, parallel_env
from wifipgo.errors import BadInputError
from wifipgo.scenarios import scenario_named

SCENARIO = scenario_named("paper-hw-2", max_order=0)
LOUD = 45  # bin of the profile in which the other robot is heard
HEARD_RAD = -np.pi + 2.0 * np.pi / 72.0 * (LOUD + 0.5)


def observed(**values: Any) -> np.ndarray:
    """A called robot in the open, in the middle of the room and looking along x, with some blocks set."""
    fields = layout(SCENARIO)
    row = np.zeros(sum(field.size for field in fields), np.float32)
    usual: dict[str, Any] = {
        "slot0/present": 1.0,
        "slot0/discrepancy": 1.0,
        "slot0/calls_me": 1.0,
        "lidar": 1.0,
    }
    usual |= {"own/position": 0.5, "own/heading": np.array([1.0, 0.0])}
    for field in fields:
        row[field.where] = (usual | values).get(field.name, 0.0)
        if field.name == "slot0/profile":
            row[field.start + LOUD] = 1.0
    return row


def courses(spec: str, rows: list[np.ndarray]) -> list[float]:
    """Directions in which robot 0 drives, degrees."""
    policy = make_policy(spec, SCENARIO)
    policy.reset(0)
    steps = [policy.act({"robot_0": row, "robot_1": row.copy()})["robot_0"] for row in rows]
    return [float(np.degrees(np.arctan2(step[1], step[0]))) for step in steps]


def test_a_climber_turns_each_time_that_the_signal_falls() -> None:
    """Up, up, down, up, down; what it looks along does not matter, since its course is one in the world."""
    rows = [observed(**{"slot0/esnr": esnr}) for esnr in (0.1, 0.2, 0.15, 0.3, 0.2)]
    np.testing.assert_allclose(courses("climb", rows), [0, 0, 120, 120, -120], atol=1e-3)
    rows[1] = observed(**{"slot0/esnr": 0.2, "own/heading": np.array([0.0, 1.0])})
    np.testing.assert_allclose(courses("climb", rows)[:2], [0, -90], atol=1e-3)


def test_free_space_gives_the_distance() -> None:
    env = parallel_env(scenario=SCENARIO)
    for seed in range(4):
        env.reset(seed=seed)
        true_m = np.hypot(*np.diff(env.tick.truth.poses[:, -1, :2], axis=0)[0])
        rooms = PingDistance(SCENARIO).rooms(env.tick.belief.radio.esnr_db[[0], [1]])
        assert SCENARIO.arena.size_m * rooms[0] == pytest.approx(true_m, rel=0.02)


def test_distances_from_two_places_lead_to_the_caller() -> None:
    """The caller is at (0.8, 0.5); from a second place to the north its mirror image is ruled out."""
    caller, size_m = np.array([0.8, 0.5]), SCENARIO.arena.size_m
    rows = []
    for place in ([0.5, 0.5], [0.5, 0.6], [0.4, 0.6]):
        at_1_m_db = -20.0 * np.log10(PingDistance(SCENARIO).rooms(np.zeros(1))[0] ** -1 / size_m)
        esnr_db = at_1_m_db - 20.0 * np.log10(size_m * np.hypot(*(caller - place)))
        rows.append(observed(**{"slot0/esnr": esnr_db / 30.0, "own/position": np.array(place)}))
    gap = caller - [0.4, 0.6]
    expected = np.degrees(np.arctan2(gap[1], gap[0]))
    assert courses("ping_ranging", rows)[-1] == pytest.approx(expected, abs=6.0)


def test_squares_nearer_to_a_robot_that_is_heard_are_left_to_it() -> None:
    """It is heard at 6 m: what is further along that direction than 3 m is its share, and nothing else."""
    esnr_db = -20.0 * np.log10(6.0 / (SCENARIO.arena.size_m * PingDistance(SCENARIO).rooms(np.zeros(1))[0]))
    row = observed(**{"slot0/esnr": esnr_db / 30.0})
    view = View(np.stack([row, row]), Columns.of(SCENARIO), 2, np.ones(2, dtype=bool))
    share = HeardShare(SCENARIO, others_worth=0.3)._share(view)[0]
    ahead_m = SCENARIO.arena.size_m * (MIDDLES - 0.5) @ [np.cos(HEARD_RAD), np.sin(HEARD_RAD)]
    np.testing.assert_array_equal(share, ahead_m <= 3.0)


def test_a_turn_that_is_none_is_refused() -> None:
    with pytest.raises(BadInputError, match="climb:turn_deg"):
        make_policy("climb:turn_deg=0", SCENARIO)
