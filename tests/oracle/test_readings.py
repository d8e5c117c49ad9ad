"""Other readings of the paper's text: what observations count and are, odometry that errs by the drive."""

import numpy as np
import pytest

from baselines.evaluation.episodes import run_episodes
from envs.rendezvous_v0 import parallel_env
from wifipgo.errors import UnknownNameError
from wifipgo.loop.dead_reckoning import dead_reckon
from wifipgo.rendezvous import NOBODY, Calls, counted_from_calls
from wifipgo.scenarios import scenario_named
from wifipgo.world.sensing import SensingConfig, observe_robots, odometry

OBSERVED = np.array([[0, 2, 5], [2, 0, 1], [5, 1, 0]])


def calls(*callee: int) -> Calls:
    return Calls(np.array(callee), np.full(len(callee), 39.0))


@pytest.mark.parametrize(
    ("before", "now", "none"),
    [
        ((NOBODY, NOBODY, NOBODY), (NOBODY, NOBODY, NOBODY), []),
        ((NOBODY, NOBODY, NOBODY), (2, NOBODY, NOBODY), [(0, 2)]),
        ((2, NOBODY, NOBODY), (2, NOBODY, NOBODY), []),  # it is up still
        ((2, NOBODY, NOBODY), (1, NOBODY, NOBODY), [(0, 1)]),
        ((2, NOBODY, NOBODY), (2, NOBODY, 0), []),  # called back: the call of this pair is up already
        ((NOBODY, NOBODY, NOBODY), (1, NOBODY, 1), [(0, 1), (1, 2)]),
    ],
)
def test_observations_count_from_a_call(
    before: tuple[int, ...], now: tuple[int, ...], none: list[tuple[int, int]]
) -> None:
    expected = OBSERVED.copy()
    for i, j in none:
        expected[i, j] = expected[j, i] = 0
    worlds = [np.concatenate([part, part]) for part in (OBSERVED, expected)]
    np.testing.assert_array_equal(counted_from_calls(OBSERVED, calls(*before), calls(*now)), expected)
    twice = counted_from_calls(worlds[0], calls(*before, *before), calls(*now, *now))
    np.testing.assert_array_equal(twice, worlds[1])  # peers are numbers within a world


def test_odometry_that_grows_with_the_drive_has_its_noise() -> None:
    """None while a robot stands, as stated over 2 m, half of it over 1 m; pair by pair the same chance."""
    cfg = SensingConfig(odometry_noise="motion")
    before, after = np.zeros((3, 3)), np.array([[0.0, 0.0, 0.4], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]])
    moved = odometry(before, after, cfg=cfg, rng=np.random.default_rng(0))
    same = odometry(before, after, cfg=SensingConfig(), rng=np.random.default_rng(0))
    np.testing.assert_allclose(moved - after, (same - after) * np.array([[0.0], [0.5], [1.0]]), atol=1e-15)


def test_robots_state_the_noise_of_the_drive_that_they_measured() -> None:
    scenario = scenario_named("paper-sim-2", odometry_noise="motion")
    env = parallel_env(scenario=scenario)
    env.reset(seed=0)
    motion = np.array([[0.0, 0.0, 0.1], [0.6, 0.8, 0.0]])
    _, edges = dead_reckon(env.tick.belief.paths, motion, scenario)
    sigma = scenario.sensing.sigma_t_m, scenario.sensing.sigma_r_rad
    np.testing.assert_allclose(edges.sigma, [[1e-3, 1e-3], [0.5 * sigma[0], 0.5 * sigma[1]]])


def test_one_robot_of_a_pair_measures_the_other_turn_and_turn_about() -> None:
    """In two teams of three every pair is measured once, next time the other way, with the noise of both."""
    poses, n = np.random.default_rng(1).normal(size=(6, 3)), 3
    seen = np.tile(~np.eye(n, dtype=bool), (2, 1))

    def measured(by: str, t: int) -> dict[tuple[int, int], tuple[float, ...]]:
        chance = {"rng": np.random.default_rng(5), "outlier_rng": np.random.default_rng(6)}
        found = observe_robots(poses, t, seen, cfg=SensingConfig(measured_by=by), **chance)
        pairs = zip(found.tail[:, 0].tolist(), found.head[:, 0].tolist(), strict=True)
        return dict(zip(pairs, map(tuple, found.z.tolist()), strict=True))

    both, one, next_one = measured("both", 4), measured("one", 4), measured("one", 5)
    assert (len(both), len(one)) == (12, 6)
    assert one.items() <= both.items()
    assert {frozenset(pair) for pair in one} == {frozenset(pair) for pair in both}
    assert set(next_one) == {(head, tail) for tail, head in one}


def test_a_run_ends_with_exactly_nine_relative_poses() -> None:
    env = parallel_env("paper-outliers", size_m=3.0, measured_by="one")
    env.reset(seed=0)
    while env.agents:
        env.step({agent: np.array([0.0, 0.0, -1.0], dtype=np.float32) for agent in env.agents})
    assert np.count_nonzero(env.tick.belief.log.edges.between_robots) == 9


@pytest.mark.parametrize("field", ["odometry_noise", "kappa_since", "measured_by", "solve_weights"])
def test_readings_that_do_not_exist_are_listed(field: str) -> None:
    with pytest.raises(UnknownNameError, match="known: "):
        scenario_named("paper-hw-2", **{field: "other"})


def test_every_reading_plays_and_is_another_one() -> None:
    """Robots in a small room meet early, so every reading shows; worlds side by side are each as if alone."""
    small = {"size_m": 5.0, "n_steps": 12, "err_threshold": 1.0, "tx_power_dbm": -24.0}
    readings = [{}, {"solve_weights": "unit"}, {"odometry_noise": "motion"}, {"kappa_since": "call"}]
    readings += [{"measured_by": "one"}]
    ends = []
    for reading in readings:
        scenario = scenario_named("paper-hw-2", **small, **reading)
        ends.append(run_episodes(scenario, "active", [1, 2])[0].estimate)
        if reading:
            alone = run_episodes(scenario, "active", [1])[0].estimate
            np.testing.assert_array_equal(ends[-1], alone)
    drives = run_episodes(scenario_named("paper-hw-2", **small), "active:caller_drives=true", [1])
    ends.append(drives[0].estimate)
    different = [not np.array_equal(one, other) for k, one in enumerate(ends) for other in ends[:k]]
    assert all(different)
