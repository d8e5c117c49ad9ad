"""Rules of a team that shares a room: whose squares are whose, who drives, when they meet a last time."""

import numpy as np
import pytest

from baselines.policies import make_policy
from baselines.policies.exploration import MIDDLES
from baselines.policies.observation_view import Columns, View
from baselines.policies.team_exploration import Mesh, own_share
from baselines.policies.triggers import near_the_end
from wifipgo.scenarios import scenario_named

SCENARIO = scenario_named("paper-hw-2")
COLUMNS = Columns.of(SCENARIO)
STEP = SCENARIO.arena.step_m / SCENARIO.arena.size_m


def view_of(**blocks: list[list[float]]) -> View:
    """Two robots in the open; blocks by name, one row a robot (`/` written as two underscores)."""
    rows = np.zeros((2, COLUMNS.n_numbers), dtype=np.float32)
    rows[:, COLUMNS.robot["lidar"]] = 1.0
    rows[:, COLUMNS.robot["own/heading"]] = [1.0, 0.0]
    for name, values in blocks.items():
        rows[:, COLUMNS.robot[name.replace("__", "/")]] = values
    return View(rows, COLUMNS, 2)


def test_shares_are_the_halves_either_side_of_the_bisector() -> None:
    share = own_share(view_of(own__start=[[0.2, 0.5], [0.6, 0.5]]))
    np.testing.assert_array_equal(share[0], MIDDLES[:, 0] < 0.4)
    np.testing.assert_array_equal(share[0], ~share[1])


def test_a_robot_explores_its_own_share_first() -> None:
    """Both stand on the border of their shares, where as much is new on either side."""
    starts = [[0.1, 0.5], [0.9, 0.5]]
    view = view_of(own__start=starts, own__position=[[0.5, 0.5], [0.5, 0.5]])
    policy = make_policy("voronoi", SCENARIO)
    waypoints = policy.act_rows(view.rows[None])[0, :, 0]
    assert waypoints[0] < -0.5
    assert waypoints[1] > 0.5


def test_mesh_lands_where_a_loop_closes() -> None:
    """Four steps along a line in a room of which nothing is seen: the next ends near the first places."""
    came_from = np.arange(4)[:, None] * [STEP, 0.0] + [0.3, 0.5]
    motion = Mesh(SCENARIO, loop_worth=3.0, others_worth=1.0, rest_worth=1.0)
    free_steps = np.full((2, 16), 2.0)
    rng = np.random.default_rng(0)
    for position in came_from:
        waypoint = motion.step(view_of(own__position=[list(position)] * 2), free_steps, rng=rng)
    last = came_from[-1] + STEP * waypoint[0]
    old = came_from[: len(came_from) - SCENARIO.sensing.revisit_gap + 1]
    assert np.hypot(*(old - last).T).min() * SCENARIO.arena.size_m <= SCENARIO.sensing.sensor_range_m


@pytest.mark.parametrize(
    ("elapsed", "since_met", "calls"),
    [(0.5, 0.5, False), (0.9, 0.9, True), (0.9, 0.12, True), (0.9, 0.05, False)],
)
def test_a_last_call_is_made_unless_they_met_since(elapsed: float, since_met: float, calls: bool) -> None:
    view = view_of(own__elapsed=[[elapsed]] * 2, own__since_met=[[since_met]] * 2)
    assert near_the_end(0.2)(view).tolist() == [calls, calls]


def test_a_caller_drives_too_where_the_rule_says_so() -> None:
    """Its callee is heard from the left: the paper's caller waits, the other drives there."""
    n_bins = COLUMNS.slot["profile"].stop - COLUMNS.slot["profile"].start
    row = np.zeros((2, COLUMNS.n_numbers), dtype=np.float32)
    row[:, COLUMNS.robot["lidar"]] = 1.0
    row[0, COLUMNS.robot["own/err"]] = 2.0
    slot = row[:, COLUMNS.n_robot :]
    slot[:, COLUMNS.slot["present"]] = slot[:, COLUMNS.slot["discrepancy"]] = 1.0
    slot[0, COLUMNS.slot["i_call"]] = 1.0
    slot[0, COLUMNS.slot["profile"].start + 3 * n_bins // 4] = 1.0
    drives = make_policy("both_drive", SCENARIO).act_rows(row[None])[0, 0]
    waits = make_policy("frontier_home", SCENARIO).act_rows(row[None])[0, 0]
    np.testing.assert_allclose(drives, [0.0, 1.0, 1.0], atol=0.1)
    np.testing.assert_allclose(waits, [0.0, 0.0, 1.0])
